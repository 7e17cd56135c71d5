r"""Lyapunov matrices X(q), Y(q) of the LPV synthesis as polynomials in the scaled operating point, and their rates.

.. math:: X(q) = \sum_k q_1^{i_k} q_2^{j_k} X_k, \qquad
          \dot X = \frac{\partial X}{\partial q_1} \dot q_1 + \frac{\partial X}{\partial q_2} \dot q_2

dX/dt is linear in the rate of q: what holds at the corners of a box of rates holds within. Source: Apkarian, Adams
(1998).

Cites: apkarian_1998.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

Exponents = tuple[tuple[int, int], ...]


def exponents(order: int, moves: tuple[bool, bool] = (True, True)) -> Exponents:
    """Exponents of both scaled coordinates up to a total degree; (0, 0) alone for order 0.

    `moves` leaves out a coordinate that has one value in the range.
    """
    pairs = [(i, j) for i, j in product(range(order + 1), repeat=2) if i + j <= order]
    kept = [(i, j) for i, j in pairs if (moves[0] or not i) and (moves[1] or not j)]
    return tuple(sorted(kept, key=lambda pair: (sum(pair), pair[0] * pair[1], -pair[0])))


def functions(powers: Exponents, points: np.ndarray) -> np.ndarray:
    """Monomials (..., t) at scaled points (..., 2)."""
    return np.stack([points[..., 0] ** i * points[..., 1] ** j for i, j in powers], axis=-1)


def derivatives(powers: Exponents, points: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Time derivatives (..., t) of the monomials where the scaled point moves at `rate` (2,)."""
    x, y = points[..., 0], points[..., 1]
    found = [(i * x ** max(i - 1, 0) * y**j) * rate[0] + (j * x**i * y ** max(j - 1, 0)) * rate[1] for i, j in powers]
    return np.stack(found, axis=-1)


def corners(rates: np.ndarray) -> np.ndarray:
    """Corners (v, 2) of the box of rates -rates to rates; a rate of zero has one value."""
    return np.array(list(product(*[(-r, r) if r else (0.0,) for r in rates])))


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Symmetric matrix polynomial: coefficients (t, n, n) of t monomials."""

    powers: Exponents
    coefficients: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values (..., n, n) at scaled points (..., 2)."""
        return np.asarray(np.tensordot(functions(self.powers, points), self.coefficients, 1))

    def rate(self, points: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Time derivatives (..., n, n) at scaled points (..., 2) that move at `rate` (2,)."""
        return np.asarray(np.tensordot(derivatives(self.powers, points, rate), self.coefficients, 1))


@dataclass(frozen=True, eq=False)
class Solution:
    """X(q), Y(q), gamma, and the largest rates (2,) of the scaled point [1/ms] that they are made for.

    X Y >= (1 + inside)^2, which keeps I - X Y well conditioned; the inequalities keep a margin in proportion to it.
    """

    X: Polynomial
    Y: Polynomial
    gamma: float
    rates: np.ndarray
    inside: float = 0.0

    @property
    def corners(self) -> np.ndarray:
        """Corners (v, 2) of the box of rates; one, at rest, if neither matrix depends on q."""
        still = len(self.X.powers) == len(self.Y.powers) == 1
        return np.zeros((1, 2)) if still else corners(self.rates)

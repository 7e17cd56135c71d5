r"""LPV controller from the solution (X(q), Y(q), gamma), and the inequalities it must satisfy (thesis E.18, E.24).

With D_K = 0 the two rows that hold B^ and C^ are stationary where

.. math:: \begin{bmatrix} 0 & D_{21} & 0\\ D_{21}^T & -\gamma I & D_{11}^T\\ 0 & D_{11} & -\gamma I\end{bmatrix}
          \begin{bmatrix} \hat B^T\\ *\\ * \end{bmatrix} = -\begin{bmatrix} C_2\\ B_1^T X\\ C_1 \end{bmatrix}, \quad
          \begin{bmatrix} 0 & D_{12}^T & 0\\ D_{12} & -\gamma I & D_{11}\\ 0 & D_{11}^T & -\gamma I\end{bmatrix}
          \begin{bmatrix} \hat C\\ *\\ * \end{bmatrix} = -\begin{bmatrix} B_2^T\\ C_1 Y\\ B_1^T \end{bmatrix}

and A^ cancels the (2, 1) block. The controller's states are those of the plant as estimated, N = -X and
M' = Y - X^-1. It is not given the rate of q: what it would add for that, X dY/dt + N dM'/dt, is -dX/dt X^-1 in these
states, zero for a constant X and small else (with M = I as in the thesis it is X dY/dt). T2 is checked with it.
Source: Gahinet (1996), explicit controller formulas for LMI-based synthesis; Apkarian, Adams (1998) for the rates.

The Lyapunov matrices X(q), Y(q) are polynomials in the scaled operating point:

.. math:: X(q) = \sum_k q_1^{i_k} q_2^{j_k} X_k, \qquad
          \dot X = \frac{\partial X}{\partial q_1} \dot q_1 + \frac{\partial X}{\partial q_2} \dot q_2

dX/dt is linear in the rate of q: what holds at the corners of a box of rates holds within. Source: Apkarian, Adams
(1998).

Cites: apkarian_1998, gahinet_1996, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from rotorsim.control.designs.weighted_plant import Generalised
from rotorsim.control.systems import System


class Hats(NamedTuple):
    """A^, B^, C^ of thesis eq. (E.18); D_K is zero."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray


def _t(M: np.ndarray) -> np.ndarray:
    return np.swapaxes(M, -1, -2)


def _like(M: np.ndarray, many: tuple[int, ...]) -> np.ndarray:
    """A constant matrix for each of many points."""
    return np.broadcast_to(M, (*many, *M.shape[-2:]))


def hats(P: Generalised, X: np.ndarray, Y: np.ndarray, gamma: float) -> Hats:
    """A^, B^, C^ at one operating point, or at many if the matrices of P and X are stacked (..., n, n)."""
    B = _t(_row(P.D21, P.D11, gamma, P.C2, _t(P.B1) @ X, P.C1))
    C = _row(_t(P.D12), _t(P.D11), gamma, _t(P.B2), P.C1 @ Y, _t(P.B1))
    low = np.concatenate([_t(X @ P.B1 + B @ P.D21), P.C1], axis=-2)
    right = np.concatenate([_t(P.B1), P.C1 @ Y + P.D12 @ C], axis=-2)
    nw, nz, many = P.B1.shape[-1], P.C1.shape[-2], P.A.shape[:-2]
    Delta = np.block(
        [[_like(gamma * np.eye(nw), many), -_t(P.D11)], [-P.D11, _like(gamma * np.eye(nz), many)]]
    )  # fmt: skip
    A = -(_t(P.A) + _t(low) @ np.linalg.solve(Delta, right))
    return Hats(A, B, C)


def _row(D: np.ndarray, D11: np.ndarray, gamma: float, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """First rows of the solution of one of the two systems."""
    k, m = D.shape[-2:]
    p, many = D11.shape[-2], D.shape[:-2]
    left = np.block(
        [
            [_like(np.zeros((k, k)), many), D, _like(np.zeros((k, p)), many)],
            [_t(D), _like(-gamma * np.eye(m), many), _t(D11)],
            [_like(np.zeros((p, k)), many), D11, _like(-gamma * np.eye(p), many)],
        ]
    )
    return np.asarray(-np.linalg.solve(left, np.concatenate([a, b, c], axis=-2))[..., :k, :])


def controller_at(P: Generalised, solution: Solution, point: np.ndarray) -> System:
    """The controller at a scaled operating point (thesis eq. E.24), in the states of the plant."""
    X, Y = solution.X.at(point), solution.Y.at(point)
    hat = hats(P, X, Y, solution.gamma)
    inner = hat.A - X @ P.A @ Y - hat.B @ P.C2 @ Y - X @ P.B2 @ hat.C
    right = np.vstack([inner, hat.C]) @ np.linalg.solve(X @ Y - np.eye(P.order), X)  # M'^-1 = (X Y - I)^-1 X
    n = P.order
    left = -np.linalg.solve(X, np.hstack([right[:n], hat.B]))
    return System(left[:, :n], left[:, n:], right[n:], np.zeros((P.B2.shape[1], P.C2.shape[0])))


def separation(solution: Solution, points: np.ndarray) -> np.ndarray:
    """T1 (k, ., .) of thesis eq. (E.18), positive definite where I - X Y is regular, at scaled points (k, 2)."""
    X, Y = solution.X.at(points), solution.Y.at(points)
    eye = _like(np.eye(X.shape[-1]), X.shape[:-2])
    return np.block([[X, eye], [eye, Y]])


def performance(P: Generalised, solution: Solution, points: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """T2 (k, ., .) of thesis eq. (E.18) with the rates of X and Y, negative definite where the loop keeps gamma.

    Of the controller that `controller_at` builds, at scaled points (k, 2) that move at `rate` (2,) [1/ms]. The matrices
    of P are stacked over the points, (k, n, n) and so on.
    """
    X, Y, g = solution.X.at(points), solution.Y.at(points), solution.gamma
    dX, dY = solution.X.rate(points, rate), solution.Y.rate(points, rate)
    hat = hats(P, X, Y, g)
    many = P.A.shape[:-2]
    a, b = X @ P.A + hat.B @ P.C2, P.A @ Y + P.B2 @ hat.C
    c, d = _t(X @ P.B1 + hat.B @ P.D21), P.C1 @ Y + P.D12 @ hat.C
    nw, nz = P.B1.shape[-1], P.C1.shape[-2]
    cross = _t(hat.A) + P.A + np.linalg.solve(X, dX)  # the last is what the controller does not add
    return np.block(
        [
            [a + _t(a) + dX, _t(cross), _t(c), _t(P.C1)],
            [cross, b + _t(b) - dY, P.B1, _t(d)],
            [c, _t(P.B1), _like(-g * np.eye(nw), many), _t(P.D11)],
            [P.C1, d, P.D11, _like(-g * np.eye(nz), many)],
        ]
    )


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

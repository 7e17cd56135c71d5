r"""State-space interpolation: controller matrices as polynomials in speed and pressure (thesis section G.2).

.. math:: k_{lm}(q) = \sum_{i + j \le n} c_{ij} q_1^i q_2^j

A share of the local controllers is held out to measure it; the corners of the range never are.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.control.numerics.systems import System


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Coefficients (t, N, N) of the packed matrices [A B; C D] over exponents of q scaled to [-1, 1]."""

    coefficients: np.ndarray
    exponents: tuple[tuple[int, int], ...]
    low: np.ndarray
    high: np.ndarray
    states: int

    def at(self, speed: float, pressure: float) -> System:
        """The interpolated controller."""
        basis = monomials(self.exponents, scaled(self.low, self.high, np.array([[speed, pressure]])))[0]
        whole, n = np.tensordot(basis, self.coefficients, 1), self.states
        return System(whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:])


def exponents(order: int) -> tuple[tuple[int, int], ...]:
    """Exponents of all monomials in two variables up to a total degree."""
    return tuple((i, total - i) for total in range(order + 1) for i in range(total, -1, -1))


def scaled(low: np.ndarray, high: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (k, 2) scaled to [-1, 1]."""
    return np.asarray((points - (low + high) / 2) / np.where(high > low, (high - low) / 2, 1.0))


def monomials(powers: tuple[tuple[int, int], ...], points: np.ndarray) -> np.ndarray:
    """Values (k, t) at scaled points (k, 2)."""
    return np.array([points[:, 0] ** i * points[:, 1] ** j for i, j in powers]).T


def fit(points: np.ndarray, systems: list[System], order: int) -> Surfaces:
    """Least squares through controllers of one basis at points (k, 2) [rad/s, Pa]."""
    low, high = points.min(axis=0), points.max(axis=0)
    powers = exponents(order)
    whole = np.array([np.block([[s.A, s.B], [s.C, s.D]]) for s in systems])
    found = np.linalg.lstsq(monomials(powers, scaled(low, high, points)), whole.reshape(len(whole), -1), rcond=None)[0]
    return Surfaces(found.reshape(len(powers), *whole.shape[1:]), powers, low, high, systems[0].order)


def held_out(rows: int, columns: int) -> np.ndarray:
    """Which of a grid's points (rows x columns, the last index fastest) are held out: about a third, no corner."""
    i, j = np.divmod(np.arange(rows * columns), columns)
    corner = ((i == 0) | (i == rows - 1)) & ((j == 0) | (j == columns - 1))
    return ((i + 2 * j) % 3 == 1) & ~corner

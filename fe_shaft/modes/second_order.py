r"""M q'' + D q' + K q = 0 as a pencil J - s S of the states (q, q'), with factors of the dynamic stiffness alone.

.. math:: \det(J - s S) = \pm \det(K + s D + s^2 M)

The state form: Friswell et al. (2010).

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

Vector = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """Mass M, damping with gyroscopic terms D and stiffness K (n, n) in SI."""

    M: NDArray[np.float64]
    D: NDArray[np.float64]
    K: NDArray[np.float64]

    @property
    def size(self) -> int:
        """Number of states."""
        return 2 * len(self.M)

    def times_J(self, x: Vector) -> Vector:
        """J x for x (2n, k)."""
        q, v = x[: len(self.M)], x[len(self.M) :]
        return np.concatenate([v, -self.K @ q - self.D @ v])

    def times_S(self, x: Vector, transposed: bool = False) -> Vector:
        """S x for x (2n, k); M is symmetric, so the transposed one is the same."""
        return np.concatenate([x[: len(self.M)], self.M @ x[len(self.M) :]])

    def factor(self, s: complex) -> ShiftedSecondOrder:
        """Factors at s [rad/s]."""
        return ShiftedSecondOrder(self, s)

    def log_det(self, s: complex) -> complex:
        """Logarithm of the determinant up to a constant, the imaginary part modulo 2 pi."""
        sign, size = np.linalg.slogdet(self.K + s * self.D + s * s * self.M)
        return complex(size + 1j * np.angle(sign))


@dataclass(frozen=True, eq=False)
class ShiftedSecondOrder:
    """J - s S at one complex frequency."""

    pencil: SecondOrder
    s: complex

    @cached_property
    def _factors(self) -> Any:
        p, s = self.pencil, self.s
        return lu_factor(p.K + s * p.D + s * s * p.M, check_finite=False)

    def solve(self, b: Vector) -> Vector:
        """(J - s S)^-1 b for b (2n,)."""
        p, s, n = self.pencil, self.s, len(self.pencil.M)
        q = -lu_solve(self._factors, b[n:] + p.D @ b[:n] + s * (p.M @ b[:n]), check_finite=False)
        return np.concatenate([q, b[:n] + s * q])

    def adjoint(self, b: Vector) -> Vector:
        """(J - s S)^-H b for b (2n,)."""
        p, back, n = self.pencil, np.conj(self.s), len(self.pencil.M)
        force = -lu_solve(self._factors, b[:n] + back * b[n:], trans=2, check_finite=False)
        return np.concatenate([b[n:] + p.D.T @ force + back * (p.M @ force), force])

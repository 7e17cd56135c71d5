r"""Pencils, regions of the complex plane and modes, the values that the rest of this room works on.

A rotor M q'' + D q' + K q = 0 is a pencil J - s S of the states (q, q'), with factors of the dynamic stiffness alone.

.. math:: \det(J - s S) = \pm \det(K + s D + s^2 M)

The state form: Friswell et al. (2010).

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

Vector = NDArray[Any]

OSCILLATES = 1e-6
"""Imaginary part over modulus above which an eigenvalue oscillates."""


class Factor(Protocol):
    """Factors of J - s S, at one s for any columns or at several for a column each."""

    def solve(self, b: Vector) -> Vector:
        """(J - s S)^-1 b for b (n, k)."""

    def adjoint(self, b: Vector) -> Vector:
        """(J - s S)^-H b for b (n, k)."""


class Pencil(Protocol):
    """Real pencil J - s S."""

    @property
    def size(self) -> int:
        """Number of states n."""

    def times_J(self, x: Vector) -> Vector:
        """J x for x (n, k)."""

    def times_S(self, x: Vector, transposed: bool = False) -> Vector:
        """S x or S' x for x (n, k)."""

    def factor(self, s: complex | Vector) -> Factor:
        """Factors at s [rad/s], one or (k,)."""

    @property
    def log_det(self) -> Callable[[Vector], Vector]:
        """Logarithm of det(J - s S) at s (k,) up to a constant, imaginary parts modulo 2 pi; each s is computed once.

        A factor whose roots are real and negative may be divided out: no sector of damping ratios below 1 holds one.
        """

    @property
    def complete(self) -> dict[Region, Modes]:
        """Modes that were found so far, by the region in which none is missing."""


@dataclass(frozen=True)
class Region:
    """Sector floor < |s| < reach [rad/s] of damping ratios below `zeta`, growing modes included."""

    reach: float
    floor: float
    zeta: float = 0.5

    def holds(self, s: Any) -> Any:
        """Whether eigenvalues [rad/s] oscillate in the region."""
        size = np.abs(s)
        inside = (size > self.floor) & (size < self.reach) & (-np.real(s) < self.zeta * size)
        return inside & (np.imag(s) > OSCILLATES * size)

    def covers(self, other: Region) -> bool:
        """Whether another region lies within this one."""
        return self.reach >= other.reach and self.floor <= other.floor and self.zeta >= other.zeta

    @property
    def wider(self) -> Region:
        """The region with a rim, in which modes are followed beyond the border."""
        return Region(1.3 * self.reach, 0.5 * self.floor, min(self.zeta + 0.15, 0.5 * (1 + self.zeta)))

    def border(self, s: complex) -> str:
        """The border beyond which an eigenvalue [rad/s] lies; empty inside."""
        if abs(s) >= self.reach:
            return "reach"
        if abs(s) <= self.floor:
            return "floor"
        if -s.real >= self.zeta * abs(s):
            return "damping"
        return "" if self.holds(s) else "no oscillation"


@dataclass(frozen=True, eq=False)
class Quotient:
    """The determinant of a pencil over its known roots (k,) [rad/s], none below the real axis, and their partners.

    `steps` are those (side, from, to) along the border of a region with which the last count came to its end, its own
    or that of a neighbour with the same ones.
    """

    pencil: Pencil
    known: Vector
    steps: dict[Region, list[tuple[int, float, float]]] = field(default_factory=dict)

    @cached_property
    def _roots(self) -> Vector:
        real = np.abs(self.known.imag) <= OSCILLATES * np.abs(self.known)
        return np.concatenate([self.known[real].real, self.known[~real], self.known[~real].conj()])

    def log(self, s: Vector) -> Vector:
        """Logarithm at s (k,), imaginary parts modulo 2 pi."""
        return np.asarray(self.pencil.log_det(s) - np.log(s[:, None] - self._roots).sum(axis=1))


def each_once(function: Callable[[Vector], Vector]) -> Callable[[Vector], Vector]:
    """A function of s (k,) that keeps its values."""
    known: dict[complex, complex] = {}

    def at(s: Vector) -> Vector:
        asked = s.tolist()
        new = [one for one in dict.fromkeys(asked) if one not in known]
        known.update(zip(new, function(np.array(new)).tolist() if new else [], strict=True))
        return np.array([known[one] for one in asked])

    return at


def log_of(matrices: Vector) -> Vector:
    """Logarithms (k,) of the determinants of complex matrices (k, n, n)."""
    sign, size = np.linalg.slogdet(matrices)
    return np.asarray(size + 1j * np.angle(sign))


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenvalues (k,) [rad/s] with vectors (n, k), left^H S right = I, ascending in modulus.

    `missing` is the number of eigenvalues of the region that are not among them, NaN where it could not be counted,
    `quotient` that by which they were counted.
    """

    values: Vector
    right: Vector
    left: Vector
    missing: float = float("nan")
    quotient: Quotient | None = None

    @property
    def proven(self) -> bool:
        """Whether it is proven that none is missing."""
        return self.missing == 0

    @property
    def above(self) -> Modes:
        """The same modes, each that was met below the real axis with its partner's eigenvalue and vectors."""
        below = self.values.imag < -OSCILLATES * np.abs(self.values)
        values, right, left = (np.where(below, x.conj(), x) for x in (self.values, self.right, self.left))
        return replace(self, values=values, right=right, left=left)

    def take(self, which: Any) -> Modes:
        """Modes of the indices or flags `which`."""
        return Modes(self.values[which], self.right[:, which], self.left[:, which], self.missing, self.quotient)


def nothing(size: int) -> Modes:
    """No modes of a pencil of a size."""
    return Modes(np.zeros(0, complex), np.zeros((size, 0), complex), np.zeros((size, 0), complex))


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """Mass M, damping with gyroscopic terms D and stiffness K (n, n) in SI."""

    M: NDArray[np.float64]
    D: NDArray[np.float64]
    K: NDArray[np.float64]
    complete: dict[Region, Modes] = field(default_factory=dict, init=False)

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

    def factor(self, s: complex | Vector) -> ShiftedSecondOrder:
        """Factors at s [rad/s], one or (k,)."""
        return ShiftedSecondOrder(self, np.atleast_1d(s))

    @cached_property
    def log_det(self) -> Callable[[Vector], Vector]:
        """Logarithms of the determinant at s (k,) up to a constant, imaginary parts modulo 2 pi."""

        def log_det(s: Vector) -> Vector:
            return np.concatenate([log_of(self.K + x * self.D + x * x * self.M) for x in s[:, None, None, None]])

        return each_once(log_det)


@dataclass(frozen=True, eq=False)
class ShiftedSecondOrder:
    """J - s S at complex frequencies s (k,)."""

    pencil: SecondOrder
    s: Vector

    @cached_property
    def _factors(self) -> list[Any]:
        p = self.pencil
        return [lu_factor(p.K + s * p.D + s * s * p.M, check_finite=False) for s in self.s]

    def solve(self, b: Vector) -> Vector:
        """(J - s S)^-1 b for b (2n, k)."""
        p, s, n = self.pencil, self.s, len(self.pencil.M)
        q = -self._solved(b[n:] + p.D @ b[:n] + s * (p.M @ b[:n]), 0)
        return np.concatenate([q, b[:n] + s * q])

    def adjoint(self, b: Vector) -> Vector:
        """(J - s S)^-H b for b (2n, k)."""
        p, back, n = self.pencil, np.conj(self.s), len(self.pencil.M)
        force = -self._solved(b[:n] + back * b[n:], 2)
        return np.concatenate([b[n:] + p.D.T @ force + back * (p.M @ force), force])

    def _solved(self, b: Vector, trans: int) -> Vector:
        parts = [b] if len(self.s) == 1 else b.T[..., None]
        solved = [lu_solve(one, x, trans, check_finite=False) for one, x in zip(self._factors, parts, strict=True)]
        return np.hstack(solved)

r"""Number of eigenvalues in a region that are not known, by the argument principle.

With the known ones divided out of the determinant,

.. math:: N = \frac{1}{2\pi i} \int_\Gamma \frac{g'}{g}\,ds, \qquad g(s) = \frac{\det(J - s S)}{\prod_k (s - \lambda_k)}

is 0 where none is missing, and g is so smooth that few points on the border tell its turns.

Source: Delves and Lyness (1967).

Cites: delves_lyness_1967.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_shaft.modes.pencil import OSCILLATES, Pencil, Region, Vector

SMALL_STEP = 1e-6
"""Relative step of the derivative of the determinant."""
SURE = 0.3
"""Difference of the determinant's logarithm from what its derivatives say below which a step is certain."""
SPLITS = 400
"""Points after which the count along one side of the region is given up."""


def missing_in(pencil: Pencil, region: Region, known: Vector) -> float:
    """Number of eigenvalues of the region that are not among the known ones (k,), NaN where it stays open.

    Half of the border, from the real axis to the real axis: the other half is its mirror image. A region of every
    damping ratio is the whole disc.
    """
    end = np.pi - np.arccos(region.zeta)
    tilt, depth = np.exp(1j * end), np.log(region.reach / region.floor)
    many = 1 + int(np.ceil(depth / 2))
    pieces = [
        (lambda t: region.reach * np.exp(1j * end * t), 1j * end, 2),
        (lambda t: region.reach * np.exp(-depth * t) * tilt, -depth, many),
        (lambda t: region.floor * np.exp(1j * end * (1 - t)), -1j * end, 1),
    ]
    if region.zeta >= 1:
        pieces = pieces[:1]
    g = _Quotient(pencil, known)

    def side(path: Callable[[float], complex], rate: complex, count: int) -> float:
        return _turned(lambda t: g.at(path(t), rate), count)

    turns = sum(side(*piece) for piece in pieces) / np.pi
    return float(round(turns)) if abs(turns - round(turns)) < 0.05 else float("nan")


@dataclass(frozen=True, eq=False)
class _Quotient:
    """The determinant over its known roots."""

    pencil: Pencil
    known: Vector

    def log(self, s: complex) -> complex:
        pairs = self.known[self.known.imag > OSCILLATES * np.abs(self.known)]
        real = self.known[self.known.imag <= OSCILLATES * np.abs(self.known)].real
        roots = np.log(s - pairs).sum() + np.log(s - pairs.conj()).sum() + np.log(s - real + 0j).sum()
        return complex(self.pencil.log_det(s) - roots)

    def at(self, s: complex, rate: complex) -> tuple[complex, complex]:
        """Logarithm at s and its derivative along a path with ds/dt = rate s."""
        here = self.log(s)
        return here, _wrapped(self.log(s * (1 + SMALL_STEP)) - here) / SMALL_STEP * rate


def _wrapped(change: complex) -> complex:
    """A change of a logarithm with its imaginary part between -pi and pi."""
    return complex(change.real, (change.imag + np.pi) % (2 * np.pi) - np.pi)


def _turned(logarithm: Callable[[float], tuple[complex, complex]], count: int) -> float:
    """Change of the phase over 0 <= t <= 1; NaN where it stays open.

    Intervals are halved until modulus and phase change as their derivatives say: a root close to the path bends them.
    """
    known: dict[float, tuple[complex, complex]] = {}

    def at(t: float) -> tuple[complex, complex]:
        if t not in known:
            known[t] = logarithm(t)
        return known[t]

    total, left_over = 0.0, [(k / count, (k + 1) / count) for k in range(count)]
    while left_over:
        a, b = left_over.pop()
        m, h = 0.5 * (a + b), b - a
        (ga, da), (gm, dm), (gb, db) = at(a), at(m), at(b)
        halves = h * (5 * da + 8 * dm - db) / 24, h * (-da + 8 * dm + 5 * db) / 24
        coarse = h * (da + dm) / 4, h * (dm + db) / 4
        off = _wrapped(gm - ga - halves[0]), _wrapped(gb - gm - halves[1])
        if max(map(abs, off)) < SURE and all(abs(x - y) < 1 for x, y in zip(halves, coarse, strict=True)):
            total += sum(x.imag + y.imag for x, y in zip(halves, off, strict=True))
        elif len(known) > SPLITS or not np.isfinite(gm):
            return float("nan")
        else:
            left_over += [(a, m), (m, b)]
    return total

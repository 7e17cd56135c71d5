r"""All modes of a pencil in a region, their number proven: a small pencil's are all computed, others' are counted.

What is missing among the known eigenvalues is counted by the argument principle. With the known ones divided out of the
determinant,

.. math:: N = \frac{1}{2\pi i} \int_\Gamma \frac{g'}{g}\,ds, \qquad g(s) = \frac{\det(J - s S)}{\prod_k (s - \lambda_k)}

is 0 where none is missing. g turns by what lies outside, in steps that see every root close to the border. A
neighbouring pencil's g must not be divided out: a root that came in over the border would stand next to its own former
place outside, and the two hide each other.

Source: Delves and Lyness (1967).

Cites: delves_lyness_1967.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fe_shaft.modes.pencil import Modes, Pencil, Quotient, Region, nothing
from fe_shaft.modes.subspace import SMALL, around, everything, joined, refined, settled, unknown

FARTHEST = 1e4
"""Multiple of the region's reach up to which growth without oscillation is searched in a large pencil."""
NEARLY = 1.01
"""Ratio of the ends of an interval that holds a real root, from which its vector is computed."""
ANGLES = (112.0, 80.0, 119.0, 100.0, 60.0)
"""Angles [deg] in the complex plane of shifts about a modulus at which a mode is missing."""
CLOSELY = 1.2
"""Ratio of the ends of an interval that holds the modulus of a missing mode, within which shifts find it."""
SMALL_STEP = 1e-6
"""Relative step of the derivative of the determinant."""
SURE = 0.3
"""Difference of the logarithm's change from what its derivatives state below which a step is certain."""
BENT = 4.0
"""Change of its derivative times a step below which the step is certain: a root within the step makes it 4 or more."""
SPLITS = 400
"""Steps after which the count along one side of the region is given up."""


def modes_in(pencil: Pencil, region: Region, hints: Sequence[float] = (), seed: Modes | None = None) -> Modes:
    """All modes of a pencil in the region, their number proven.

    Parameters
    ----------
    pencil : Pencil
    region : Region
    hints : sequence of float
        Frequencies [rad/s] around which modes are expected.
    seed : Modes, optional
        Those of a neighbouring pencil, from which these are refined before others are looked for.

    Returns
    -------
    Modes
        Those of the region and some around it that were met; `missing` is 0 where the count proves it complete.
    """
    known = everything(pencil) if pencil.size <= SMALL else _found(pencil, region, hints, seed)
    return known.take(np.argsort(np.abs(known.values), kind="stable"))


def _found(pencil: Pencil, region: Region, hints: Sequence[float], seed: Modes | None) -> Modes:
    """Modes grown out of the seed, then modes around shifts until the count proves that none is missing.

    The shifts lie where modes are expected, then where the count puts the lowest that is missing.
    """
    known, shifts = nothing(pencil.size), _expected(region, hints)
    if seed is not None:
        known, shifts = counted(pencil, refined(pencil, seed), region), []
    while not known.proven:
        before, counts = len(known.values), not shifts
        for shift in shifts or _about_missing(known, region):
            known = joined(pencil, known, settled(pencil, unknown(known, around(pencil, shift), region)))
        if counts and len(known.values) == before:
            break
        known, shifts = counted(pencil, known, region), []
    return _with_growth(pencil, region, known)


def counted(pencil: Pencil, known: Modes, region: Region) -> Modes:
    """The modes with the number of those of the region that are missing among them."""
    g = Quotient(pencil, known.values)
    return replace(known, missing=missing_in(region, g), quotient=g)


def _with_growth(pencil: Pencil, region: Region, known: Modes) -> Modes:
    """The modes with a motion beyond the region that grows without oscillation, where the determinant's sign shows one.

    On the positive real axis the determinant over the known roots is real; between the reach and `FARTHEST` of it an
    odd number of real roots changes its sign.
    """
    g = known.quotient or Quotient(pencil, known.values)

    def positive(s: float) -> bool:
        return bool(np.cos(g.log(complex(s)).imag) > 0)

    low, high = region.reach, FARTHEST * region.reach
    if positive(low) == positive(high):
        return known
    while high > NEARLY * low:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if positive(middle) == positive(low) else (low, middle)
    more = settled(pencil, unknown(known, around(pencil, complex(np.sqrt(low * high))), region))
    found = joined(pencil, known, more)
    return replace(found, missing=known.missing, quotient=Quotient(pencil, found.values))


def _expected(region: Region, hints: Sequence[float]) -> list[complex]:
    """Shifts [rad/s] around the hints and evenly over the reach."""
    near = [h for h in hints if region.floor < h < region.reach]
    even = [region.reach * (k + 0.5) / 3 for k in range(3)]
    return [1j * f for f in [*near, *(f for f in even if all(abs(f - h) > 0.1 * region.reach for h in near))]]


def _about_missing(known: Modes, region: Region) -> list[complex]:
    """Shifts [rad/s] of the lowest modulus about which a mode is missing, by counts in parts of the region."""
    low, high = region.floor, region.reach
    assert known.quotient is not None
    while high > CLOSELY * low:
        middle = float(np.sqrt(low * high))
        if missing_in(replace(region, floor=low, reach=middle), known.quotient) == 0:
            low = middle
        else:
            high = middle
    return [np.sqrt(low * high) * np.exp(1j * np.deg2rad(angle)) for angle in ANGLES]


def missing_in(region: Region, g: Quotient) -> float:
    """Number of eigenvalues of the region that are not among the known ones, NaN where it stays open.

    Half of the border, from the real axis to the real axis: the other half is its mirror image. A region of every
    damping ratio is the whole disc.
    """
    end = np.pi - np.arccos(region.zeta)
    tilt, depth = np.exp(1j * end), np.log(region.reach / region.floor)
    sides = [
        (lambda t: region.reach * np.exp(1j * end * t), 1j * end, 2),
        (lambda t: region.reach * np.exp(-depth * t) * tilt, -depth, int(np.ceil(depth / 5))),
        (lambda t: region.floor * np.exp(1j * end * (1 - t)), -1j * end, 1),
    ]
    if region.zeta >= 1:
        sides = sides[:1]

    number = sum(_turned(g.log, *side) for side in sides) / np.pi
    return abs(float(np.round(number))) if abs(number - np.round(number)) < 0.05 else float("nan")


def _wrapped(change: complex) -> complex:
    """A change of a logarithm with its imaginary part between -pi and pi."""
    return complex(change.real, (change.imag + np.pi) % (2 * np.pi) - np.pi)


def _turned(log: Callable[[complex], complex], path: Callable[[float], complex], rate: complex, count: int) -> float:
    """Change of the phase of a logarithm along a path over 0 <= t <= 1 with ds/dt = rate s; NaN where it stays open.

    Steps are halved until modulus and phase change as the derivatives at both ends state: a root close to the path
    bends them.
    """

    def at(t: float) -> tuple[complex, complex]:
        s = path(t)
        here = log(s)
        return here, rate * _wrapped(log(s * (1 + SMALL_STEP)) - here) / SMALL_STEP

    total, steps = 0.0, 0
    left_over = [(k / count, (k + 1) / count) for k in range(count)]
    while left_over:
        a, b = left_over.pop()
        steps += 1
        (first, out), (last, into) = at(a), at(b)
        mean = 0.5 * (b - a) * (out + into)
        off = _wrapped(last - first - mean)
        if abs(off) < SURE and (b - a) * abs(into - out) < BENT:
            total += (mean + off).imag
        elif steps > SPLITS or not np.isfinite(off):
            return float("nan")
        else:
            left_over += [(a, 0.5 * (a + b)), (0.5 * (a + b), b)]
    return total

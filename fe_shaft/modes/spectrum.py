"""All modes of a pencil in a region, their number proven: a small pencil's are all computed, others' are counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe_shaft.modes.count import missing_in
from fe_shaft.modes.pencil import Modes, Pencil, Quotient, Region, nothing
from fe_shaft.modes.subspace import SMALL, around, everything, joined, refined, settled, unknown

FARTHEST = 1e4
"""Multiple of the region's reach up to which growth without oscillation is searched in a large pencil."""
NEARLY = 1.01
"""Ratio of the ends of an interval that holds a real root, from which its vector is computed."""


def modes_in(pencil: Pencil, region: Region, hints: Sequence[float] = (), seed: Modes | None = None) -> Modes:
    """All modes of a pencil in the region and some around it that were met; `missing` is 0 where the count proves it.

    `hints` are frequencies [rad/s] around which modes are expected, `seed` the modes of a neighbouring pencil, from
    which these are refined before others are looked for.
    """
    known = everything(pencil) if pencil.size <= SMALL else _found(pencil, region, hints, seed)
    return known.take(np.argsort(np.abs(known.values), kind="stable"))


def _found(pencil: Pencil, region: Region, hints: Sequence[float], seed: Modes | None) -> Modes:
    """Modes grown out of the seed, then modes around shifts until the count proves that none is missing."""
    like, rounds = None, [[], *_shifts(region, hints)]
    known = nothing(pencil.size)
    if seed is None:
        rounds = rounds[1:]
    else:
        known, like = refined(pencil, seed), seed.quotient if seed.proven else None
    for shifts in rounds:
        for shift in shifts:
            known = joined(pencil, known, settled(pencil, unknown(known, around(pencil, shift), region)))
        known = counted(pencil, known, region, like)
        if known.proven:
            break
    return _with_growth(pencil, region, known)


def counted(pencil: Pencil, known: Modes, region: Region, like: Quotient | None = None) -> Modes:
    """The modes with the number of those of the region that are missing among them; `like` is a neighbour's count."""
    g = Quotient(pencil, known.values)
    return replace(known, missing=missing_in(region, g, like), quotient=g)


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


def _shifts(region: Region, hints: Sequence[float]) -> list[list[complex]]:
    """Rounds of shifts [rad/s]: around the hints and evenly over the reach, then between, then towards the edge."""
    near = [h for h in hints if region.floor < h < region.reach]
    even = [region.reach * (k + 0.5) / 3 for k in range(3)]
    first = [f for f in even if all(abs(f - h) > 0.1 * region.reach for h in near)]
    rounds = [[1j * f for f in [*near, *first]]]
    for count in (6, 12):
        step = region.reach / count
        rounds.append([step * (k + 0.5) * np.exp(1j * np.deg2rad(a)) for k in range(count) for a in (80, 112)])
    ladder = np.geomspace(region.floor, region.reach, 12)
    return [*rounds, [r * np.exp(1j * np.deg2rad(a)) for r in ladder for a in (60, 100, 119)]]

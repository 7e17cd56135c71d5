"""Onset of growth over a parameter: where the least damping ratio of all modes loses its sign first.

Damping may be lost and come back between two values. A step is halved as long as tangents of damping ratios at both
ends lead below zero at the other one, as they do where a damping ratio dips.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rotorsim.base.rounding import DAMPED, falls_below_zero

HALVINGS = 8
"""Halvings of a step in which damping may be lost and come back."""
NEARBY = 1e-5
"""Small step over that between two values: of a derivative, and behind an onset where growth may not oscillate."""


@dataclass(frozen=True, eq=False)
class ModesAt:
    """A value of the parameter: least damping ratio and its frequency [rad/s], the modes' ratios (k,) and their slopes.

    The least is (-1, 0) of growth without oscillation; `slopes` are derivatives (k,) on the side of another value.
    """

    at: float
    least: tuple[float, float]
    zeta: NDArray[np.float64]
    slopes: Callable[[float], NDArray[np.float64]]


def first_loss(
    place: Callable[[float], ModesAt], known: Sequence[ModesAt], **tolerances: float
) -> tuple[tuple[float, float] | None, bool]:
    """Lowest value at which a mode grows, and its frequency [rad/s], between known ascending places; None without one.

    And whether each step up to there was decided: not where a tangent is unknown, or where halving found no end.
    `tolerances` are those of Brent's method, xtol and rtol.
    """
    if _grows(known[0]):
        return (known[0].at, known[0].least[1]), True
    decided = True
    for a, b in pairwise(known):
        end, sure = (b, True) if _grows(b) else _dip(place, a, b, HALVINGS)
        decided &= sure
        if end is not None:
            onset = falls_below_zero(lambda v: min(place(v).least[0], 1.0) + DAMPED, a.at, end.at, **tolerances)
            behind = min(onset + NEARBY * (end.at - a.at), end.at)
            diverges = end.least[1] == 0 and place(behind).least[1] == 0
            return (onset, 0.0 if diverges else place(onset).least[1]), decided
    return None, decided


def _grows(place: ModesAt) -> bool:
    return place.least[0] < -DAMPED


def _dip(place: Callable[[float], ModesAt], a: ModesAt, b: ModesAt, halvings: int) -> tuple[ModesAt | None, bool]:
    """A value between two at which a mode grows, None where no two tangents lead below zero; whether it is decided."""
    ahead, back = (
        (one.zeta + (other.at - one.at) * one.slopes(other.at)).min(initial=np.inf) for one, other in ((a, b), (b, a))
    )
    if ahead >= -DAMPED or back >= -DAMPED:
        return None, True
    if not halvings or np.isnan(ahead + back):
        return None, False
    middle = place(0.5 * (a.at + b.at))
    if _grows(middle):
        return middle, True
    first, sure = _dip(place, a, middle, halvings - 1)
    if first is not None:
        return first, sure
    second, too = _dip(place, middle, b, halvings - 1)
    return second, sure and too

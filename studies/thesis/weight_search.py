r"""Weight search behind the preset 'rig', on the identified model alone.

Of all H-infinity designs over a grid of weights whose disk margin at five points is at least `MARGIN`: the one with the
least predicted norm of the responses to hits, averaged over twelve operating points. None of them is among the twenty
points of thesis section E.5.1 that the laws are verified at.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

from rotorsim.base.errors import DesignError
from rotorsim.base.units import KRPM
from rotorsim.control.designs import hinf
from rotorsim.control.designs.hinf_synthesis import Weights
from rotorsim.control.plants import Model
from rotorsim.control.sampled_loop import hit_ratios, model_loop

POINTS = tuple((w * KRPM, p * 1e6) for w in (0.75, 2.25, 3.75, 5.25) for p in (0.35, 0.5, 0.65))
CORNERS = ((0.0, 0.3e6), (0.0, 0.7e6), (6 * KRPM, 0.3e6), (6 * KRPM, 0.7e6), (3 * KRPM, 0.5e6))
MARGIN = 0.8
NOTCHES = ((0.3, 0.05), (0.3, 0.1), (0.5, 0.1), (0.2, 0.05))
"""zeta_1, zeta_2."""
REST = (0.5, 0.7, 0.8, 0.9, 1.0)
FORCES = (0.0, 0.1, 0.2, 0.3, 0.5)


class Candidate(NamedTuple):
    """Weights, mean and largest predicted ratio of response norms, smallest disk margin."""

    weights: Weights
    mean: float
    worst: float
    margin: float


def candidates(model: Model, grid: Iterator[Weights] | None = None) -> Iterator[Candidate]:
    """Every design of the grid that exists."""
    for weights in grid or all_weights():
        try:
            law = hinf.design(model, hinf.Spec(weights=weights, delay=None))
        except DesignError:
            continue
        ratio = hit_ratios(law, model, POINTS)
        margin = min(model_loop(law, model, *q).disk_margin for q in CORNERS)
        yield Candidate(weights, float(ratio.mean()), float(ratio.max()), margin)


def all_weights() -> Iterator[Weights]:
    """The grid."""
    for (zeta_1, zeta_2), k_0, force in product(NOTCHES, REST, FORCES):
        yield Weights(zeta_1=zeta_1, zeta_2=zeta_2, k_0=k_0, force=force)


def chosen(model: Model, grid: Iterator[Weights] | None = None) -> Candidate:
    """The least mean among those with the margin; raises DesignError if none has it."""
    good = [one for one in candidates(model, grid) if one.margin >= MARGIN]
    if not good:
        raise DesignError(
            f"choosing: no weights leave a disk margin of {MARGIN}; widen the grid", argument="weights", value=MARGIN
        )
    return min(good, key=lambda one: one.mean)

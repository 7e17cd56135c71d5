"""Comparison of surfaces through black-box models with those of Model 3, at points held out from the fit.

The points are those of the grid's first, middle and last speed and pressure. The responses at all other points of the
grid are those of Model 2 there, which comes closest to the records.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

import identification as idn
from identification.campaign import identify_source
from rotorsim.study.local_models import Local
from rotorsim.study.pool import Each

LINES = 60


@dataclass(frozen=True, eq=False)
class Coherent:
    """Relative distance (k,) of frequency responses at the other points: surfaces of Model 3, and of black-box models
    of order 6 in one coherent basis; number of those that are unstable there; number of points they were made from."""

    grey: np.ndarray
    black: np.ndarray
    unstable: int
    made_from: int


def coherent(points: Sequence[Local], each: Each = map) -> Coherent | None:
    """The comparison; None where the grid has fewer than three lines each way or no point is left."""
    q = np.array([(p.source.speed, p.source.pressure) for p in points])
    lines = [np.unique(np.round(column, 3)) for column in q.T]
    few = [set(line[[0, len(line) // 2, -1]]) for line in lines]
    inside = [all(np.round(v, 3) in kept for v, kept in zip(at, few, strict=True)) for at in q]
    taken = [p for p, yes in zip(points, inside, strict=True) if yes]
    others = [p for p, yes in zip(points, inside, strict=True) if not yes]
    if min(map(len, lines)) < 3 or not others:
        return None
    black = [one.result for one in each(partial(identify_source, model="blackbox"), [p.source for p in taken])]
    if any(result is None for result in black):
        return None
    grey_lpv = idn.fit_lpv([p.found["3"] for p in taken], 2)
    black_lpv = idn.fit_lpv([result for result in black if result is not None], 2)
    made = [black_lpv.at(p.source.speed, p.source.pressure) for p in others]
    greys = [grey_lpv.at(p.source.speed, p.source.pressure) for p in others]
    return Coherent(_distances(greys, others), _distances(made, others),
                    sum(not model.stable for model in made), len(taken))  # fmt: skip


def _distances(models: Sequence[idn.LinearModel], points: Sequence[Local]) -> np.ndarray:
    found = []
    for model, point in zip(models, points, strict=True):
        one = point.found["2"]
        omega = np.geomspace(0.05, 2.5, LINES) * one.wn.mean()
        wanted = one.model.transfer(omega)
        found.append(np.linalg.norm(model.transfer(omega) - wanted) / np.linalg.norm(wanted))
    return np.array(found)

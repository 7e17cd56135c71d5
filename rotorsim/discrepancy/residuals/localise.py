"""Localisation of the misfit: line groups with residuals above the noise floor."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from rotorsim.discrepancy.residuals.comparison import Comparison

SIGMAS, LEAST = 6.0, 20.0
"""A group is flagged when its sum of squares is beyond its number by so many standard deviations and so much: of two
numbers, as an order has, one in 60 000 is by chance."""
CHANNELS = "xy"


@dataclass(frozen=True)
class Flag:
    """Line group with a residual above the floor: record, point, channel, group, sums, sizes [m]."""

    record: str
    point: str
    channel: str
    group: str
    numbers: int
    chi2: float
    rms: float
    floor: float
    amplitude: float
    number: int

    @property
    def excess(self) -> float:
        """Part of the sum of squares that the noise floor does not explain."""
        return self.chi2 - self.numbers


def table(comparison: Comparison, residual: np.ndarray) -> list[Flag]:
    """All line groups with their sums of squares, flagged or not."""
    layout, out = comparison.layout, []
    for i, trial in enumerate(comparison.trials):
        for c in range(2):
            for name in layout.groups:
                own = layout.of(i, c, name)
                n = int(own.sum())
                if not n:
                    continue
                r, s = residual[own], comparison.sigma[own]
                rms, low = float(np.sqrt(np.mean((r * s) ** 2))), float(np.sqrt(np.mean(s**2)))
                out.append(
                    Flag(trial.name, trial.point, CHANNELS[c], name, n, float(r @ r), rms, low, trial.amplitude, i)
                )
    return out


def flagged(groups: list[Flag]) -> list[Flag]:
    """Line groups above the floor, worst first."""
    worst = [g for g in groups if g.excess > max(SIGMAS * sqrt(2 * g.numbers), LEAST)]
    return sorted(worst, key=lambda g: -g.excess)


def excess(groups: list[Flag]) -> float:
    """Sum of the misfit above the floor in flagged groups."""
    return sum(g.excess for g in flagged(groups))

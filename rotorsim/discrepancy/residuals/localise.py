"""Localisation of the misfit: line groups with residuals above the noise floor."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.residuals.comparison import TwinComparison

SIGMAS, LEAST = 6.0, 20.0
"""A group is flagged when its sum of squares is beyond its number by so many standard deviations and so much: of two
numbers, as an order has, one in 60 000 is by chance."""


@dataclass(frozen=True)
class Misfit:
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
    speed: float = 0.0
    """Shaft speed [rad/s] of vectors at which the residual is largest; 0 for records, which have one speed."""
    largest: float = 0.0
    """Residual [m, 0-pk] there."""

    @property
    def place(self) -> str:
        """Where among the rows of vectors the residual is largest, as text; empty for records."""
        return f"{self.largest * TO_UM:.3g} um at {self.speed * TO_RPM:.0f} rpm" if self.speed else ""

    @property
    def excess(self) -> float:
        """Part of the sum of squares that the noise floor does not explain."""
        return self.chi2 - self.numbers


def table(comparison: TwinComparison, residual: np.ndarray) -> list[Misfit]:
    """All line groups with their sums of squares, flagged or not."""
    layout, out = comparison.layout, []
    for i, trial in enumerate(comparison.trials):
        for c, channel in enumerate(trial.channels):
            for name in layout.groups:
                own = layout.of(i, c, name)
                n = int(own.sum())
                if not n:
                    continue
                r, s = residual[own], comparison.sigma[own]
                rms, low = float(np.sqrt(np.mean((r * s) ** 2))), float(np.sqrt(np.mean(s**2)))
                speed, largest = _peak(trial, layout.frequency[own], r * s) if trial.orders else (0.0, 0.0)
                out.append(
                    Misfit(
                        trial.name, trial.point, channel, name, n, float(r @ r), rms, low, trial.amplitude, i,
                        speed, largest,
                    )
                )  # fmt: skip
    return out


def _peak(trial: Trial, lines: np.ndarray, metres: np.ndarray) -> tuple[float, float]:
    """Speed [rad/s] and size [m, 0-pk] of the largest residual of a group of vectors; lines (n,) by their number."""
    if not lines.any():
        return 0.0, 0.0
    size = np.sqrt(np.bincount(lines.astype(int), weights=metres**2))
    line = int(np.argmax(size))
    return trial.speed_at(line), float(size[line])


def flagged(groups: list[Misfit]) -> list[Misfit]:
    """Line groups above the floor, worst first."""
    worst = [g for g in groups if g.excess > max(SIGMAS * sqrt(2 * g.numbers), LEAST)]
    return sorted(worst, key=lambda g: -g.excess)


def excess(groups: list[Misfit]) -> float:
    """Sum of the misfit above the floor in flagged groups."""
    return sum(g.excess for g in flagged(groups))

r"""Localisation of the misfit: groups of lines beyond the noise floor, and response that does not repeat.

A group of lines is flagged by its sum of squared residuals. The mean over blocks, which a diagnosis compares, does not
show a tone between the lines of a block, which may cancel there; so the scatter between blocks is tested as well,

.. math:: \chi^2 = \sum_{b, f} |r_b(f) - \bar r(f)|^2 / \sigma^2(f)

over blocks b and lines f away from the orders of the shaft, with the pooled scatter of the records.

Cites: bendat_2010.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE, TO_RPM, TO_UM
from rotorsim.discrepancy.data.blocks import TURNING
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.residuals.floor import FAINTEST as FAINTEST

SIGMAS, FAINTEST = 6.0, 20.0
"""Standard deviations, and least excess, by which a group's sum of squares is beyond its number where it is flagged;
of two numbers, as an order has, one in 60 000 is by chance."""
UNSTEADY = "unsteady"
"""Name of the group of lines between the orders that do not repeat."""
NEAR_ORDER = 1.5
"""Distance to an order, in lines, within which lines are left out: a speed that wavers spreads it."""


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
        """Row of vectors with the largest residual, as text; empty for records."""
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
    worst = [g for g in groups if g.excess > max(SIGMAS * sqrt(2 * g.numbers), FAINTEST)]
    return sorted(worst, key=lambda g: -g.excess)


def excess(groups: list[Misfit]) -> float:
    """Sum of the misfit above the floor in flagged groups."""
    return sum(g.excess for g in flagged(groups))


def unsteady(trials: list[Trial], residuals: list[np.ndarray], scatter: np.ndarray) -> list[Misfit]:
    """Records and channels with more scatter between blocks than the noise; worst first.

    `residuals` are measured less simulated lines (blocks, 2, lines) [m], `scatter` (records, 2, lines) [m] standard
    deviations of a real part of a record's mean line.
    """
    found = []
    for i, (trial, residual) in enumerate(zip(trials, residuals, strict=True)):
        if not trial.periodic or trial.blocks < 2:
            continue
        quiet = _quiet(trial)
        apart = (residual - residual.mean(axis=0))[:, :, quiet]
        for c, channel in enumerate(trial.channels):
            sigma = np.hypot(scatter[i, c, : len(quiet)][quiet] * sqrt(trial.blocks), FAINTEST)
            n = 2 * (trial.blocks - 1) * int(quiet.sum())
            chi2 = float(np.sum(np.abs(apart[:, c]) ** 2 / sigma**2)) if n else 0.0
            if chi2 - n > max(SIGMAS * sqrt(2 * n), FAINTEST):
                rms, floor = float(np.sqrt(np.mean(np.abs(apart[:, c]) ** 2))), float(np.sqrt(2 * np.mean(sigma**2)))
                found.append(
                    Misfit(trial.name, trial.point, channel, UNSTEADY, n, chi2, rms, floor, trial.amplitude, i)
                )
    return sorted(found, key=lambda f: -f.excess)


def tone(trial: Trial, residual: np.ndarray) -> tuple[float, np.ndarray]:
    """Frequency [Hz] and size (2,) [m, 0-pk, complex] of the largest tone between the lines of a block."""
    blocks, _, lines = residual.shape
    spectra = np.zeros((blocks, 2, trial.length // 2 + 1), complex)
    spectra[:, :, 1:lines] = (residual - residual.mean(axis=0))[:, :, 1:] * (trial.length / 2)
    series = np.fft.irfft(spectra, trial.length, axis=2).transpose(0, 2, 1).reshape(-1, 2)
    whole = np.fft.rfft(series, axis=0)[: blocks * (lines - 1)] * (2 / len(series))
    k = int(np.argmax(np.abs(whole).max(axis=1)))
    return k / (len(series) * RIG_SAMPLE), whole[k]


def _quiet(trial: Trial) -> np.ndarray:
    """Mask (lines,) of the lines away from the mean and from the orders."""
    f = trial.frequencies
    away = f > f[1] / 2
    turns = abs(trial.speed) / (2 * np.pi)
    if abs(trial.speed) > TURNING:
        away &= np.abs(f - np.round(f / turns) * turns) > NEAR_ORDER * f[1]
    return np.asarray(away)

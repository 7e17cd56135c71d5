r"""Detection of non-periodic response: scatter between excitation periods that noise does not explain.

.. math:: \chi^2 = \sum_{b, f} |r_b(f) - \bar r(f)|^2 / \sigma^2(f)

over blocks b and lines f away from the orders of the shaft, with the pooled scatter of the records. The mean over
blocks, which a diagnosis compares, does not see a tone between the lines of a block: it may cancel there.

Cites: bendat_2010.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.data.window import TURNING
from rotorsim.discrepancy.residuals.floor import LEAST as FAINTEST
from rotorsim.discrepancy.residuals.localise import LEAST, SIGMAS, Misfit

GROUP = "unsteady"
NEAR_ORDER = 1.5
"""Lines this near to an order are left out: a speed that wavers spreads it."""


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
            if chi2 - n > max(SIGMAS * sqrt(2 * n), LEAST):
                rms, floor = float(np.sqrt(np.mean(np.abs(apart[:, c]) ** 2))), float(np.sqrt(2 * np.mean(sigma**2)))
                found.append(Misfit(trial.name, trial.point, channel, GROUP, n, chi2, rms, floor, trial.amplitude, i))
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
    """Which lines (lines,) are away from the mean and from the orders."""
    f = trial.frequencies
    away = f > f[1] / 2
    turns = abs(trial.speed) / (2 * np.pi)
    if abs(trial.speed) > TURNING:
        away &= np.abs(f - np.round(f / turns) * turns) > NEAR_ORDER * f[1]
    return np.asarray(away)

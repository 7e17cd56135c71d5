r"""Runout profile for a figure: mean and scatter over the shaft angle at slow roll, from a record of any length.

.. math:: d(\alpha) = d_0 + \sum_n \Re\{R_n e^{i n \alpha}\}

Mean and scatter in bins of the shaft angle, in one pass, and the harmonics of the mean. What a prefilter subtracts is
`identification.records.runout`: a function of the angle, without gaps and of zero mean, from samples in memory.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from identification.records.runout import fit_harmonics
from rotorsim.signals.missing import need
from rotorsim.signals.record_blocks import blocks

BINS, HARMONICS = 180, 8


@dataclass(frozen=True)
class RunoutProfile:
    """Over `angle` (bin,) [rad]: `mean` (bin, axis) [m] about its own mean and standard deviation `scatter` (bin,
    axis) [m]; `harmonic` (order, axis) complex 0-pk [m] of 1X, 2X ...; number of `revolutions`."""

    angle: np.ndarray
    mean: np.ndarray
    scatter: np.ndarray
    harmonic: np.ndarray
    revolutions: float


def runout_of(record: xr.Dataset, name: str, revolutions: float, bins: int = BINS) -> RunoutProfile:
    """Runout profile of a variable (time, axis) [m] over `angle`, in one pass; empty bins are NaN.

    Test: ``test_signals.py::test_a_runout_of_known_harmonics_is_found``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> slow = rs.experiments.slow_roll(plant, speed=60.0, pressure=0.5e6, revolutions=2)
    >>> rs.signals.runout_of(slow, "disc", revolutions=2.0).mean.shape
    (131, 2)
    """
    need(revolutions >= 1, f"The shaft turns {revolutions:.2g} revolutions; a runout takes a whole one.")
    bins = int(np.clip(record.sizes["time"] / (4 * revolutions), 2 * HARMONICS + 2, bins))
    count, sums, squares = np.zeros(bins), np.zeros((bins, 2)), np.zeros((bins, 2))
    origin = np.asarray(record[name].isel(time=0).values, float)
    for block in blocks(record, ("angle", name)):
        index = np.minimum((block["angle"] % (2 * np.pi) * bins / (2 * np.pi)).astype(int), bins - 1)
        d = block[name] - origin
        count += np.bincount(index, minlength=bins)
        for k in range(2):
            sums[:, k] += np.bincount(index, d[:, k], bins)
            squares[:, k] += np.bincount(index, d[:, k] ** 2, bins)
    held = np.where(count > 0, count, np.nan)[:, None]
    mean = sums / held
    scatter = np.sqrt(np.maximum(squares / held - mean**2, 0))
    angle = (np.arange(bins) + 0.5) * 2 * np.pi / bins
    return RunoutProfile(angle, mean - np.nanmean(mean, axis=0), scatter, _harmonics(angle, mean), revolutions)


def _harmonics(angle: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Complex amplitudes (order, axis) of the profile over the bins that hold samples."""
    seen = np.isfinite(mean[:, 0])
    c = fit_harmonics(angle[seen], mean[seen], HARMONICS)
    return np.asarray(c[:HARMONICS] - 1j * c[HARMONICS:])

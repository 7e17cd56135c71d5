r"""Readings of a record's probes: numbers of each, planes that see an orbit, runout over the shaft angle.

The runout profile of a figure is the mean over the shaft angle at slow roll.

.. math:: d(\alpha) = d_0 + \sum_n \Re\{R_n e^{i n \alpha}\}

Mean and scatter in bins of the shaft angle, in one pass, and the harmonics of the mean. What a prefilter subtracts is
`identification.records.runout`: a function of the angle, without gaps and of zero mean, from samples in memory.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from identification import SchemaError
from identification.records.runout import fit_harmonics
from identification.records.sensors import SAME_PLACE, probe_outputs
from rotorsim.signals.record_blocks import blocks, need

READINGS = "probe_measured"
SHOWN = {"m": ("µm", 1e6), "m/s": ("mm/s", 1e3), "m/s^2": ("m/s²", 1.0), "V": ("V", 1.0)}
"""Unit in which a reading is shown, and its factor."""


def probe_numbers(record: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Numbers of each probe by its name: unit, mean, and rms and peak about the mean, in its unit; in two passes.

    Empty for a record without readings of probes.
    """
    if READINGS not in record:
        return {}
    n = record.sizes["time"]
    mean = sum(block[READINGS].sum(axis=0) for block in blocks(record, [READINGS])) / n
    square, peak = np.zeros(len(mean)), np.zeros(len(mean))
    for block in blocks(record, [READINGS]):
        off = block[READINGS] - mean
        square += (off**2).sum(axis=0)
        peak = np.maximum(peak, np.abs(off).max(axis=0))
    columns = zip(names(record), units(record), mean, np.sqrt(square / n), peak, strict=True)
    return {
        name: {"unit": unit, "mean": float(m), "rms": float(rms), "peak": float(p)} for name, unit, m, rms, p in columns
    }


def names(record: xr.Dataset) -> list[str]:
    """Names of the probes of a record."""
    return [str(name) for name in record["probe"].values]


def units(record: xr.Dataset) -> list[str]:
    """Units of their readings."""
    return [str(unit) for unit in record["probe_unit"].values]


def shown(value: float, unit: str) -> str:
    """A reading as text."""
    text, factor = SHOWN[unit]
    return f"{value * factor:.3g} {text}"


def probe_planes(record: xr.Dataset) -> list[tuple[str, ...]]:
    """Names of the displacement probes of each plane in which they see both x and y, along the shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.signals.probe_planes(record)
    []
    """
    if READINGS not in record or not {"probe_position", "probe_quantity"} <= set(record.coords):
        return []
    places = np.asarray(record["probe_position"].values, float)
    kinds = record["probe_quantity"].values
    found: dict[tuple[float, str], list[str]] = {}
    for name, z, kind in sorted(zip(names(record), places, kinds, strict=True), key=lambda one: one[1]):
        group = next((g for g in found if abs(g[0] - z) <= SAME_PLACE and g[1] == kind), (float(z), str(kind)))
        found.setdefault(group, []).append(name)
    return [tuple(group) for group in found.values() if _sees_both(record, group)]


def _sees_both(record: xr.Dataset, group: list[str]) -> bool:
    try:
        probe_outputs(record.isel(time=slice(0, 2)), group)
    except SchemaError:
        return False
    return True


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

"""Readings of a record's probes: numbers of each, and planes in which probes see an orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from identification import SchemaError
from identification.records.sensors import SAME_PLACE, probe_outputs
from rotorsim.signals.record_blocks import blocks

if TYPE_CHECKING:
    import xarray as xr

READINGS = "probe_measured"
SHOWN = {"m": ("µm", 1e6), "m/s": ("mm/s", 1e3), "m/s^2": ("m/s²", 1.0), "V": ("V", 1.0)}
"""Unit in which a reading is shown, and its factor."""


def probe_numbers(record: xr.Dataset) -> dict[str, dict[str, Any]]:
    """By name of each probe: unit, mean, and rms and peak about the mean, in its unit; in two passes.

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

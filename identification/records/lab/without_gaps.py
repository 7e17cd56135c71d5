"""Records with gaps: their whole stretches behind each other, for fits that know where each begins."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from identification.errors import UnfitError
from identification.records.lab.whole_stretches import stretches
from identification.records.sampling import sampling_time

if TYPE_CHECKING:
    import xarray as xr

SHORTEST = 0.1
"""Shorter stretches [s] between gaps are left out: most of one is the decay of its initial state."""
LEAST = 1.0
"""So much [s] of a record must be left without its gaps."""
USED = ("reference", "reference_external", "disc_measured", "disc", "pin", "probe_measured", "angle_measured", "angle",
        "speed_measured", "speed", "pressure_measured", "pressure")  # fmt: skip
ANGLES = ("angle_measured", "angle")


def without_gaps(record: xr.Dataset) -> tuple[xr.Dataset, tuple[int, ...], str]:
    """The whole stretches behind each other on an even clock, the samples at which they begin, and what was left out.

    A record without gaps comes back as it is. Samples are missing where time leaps or a channel of USED is not finite.

    Raises
    ------
    UnfitError
        If less than a second is left.
    """
    if "time" not in record.coords or record["time"].dims != ("time",) or record["time"].dtype.kind not in "fiu":
        return record, (), ""
    time = np.asarray(record["time"].values, float)
    names = [name for name in USED if name in record and record[name].dtype.kind == "f"]
    names = [name for name in names if record[name].dims[:1] == ("time",)]
    whole = [np.isfinite(record[name].values).reshape(time.size, -1).all(axis=1) for name in names]
    bad = ~np.logical_and.reduce([np.isfinite(time), *whole])
    found = stretches(time, bad) if time.size > 1 else []
    if len(found) == 1 and not bad.any():
        return record, (), ""
    step = _step(time, found)
    kept = [part for part in found if (part.stop - part.start) * step >= SHORTEST]
    lasting = sum(part.stop - part.start for part in kept)
    known = time[np.isfinite(time)]
    wanted = max(round(float(np.ptp(known)) / step) + 1, time.size) if known.size and step > 0 else time.size
    if lasting * step < LEAST:
        raise UnfitError(
            f"record: {lasting * step:.3g} s of {wanted * step:.3g} s are left without the gaps, in stretches of "
            f"{SHORTEST:g} s or more; a local fit needs {LEAST:g} s: record it again"
        )
    lost = wanted - lasting
    note = f"{lost} of {wanted} samples ({100 * lost / wanted:.2g} %) left out; whole stretches: {len(kept)}"
    return _closed_up(record, kept, step), tuple(np.cumsum([p.stop - p.start for p in kept])[:-1].tolist()), note


def longest_whole(record: xr.Dataset) -> tuple[xr.Dataset, tuple[str, ...]]:
    """The longest stretch of a record without gaps, and a sentence where that is not all of it."""
    closed, breaks, left_out = without_gaps(record)
    if not breaks:
        return closed, (left_out,) if left_out else ()
    first, last = max(pairwise([0, *breaks, closed.sizes["time"]]), key=lambda edges: edges[1] - edges[0])
    return closed.isel(time=slice(first, last)), (f"gaps: seen in the longest stretch, {last - first} samples",)


def _step(time: np.ndarray, found: list[slice]) -> float:
    """Sampling time [s] in the stretches, or of all samples where no two belong together."""
    steps = [np.diff(time[part]) for part in found if part.stop - part.start > 1] or [np.diff(time)]
    steps = [one[np.isfinite(one)] for one in steps]
    return float(np.median(np.concatenate(steps))) if any(one.size for one in steps) else 0.0


def _closed_up(record: xr.Dataset, kept: list[slice], step: float) -> xr.Dataset:
    """The stretches on one clock; the angle loses the whole turns that the gaps had."""
    time = np.asarray(record["time"].values, float)
    for part in kept:
        sampling_time(record.isel(time=part))  # refuses what is uneven within
    closed = record.isel(time=np.concatenate([np.arange(part.start, part.stop) for part in kept]))
    closed = closed.assign_coords(time=("time", time[kept[0].start] + step * np.arange(closed.sizes["time"])))
    closed["time"].attrs = dict(record["time"].attrs)
    for name in ANGLES:
        if name in closed:
            angle, edges = closed[name].values.copy(), np.cumsum([p.stop - p.start for p in kept])[:-1]
            for k in edges:
                angle[k:] -= 2 * np.pi * np.round((angle[k] - angle[k - 1]) / (2 * np.pi))
            closed[name] = closed[name].copy(data=angle)
    return closed

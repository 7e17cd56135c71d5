"""Stretches of a local fit: a record without its gaps, and several records of one operating point in one.

The signals of all stretches stand behind each other; `Signals.breaks` are the numbers of the samples at which the later
ones begin. Each stretch has an initial state of its own in the fit. Those of one record share its offset and its
harmonics of the shaft angle; records have their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from identification.errors import UnfitError
from identification.records.checks import DRIFT
from identification.records.lab.whole_stretches import stretches
from identification.records.prefilter import Signals
from identification.records.sampling import sampling_time

if TYPE_CHECKING:
    import xarray as xr

SHORTEST = 0.1
"""Shorter stretches [s] between gaps are left out: most of one is the decay of its initial state."""
LEAST = 1.0
"""So much [s] of a record must be left without its gaps."""
ALIKE = 1e-3
"""Relative difference of sampling times that are the same."""
USED = ("reference", "reference_external", "disc_measured", "disc", "pin", "probe_measured", "angle_measured", "angle",
        "speed_measured", "speed", "pressure_measured", "pressure")  # fmt: skip
ANGLES = ("angle_measured", "angle")


def parts_of(breaks: Sequence[int], n: int) -> Iterator[slice]:
    """Slices of the stretches of n samples."""
    edges = [0, *breaks, n]
    return (slice(a, b) for a, b in pairwise(edges))


def longest_part(signals: Signals) -> slice:
    """The stretch with the most samples after the rest of the first."""
    parts = list(parts_of(signals.breaks, len(signals.u)))
    return max(parts, key=lambda part: part.stop - max(part.start, signals.rest))


def offsets(n: int, breaks: Sequence[int]) -> np.ndarray:
    """An offset for each stretch, orthonormal, (n, stretches)."""
    columns = np.zeros((n, len(breaks) + 1))
    for k, part in enumerate(parts_of(breaks, n)):
        columns[part, k] = (part.stop - part.start) ** -0.5
    return columns


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


def joined(records: Sequence[Signals]) -> Signals:
    """Signals of several records at one operating point as one.

    Raises
    ------
    UnfitError
        If their sampling times or operating points differ, or only some have pins.
    """
    first = records[0]
    if len(records) == 1:
        return first
    for k, other in enumerate(records[1:], start=2):
        _check_alike(first, other, k)
    lengths = [len(one.u) for one in records]
    starts = np.cumsum([0, *lengths[:-1]])
    breaks = [int(at + b) for at, one in zip(starts, records, strict=True) for b in (0, *one.breaks)][1:]
    Q = np.zeros((sum(lengths), sum(one.Q.shape[1] for one in records)))
    column = 0
    for at, one in zip(starts, records, strict=True):
        Q[at : at + len(one.u), column : column + one.Q.shape[1]] = one.Q
        column += one.Q.shape[1]
    notes = tuple(dict.fromkeys(text for one in records for text in one.notes))
    return replace(
        first, u=_stacked([one.u for one in records]), y=_stacked([one.y for one in records]), Q=Q,
        truth=None if any(one.truth is None for one in records) else _stacked([one.truth for one in records]),
        pins=None if any(one.pins is None for one in records) else _stacked([one.pins for one in records]),
        noise=np.sqrt(np.average([one.noise**2 for one in records], axis=0, weights=lengths)),
        speed=float(np.average([one.speed for one in records], weights=lengths)),
        pressure=float(np.average([one.pressure for one in records], weights=lengths)),
        notes=(*notes, f"{len(records)} records in one fit"), breaks=tuple(breaks),
    )  # fmt: skip


def _stacked(values: Sequence[np.ndarray | None]) -> np.ndarray:
    return np.ascontiguousarray(np.vstack([one for one in values if one is not None]))


def _check_alike(first: Signals, other: Signals, number: int) -> None:
    if abs(other.Ts / first.Ts - 1) > ALIKE:
        raise UnfitError(
            f"record {number}: a sample every {other.Ts:.6g} s, the first record's every {first.Ts:.6g} s; one local "
            "fit takes records of one sampling time"
        )
    for name in DRIFT:
        share, least, unit = DRIFT[name]
        a, b = getattr(first, name), getattr(other, name)
        if abs(b - a) > max(share * abs(a), least):
            raise UnfitError(
                f"record {number}: {name} {b:.5g} {unit}, the first record's {a:.5g} {unit}; one local fit takes "
                "records of one operating point: identify each alone and fit_lpv them"
            )
    if (first.pins is None) != (other.pins is None):
        raise UnfitError(f"record {number}: only some of the records have pin positions; map them in all or drop them")

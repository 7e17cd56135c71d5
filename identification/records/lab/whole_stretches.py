"""Cuts a record with gaps or missing values into its whole stretches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.errors import SchemaError
from identification.records.notes import with_notes
from identification.records.sampling import GAP

if TYPE_CHECKING:
    import xarray as xr

SHORTEST = 0.1
"""Stretches below this time [s] are left out."""


def whole_stretches(record: xr.Dataset, shortest: float = SHORTEST) -> list[xr.Dataset]:
    """The stretches of a record without gaps and missing values, in the order of time; each notes what was cut.

    A channel without any value is left out altogether.

    Parameters
    ----------
    record : time series, as `identification.load` gives it
    shortest : stretches that last less [s] are left out

    Raises
    ------
    SchemaError
        If the record has no time or no such stretch.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.identification.whole_stretches(record, 0.1))
    1
    """
    if "time" not in record.dims or "time" not in record.coords:
        raise SchemaError("record: no time series; run-up vectors have no gaps to cut")
    empty = [name for name in _timed(record) if not np.isfinite(record[name].values).any()]
    kept = record.drop_vars(empty)
    time = np.asarray(kept["time"].values, float)
    missing = {name: ~np.isfinite(kept[name].values).reshape(time.size, -1).all(axis=1) for name in _timed(kept)}
    bad = np.logical_or.reduce([~np.isfinite(time), *missing.values()])
    reasons = [f"{name} has no value and was left out" for name in empty]
    reasons += [f"{np.count_nonzero(at)} samples without a value in {name}" for name, at in missing.items() if at.any()]
    parts = stretches(time, bad)
    gaps = _gaps(time, bad)
    if gaps.size:
        reasons.append(f"{gaps.size} gaps in time, the first after {time[gaps[0]]:.6g} s")
    step = _step(time, bad)
    long = [part for part in parts if (part.stop - part.start) * step >= max(shortest, 2 * step)]
    if not long:
        raise SchemaError(
            f"record: no whole stretch of {shortest:g} s ({'; '.join(reasons) or 'too short'}); record it again"
        )
    return [_piece(kept, part, len(parts), reasons) for part in long]


def longest(stretches: list[xr.Dataset]) -> xr.Dataset:
    """The stretch with the most samples.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.longest(rs.identification.whole_stretches(record, 0.1)).sizes["axis"]
    2
    """
    return max(stretches, key=lambda stretch: stretch.sizes["time"])


def _piece(record: xr.Dataset, part: slice, count: int, reasons: list[str]) -> xr.Dataset:
    piece = record.isel(time=part)
    if count == 1 and not reasons:
        return piece
    time = piece["time"].values
    samples = f"samples {part.start + 1} to {part.stop} of {record.sizes['time']}"
    where = f"cut: {samples}, {time[0]:.6g} s to {time[-1]:.6g} s"
    return with_notes(piece, [f"{where}; {'; '.join(reasons)}" if reasons else where])


def _timed(record: xr.Dataset) -> list[str]:
    """Names of the float variables over time."""
    return [str(n) for n, v in record.data_vars.items() if v.dims[:1] == ("time",) and v.dtype.kind == "f"]


def _step(time: np.ndarray, bad: np.ndarray) -> float:
    steps = np.diff(time)[~(bad[1:] | bad[:-1])]
    return float(np.median(steps)) if steps.size else np.inf


def _gaps(time: np.ndarray, bad: np.ndarray) -> np.ndarray:
    """Numbers (k,) of the samples after which time leaps."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((np.diff(time) > GAP * _step(time, bad)) & ~(bad[1:] | bad[:-1]))


def stretches(time: np.ndarray, bad: np.ndarray) -> list[slice]:
    """Runs of samples that are not `bad` (n,) and without a gap in time."""
    begins = np.concatenate(([True], bad[:-1])) & ~bad
    begins[_gaps(time, bad) + 1] = True
    starts = np.flatnonzero(begins)
    ends = np.append(np.flatnonzero(bad), time.size)
    stops = np.minimum(np.append(starts[1:], time.size), ends[np.searchsorted(ends, starts)])
    return [slice(int(a), int(b)) for a, b in zip(starts, stops, strict=True)]

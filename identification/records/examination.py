"""Examination of a record: channels, faults, suspicious values, possible uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identification.errors import SchemaError
from identification.records.lab.column_faults import clipped
from identification.records.lab.whirl_hints import series_hints, vector_hints
from identification.records.lab.without_gaps import without_gaps
from identification.records.notes import notes_of
from identification.records.sampling import nominal_rate, problems
from identification.records.schema import named_axes
from identification.records.unit_suspicions import Suspicion, suspicions
from identification.records.validate import validate
from identification.records.vectors import VECTORS

if TYPE_CHECKING:
    import xarray as xr

USES: dict[str, tuple[tuple[str, ...], ...]] = {
    "identification": (("reference",), ("disc_measured", "disc")),
    "runout filter": (("disc_measured", "disc"), ("angle_measured", "angle")),
    "run-up analysis": (("disc_measured", "disc"), ("angle_measured", "angle", "speed_measured", "speed")),
    "scheduled models": (
        *(("reference",), ("disc_measured", "disc")),
        *(("speed_measured", "speed"), ("pressure_measured", "pressure")),
    ),
}
"""Variables that each use needs: at least one of every group, and always time."""
FITS = ("identification", "scheduled models")
"""Uses that leave gaps out."""
CLIPPED = ("disc_measured", "journal", "pin", "pressure_measured")
"""Channels of sensors; commands may well rest at their limits."""
_STEADY = ("speed", "speed_measured", "pressure", "pressure_measured", "reference", "contact", "disc_force")


@dataclass(frozen=True)
class Channel:
    """One column of a variable: SI unit, range of the finite values, and what is odd about it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.examine(record).channels[0].units
    'm'
    """

    name: str
    units: str
    minimum: float
    maximum: float
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Examination:
    """`kind` is 'time series' or 'run-up vectors'; `uses` maps each use to what it lacks, '' if nothing.

    `problems` make the record unfit for any use, as do those of the `warnings` that are `doubts`: values in a unit that
    must be wrong. `left_out` is what identification leaves out of a record whose problems are gaps alone, '' of others.
    Rate [Hz] and duration [s] are NaN without a time.
    """

    kind: str
    samples: int
    sample_rate: float
    duration: float
    channels: tuple[Channel, ...]
    problems: tuple[str, ...]
    warnings: tuple[str, ...]
    uses: dict[str, str]
    doubts: tuple[str, ...] = ()
    left_out: str = ""

    @property
    def usable(self) -> bool:
        """Whether the record is fit for at least one use."""
        return any(self.fit(use) for use in self.uses)

    def fit(self, use: str) -> bool:
        """Whether the record is fit for a use; gaps do not hinder identification.

        Examples
        --------
        >>> import rotorsim as rs
        >>> rs.identification.examine(record).fit("scheduled models")
        True
        """
        whole = not self.problems or (bool(self.left_out) and use in FITS)
        return whole and not self.doubts and not self.uses[use]


def examine(record: xr.Dataset) -> Examination:
    """Examination of a record or of run-up vectors, whether they fit the schema or not.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.examine(record).samples == record.sizes["time"]
    True
    """
    record = named_axes(record)
    with np.errstate(all="ignore"):  # a damaged file may hold any number
        return _vectors(record) if "speed" in record.dims else _series(record)


def _series(record: xr.Dataset) -> Examination:
    timed = "time" in record.coords and record["time"].dims == ("time",) and record["time"].dtype.kind in "fiu"
    time = np.asarray(record["time"].values, float) if timed else np.empty(0)
    steps = np.diff(time)
    step = float(np.median(steps)) if steps.size else np.nan
    rate = 1 / step if step > 0 else np.nan
    rate = nominal_rate(time) if timed and not problems(time) else rate
    channels = _channels(record)
    found = [f"time: {text}" for text in problems(time)] if timed else []
    limits = record.attrs.get("clipped", [])
    found += [f"clipped: {text}; widen its range" for text in ([limits] if isinstance(limits, str) else limits)]
    found += _bad_values(channels) or ([] if found else _misfit(record))
    warnings = [f"{c.name}: {remark}" for c in channels for remark in c.remarks if "NaN" not in remark]
    duration = float(time[-1] - time[0]) + step if time.size > 1 else np.nan
    closed, left_out = _closed(record) if found and timed and not limits else (record, "")
    suspected = suspicions(closed, rate) if timed else []
    warnings += [*notes_of(record), *(one.text for one in suspected), *(series_hints(record) if timed else [])]
    rest = (tuple(found), tuple(warnings), _uses(record), _doubts(suspected), left_out)
    return Examination("time series", time.size, rate, duration, channels, *rest)


def _vectors(vectors: xr.Dataset) -> Examination:
    found = _misfit(vectors)
    channels = []
    for name in VECTORS if not found else ():
        for order in vectors["order"].values:
            values = np.asarray(vectors[name].sel(order=order).values, float)
            channels.append(_channel(f"{name} {order}X", VECTORS[name].units, values.ravel(), False))
    uses = {"run-up analysis": "", **{use: "a time series" for use in USES if use != "run-up analysis"}}
    samples = vectors.sizes["speed"]
    suspected = suspicions(vectors[["amplitude"]], np.nan) if not found else []
    warnings = [*notes_of(vectors), *(one.text for one in suspected), *(vector_hints(vectors) if not found else [])]
    rest = (tuple(found), tuple(warnings), uses, _doubts(suspected))
    return Examination("run-up vectors", samples, np.nan, np.nan, tuple(channels), *rest)


def _doubts(found: list[Suspicion]) -> tuple[str, ...]:
    return tuple(one.text for one in found if one.unfit)


def _closed(record: xr.Dataset) -> tuple[xr.Dataset, str]:
    """A record without its gaps, and what identification leaves out so; the record and '' where that does not help."""
    try:
        closed, _, text = without_gaps(record)
        return validate(closed), text
    except SchemaError:
        return record, ""


def _channels(record: xr.Dataset) -> tuple[Channel, ...]:
    channels = []
    for name in map(str, record.data_vars):
        variable = record[name]
        if variable.dtype.kind not in "fiub" or variable.dims[:1] != ("time",) or variable.ndim > 2:
            continue
        units, values = variable.attrs.get("units", ""), np.asarray(variable.values, float)
        if variable.ndim == 1:
            channels.append(_channel(name, units, values, name in CLIPPED))
            continue
        labels = variable[variable.dims[1]].values if variable.dims[1] in variable.coords else range(values.shape[1])
        own = variable.coords.get("probe_unit")
        for k, (label, column) in enumerate(zip(labels, values.T, strict=True)):
            unit = units if own is None else str(own.values[k])
            channels.append(_channel(f"{name} {label}", unit, column, name in CLIPPED))
    return tuple(channels)


def _channel(name: str, units: str, values: np.ndarray, sensor: bool) -> Channel:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return Channel(name, units, np.nan, np.nan, ("all NaN or infinite",))
    low, high = float(finite.min()), float(finite.max())
    remarks = []
    if finite.size < values.size:
        first = int(np.flatnonzero(~np.isfinite(values))[0]) + 1
        remarks.append(f"{values.size - finite.size} NaN or infinite, the first at sample {first}")
    if low == high and values.size > 1 and name.split()[0] not in _STEADY:
        remarks.append("flat; is the sensor connected?")
    elif sensor:
        remarks += [f"saturated at {at:.6g} {units}?" for at, _ in clipped(values)]
    return Channel(name, units, low, high, tuple(remarks))


def _bad_values(channels: tuple[Channel, ...]) -> list[str]:
    return [f"{c.name}: {remark}; cut the record there" for c in channels for remark in c.remarks if "NaN" in remark]


def _misfit(record: xr.Dataset) -> list[str]:
    try:
        validate(record)
    except SchemaError as error:
        return [str(error)]
    return []


def _uses(record: xr.Dataset) -> dict[str, str]:
    """Missing variables of each use."""
    return {
        use: ", ".join(" or ".join(group) for group in groups if not any(name in record for name in group))
        for use, groups in USES.items()
    }

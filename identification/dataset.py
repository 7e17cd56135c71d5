"""THE schema of measured and virtual records: names, dimensions, units.

A record is an `xarray.Dataset` over `time` with the variables below, those that were measured; `disc` is the true
displacement and exists only in virtual records, `disc_measured` is what a sensor saw. Angles are in rad and run on
without wrapping, pressures are gauge, displacements are measured from the bearing's centre. Attributes carry the
machine's text, the seed, versions and a content hash where the record is virtual.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

AXES = ("x", "y")


@dataclass(frozen=True)
class Variable:
    """Dimensions after time, unit and long name of a variable of the schema."""

    dims: tuple[str, ...]
    units: str
    long_name: str


VARIABLES = {
    "disc": Variable(("axis",), "m", "true displacement of the disc"),
    "disc_measured": Variable(("axis",), "m", "measured displacement of the disc"),
    "journal": Variable(("axis",), "m", "displacement of the journal in the gas bearing"),
    "angle": Variable((), "rad", "shaft angle"),
    "speed": Variable((), "rad/s", "shaft speed"),
    "pressure": Variable((), "Pa", "injection pressure, gauge"),
    "reference": Variable(("axis",), "V", "reference voltage of the actuators"),
    "disc_force": Variable(("axis",), "N", "external force on the disc"),
    "pin": Variable(("injector",), "m", "pin position"),
    "film_force": Variable(("axis",), "N", "film force on the journal"),
    "h_min": Variable((), "m", "smallest film thickness"),
    "mass_flow": Variable((), "kg/s", "mass flow of all injectors"),
    "contact": Variable((), "1", "journal touches the sleeve"),
}


class SchemaError(ValueError):
    """A record that does not fit the schema; the message names variable, problem and way out."""


def make_record(time: np.ndarray, values: dict[str, np.ndarray], attrs: dict[str, Any] | None = None) -> xr.Dataset:
    """Dataset of the schema from arrays; `time` (n,) [s], values of shape (n,) or (n, dim)."""
    import xarray as xr

    variables = {}
    for name, value in values.items():
        known = VARIABLES[name]
        variables[name] = (("time", *known.dims), value, {"units": known.units, "long_name": known.long_name})
    coords: dict[str, Any] = {"time": ("time", time, {"units": "s", "long_name": "time"}), "axis": list(AXES)}
    if "pin" in values:
        coords["injector"] = np.arange(1, values["pin"].shape[1] + 1)
    return xr.Dataset(variables, coords, attrs or {})


def validate(record: xr.Dataset) -> xr.Dataset:
    """Return the record if it fits the schema; raises SchemaError with one sentence otherwise."""
    if "time" not in record.coords:
        raise SchemaError("record: no coordinate 'time'; give the time of every sample in s")
    time = np.asarray(record["time"].values, float)
    if time.size < 2 or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0):
        raise SchemaError("record.time: must rise from sample to sample without gaps of NaN; sort or cut the record")
    for name in record.data_vars:
        known = VARIABLES.get(str(name))
        if known is None:
            continue
        if record[name].dims != ("time", *known.dims):
            raise SchemaError(f"record.{name}: dimensions {record[name].dims}, expected {('time', *known.dims)}")
        if record[name].attrs.get("units") != known.units:
            raise SchemaError(f"record.{name}: unit {record[name].attrs.get('units')!r}, expected {known.units!r}")
        if not np.all(np.isfinite(record[name].values)):
            raise SchemaError(f"record.{name}: holds NaN or infinite values; cut them out")
    return record

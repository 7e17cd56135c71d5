r"""Schema of measured and virtual records: variable names, dimensions, units.

A record is an `xarray.Dataset` over `time` with the variables below, those that were measured. A virtual record holds
the truth and, apart from it, what the sensors saw: `disc` and `disc_measured`, `angle` and `angle_measured`; a record
of a rig has the measured ones, or `angle`, `speed` and `pressure` where there is only one of each. Angles are in rad
and run on without wrapping, pressures are gauge, displacements are measured from the bearing's centre. Attributes carry
the machine's text, the seed, versions and a content hash where the record is virtual, and its source where it was read
from a file.

The other kind of data are run-up vectors, amplitude and phase of the orders over speed. An order n of the displacement
is :math:`\Re\{A_n e^{i n \alpha}\}` with the shaft angle :math:`\alpha`, :math:`A_n = |A_n| e^{-i \varphi_n}`:
amplitudes are 0-pk and the phase is a LAG, so the maximum passes :math:`\varphi_n / n` of shaft rotation after the
mark. A table of a single probe has one axis, and its angle from x towards y in the attribute `probe_angle` [rad] where
it stands elsewhere than there.

Record from arrays in memory.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.columns import FACTORS, factor
from identification.records.sampling import JITTER, WAY_OUT, sampling_time
from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import ReadError, SchemaError
from rotorsim.base.input_files import parse_toml

if TYPE_CHECKING:
    import xarray as xr

NOTES = "notes"


def notes_of(record: xr.Dataset) -> list[str]:
    """The notes on a record; a file may keep a single one as text.

    Examples
    --------
    >>> import rotorsim as rs
    >>> notes = rs.identification.notes_of(record)
    """
    found = record.attrs.get(NOTES, [])
    return [found] if isinstance(found, str) else [str(text) for text in found]


def with_notes(record: xr.Dataset, sentences: Sequence[str]) -> xr.Dataset:
    """The record with further notes, each once."""
    new = list(dict.fromkeys([*notes_of(record), *sentences]))
    return record.assign_attrs({NOTES: new}) if new else record


AXES = ("x", "y")
"""Axes of a record: horizontal and vertical."""


@dataclass(frozen=True)
class Variable:
    """Dimensions after time, unit and long name of a variable of the schema.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.VARIABLES["disc"].units
    'm'
    """

    dims: tuple[str, ...]
    units: str
    long_name: str


PER_PROBE = "of each probe"
"""Unit of readings of several units; the coordinate `probe_unit` has that of each."""
PROBE_UNITS = ("m", "m/s", "m/s^2", "V", PER_PROBE)
PROBE_COORDINATES = {
    "probe_quantity": ("", "what the probe measures"),
    "probe_position": ("m", "position of the probe along the shaft"),
    "probe_angle": ("rad", "direction of the probe, from x towards y"),
    "probe_gain": ("", "reading per SI value of the quantity, with its sign"),
    "probe_unit": ("", "unit of the readings"),
}
"""Coordinates of the probes of a record: unit (empty for text) and long name."""
"""Unit and long name of the coordinates along `probe`, the names."""
VARIABLES = {
    "disc": Variable(("axis",), "m", "true displacement of the disc"),
    "disc_measured": Variable(("axis",), "m", "measured displacement of the disc"),
    "journal": Variable(("axis",), "m", "displacement of the journal in the gas bearing"),
    "probe_measured": Variable(("probe",), PER_PROBE, "readings of the probes"),
    "angle": Variable((), "rad", "shaft angle"),
    "angle_measured": Variable((), "rad", "measured shaft angle"),
    "speed": Variable((), "rad/s", "shaft speed"),
    "speed_measured": Variable((), "rad/s", "measured shaft speed"),
    "pressure": Variable((), "Pa", "injection pressure, gauge"),
    "pressure_measured": Variable((), "Pa", "measured injection pressure, gauge"),
    "reference": Variable(("axis",), "V", "reference voltage of the actuators"),
    "reference_external": Variable(("axis",), "V", "reference voltage that was added to a controller's"),
    "disc_force": Variable(("axis",), "N", "external force on the disc"),
    "base_acceleration": Variable(("axis",), "m/s^2", "acceleration of the base"),
    "pin": Variable(("injector",), "m", "pin position"),
    "pin_measured": Variable(("injector",), "m", "measured pin position"),
    "film_force": Variable(("axis",), "N", "film force on the journal"),
    "journals": Variable(("bearing", "axis"), "m", "displacements of the journals in all gas bearings"),
    "film_forces": Variable(("bearing", "axis"), "N", "film forces on all journals"),
    "film_thickness": Variable(("bearing",), "m", "smallest film thickness in each gas bearing"),
    "film_flow": Variable(("bearing",), "kg/s", "mass flow into each gas bearing"),
    "temperature_rise": Variable(("body",), "K", "rise of gas, journal and sleeve above the gas temperature"),
    "h_min": Variable((), "m", "smallest film thickness"),
    "mass_flow": Variable((), "kg/s", "mass flow of all injectors"),
    "contact": Variable((), "1", "journal touches the sleeve"),
    "friction_torque": Variable((), "N*m", "torque of friction in films and contacts"),
}
"""Variables of a record by name."""
PINS = tuple(name for name, known in VARIABLES.items() if known.dims == ("injector",))
"""Variables of the pins."""


def make_record(
    time: np.ndarray,
    values: dict[str, np.ndarray],
    attrs: dict[str, Any] | None = None,
    probes: dict[str, Any] | None = None,
    bearings: Sequence[str] = (),
) -> xr.Dataset:
    """Dataset of the schema from arrays; `time` (n,) [s], values of shape (n,) or (n, dim).

    `probes` has the names, `probe`, and PROBE_COORDINATES of the readings `probe_measured`; `bearings` the names of the
    gas bearings, where there are several.

    Examples
    --------
    >>> import rotorsim as rs
    >>> time, disc = np.arange(5) * 2e-4, np.zeros((5, 2))
    >>> rs.identification.make_record(time, {"disc": disc})["disc"].attrs["units"]
    'm'
    """
    import xarray as xr

    variables = {}
    for name, value in values.items():
        known = VARIABLES[name]
        units = probe_units(probes or {}) if name == "probe_measured" else known.units
        variables[name] = (("time", *known.dims), value, {"units": units, "long_name": known.long_name})
    coords: dict[str, Any] = {"time": ("time", time, {"units": "s", "long_name": "time"}), "axis": list(AXES)}
    for pins in (values[name] for name in PINS if name in values):
        coords["injector"] = np.arange(1, pins.shape[1] + 1)
    if "journals" in values:
        coords["bearing"] = list(bearings) or [str(k + 1) for k in range(values["journals"].shape[1])]
    if "temperature_rise" in values:
        coords["body"] = warm_bodies(coords.get("bearing", ()))
    if "probe_measured" in values:
        coords |= labelled(probes or {})
    return xr.Dataset(variables, coords, attrs or {})


def warm_bodies(bearings: Sequence[str]) -> list[str]:
    """Names of what friction heats: gas, journal and sleeve of the only bearing, or of each.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.records.schema.warm_bodies(["front"])
    ['front gas', 'front journal', 'front sleeve']
    """
    bodies = ["gas", "journal", "sleeve"]
    return [f"{bearing} {body}" for bearing in bearings for body in bodies] or bodies


def probe_units(probes: dict[str, Any]) -> str:
    """Unit of `probe_measured`: that of all probes, or PER_PROBE.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.probe_units({"probe_unit": ["m", "m"]})
    'm'
    """
    units = set(probes["probe_unit"])
    return units.pop() if len(units) == 1 else PER_PROBE


def labelled(probes: dict[str, Any]) -> dict[str, Any]:
    """Coordinates of a record's probes, with their units."""
    coords: dict[str, Any] = {"probe": list(probes["probe"])}
    for name, (unit, text) in PROBE_COORDINATES.items():
        if name in probes:
            coords[name] = ("probe", list(probes[name]), {"long_name": text} | ({"units": unit} if unit else {}))
    return coords


def validate_record(record: xr.Dataset) -> xr.Dataset:
    """Return the record if it fits the schema, else raise SchemaError with one sentence.

    Variables that the schema does not know are left alone.
    """
    timed = "time" in record.coords and record["time"].dims == ("time",) and record["time"].dtype.kind in "fiu"
    if not timed:
        raise SchemaError("record: no coordinate 'time'; give the time of every sample in s")
    sampling_time(record)
    for name in record.data_vars:
        if known := VARIABLES.get(str(name)):
            units = PROBE_UNITS if name == "probe_measured" else (known.units,)
            validate_variable(record, str(name), ("time", *known.dims), *units)
    validate_axes(record)
    for name in ("probe", "probe_unit") if "probe_measured" in record else ():
        if name not in record.coords:
            raise SchemaError(f"record: probe_measured without the coordinate '{name}'; give each probe its {name}")
    names = record["probe"].values.tolist() if "probe_measured" in record else []
    if len(set(names)) < len(names):
        raise SchemaError(f"record.probe: {names}; give each probe a name of its own")
    return record


def validate_axes(record: xr.Dataset) -> None:
    """Raise SchemaError unless the axes are x and y, as text or as the bytes that a file may keep."""
    axes = named_axes(record)["axis"].values.tolist() if "axis" in record.dims else list(AXES)
    if axes != list(AXES):
        raise SchemaError(f"record.axis: {axes}, expected {list(AXES)}; name the axes so")


def named_axes(record: xr.Dataset) -> xr.Dataset:
    """The record with its axes' names as text, where a file kept them as bytes."""
    if "axis" not in record.coords or record["axis"].dtype.kind != "S":
        return record
    return record.assign_coords(axis=[name.decode("latin-1") for name in record["axis"].values])


def validate_variable(record: xr.Dataset, name: str, dims: tuple[str, ...], *units: str) -> None:
    """Raise SchemaError unless a variable has these dimensions, one of these units and finite numbers."""
    variable = record[name]
    if variable.dims != dims:
        raise SchemaError(f"record.{name}: dimensions {variable.dims}, expected {dims}; transpose or rename them")
    if variable.attrs.get("units") not in units:
        expected = " or ".join(map(repr, units))
        raise SchemaError(f"record.{name}: unit {variable.attrs.get('units')!r}, expected {expected}; convert it")
    if variable.dtype.kind not in "fiub":
        raise SchemaError(f"record.{name}: holds {variable.dtype} and not numbers; convert it")
    wrong = np.argwhere(~np.isfinite(variable.values))
    if len(wrong):
        place = ", ".join(f"{d} {variable[d].values[i]:.6g}" for d, i in zip(dims[:1], wrong[0], strict=False))
        first = f"record.{name}: {len(wrong)} NaN or infinite values, the first at {place}"
        raise SchemaError(f"{first}; {WAY_OUT if len(wrong) < variable.size else 'check the sensor or the mapping'}")


def require(record: xr.Dataset, *names: str, use: str) -> xr.Dataset:
    """Return the record if it holds these variables; raises SchemaError that names what `use` lacks.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.require(record, "disc", use="an orbit") is record
    True
    """
    missing = [name for name in names if name not in record]
    if missing:
        raise SchemaError(f"record: no {' and no '.join(missing)}; {use} needs {', '.join(names)}: measure or map them")
    return record


def measured_name(record: xr.Dataset, name: str) -> str:
    """Name of the measured channel, or of the true one where there is no other; empty where there is none."""
    return next((key for key in (f"{name}_measured", name) if key in record), "")


def measured(record: xr.Dataset, name: str) -> np.ndarray | None:
    """Values of the measured channel, or of the true one where there is no other; None where there is none."""
    key = measured_name(record, name)
    return np.asarray(record[key].values, float) if key else None


def known_variable(name: str) -> Variable:
    """The entry of the schema; raises SchemaError for a name that is not in it."""
    if name not in VARIABLES:
        raise SchemaError(f"record.{name}: not a variable of the schema; {did_you_mean(name, VARIABLES)}")
    return VARIABLES[name]


DIMS = ("speed", "order", "axis")
VECTORS = {
    "amplitude": Variable(("order", "axis"), "m", "amplitude of an order, 0-pk"),
    "phase": Variable(("order", "axis"), "rad", "phase lag of an order"),
}
"""Variables of run-up vectors by name."""


def make_vectors(
    speed: Any, amplitude: Any, phase: Any, orders: Sequence[int] = (1,), attrs: dict[str, Any] | None = None,
    axes: Sequence[str] = AXES,
) -> xr.Dataset:  # fmt: skip
    """Run-up vectors as a Dataset of the schema.

    Parameters
    ----------
    speed : (n,) [rad/s], rising or falling throughout
    amplitude : (n, orders, axes) [m], 0-pk
    phase : (n, orders, axes) [rad], lag positive
    orders : numbers of the orders
    axes : x and y, or the only one

    Raises
    ------
    SchemaError
        If shapes or values do not fit.

    Examples
    --------
    >>> import rotorsim as rs
    >>> speed = np.linspace(50.0, 300.0, 6)
    >>> made = rs.identification.make_vectors(speed, np.full((6, 1, 2), 1e-6), np.zeros((6, 1, 2)))
    >>> made["amplitude"].dims
    ('speed', 'order', 'axis')
    """
    import xarray as xr

    speed = np.asarray(speed, float)
    shape = (*speed.shape, len(orders), len(axes))
    variables = {}
    for name, value in (("amplitude", np.asarray(amplitude, float)), ("phase", np.asarray(phase, float))):
        if value.shape != shape:
            raise SchemaError(f"vectors.{name}: shape {value.shape}, expected {shape} for speed, order and axis")
        variables[name] = (DIMS, value, {"units": VECTORS[name].units, "long_name": VECTORS[name].long_name})
    coords = {
        "speed": ("speed", speed, {"units": "rad/s", "long_name": "shaft speed"}),
        "order": np.asarray(orders, int),
        "axis": list(axes),
    }
    return validate_vectors(xr.Dataset(variables, coords, attrs or {}))


def validate_vectors(vectors: xr.Dataset) -> xr.Dataset:
    """Return the run-up vectors if they fit the schema; raises SchemaError with one sentence otherwise."""
    for name, known in VECTORS.items():
        if name not in vectors:
            raise SchemaError(f"vectors: no '{name}'; give amplitude [m] 0-pk and phase lag [rad] of every order")
        validate_variable(vectors, name, ("speed", *known.dims), known.units)
    if vectors["speed"].dtype.kind not in "fiu":
        raise SchemaError(f"vectors.speed: holds {vectors['speed'].dtype} and not numbers; convert it")
    speed, order = np.asarray(vectors["speed"].values, float), np.asarray(vectors["order"].values)
    steps = np.diff(speed)
    if not np.all(np.isfinite(speed)) or not (np.all(steps > 0) or np.all(steps < 0)):
        if np.ptp(speed) == 0:
            raise SchemaError("vectors.speed: all speeds are the same; a run-up's table has one row a speed")
        raise SchemaError("vectors.speed: must rise or fall from row to row, each speed once; sort or cut the table")
    if order.dtype.kind not in "iu" or np.any(order < 1) or np.unique(order).size != order.size:
        raise SchemaError(f"vectors.order: {order.tolist()}; give whole numbers from 1, each once")
    if vectors["axis"].values.tolist() not in (["x"], ["y"]):
        validate_axes(vectors)
    else:
        probe_angle(vectors)
    if np.any(vectors["amplitude"].values < 0):
        raise SchemaError("vectors.amplitude: some are negative; add pi to their phase and drop the sign")
    return vectors


def probe_angle(vectors: xr.Dataset) -> float:
    """Angle [rad] from x towards y of the only probe; raises SchemaError for an attribute that is no angle."""
    value = vectors.attrs.get("probe_angle")
    if value is None:
        return 0.0 if vectors["axis"].values.tolist() == ["x"] else math.pi / 2
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found):
        raise SchemaError(
            f"vectors: the attribute probe_angle is {value!r}; give the angle of the probe in rad",
            argument="probe_angle",
            value=value,
        )
    return found


def validate(record: xr.Dataset) -> xr.Dataset:
    """Return the record, or the run-up vectors, if they fit their schema; else raise SchemaError with one sentence.

    Variables that the schema does not know are left alone.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.validate(record) is record
    True
    """
    return validate_vectors(record) if "speed" in record.dims else validate_record(record)


def machine_of(record: xr.Dataset) -> str:
    """Name and fingerprint of a record's machine, a space between; empty for a record that states none."""
    try:
        name = str(parse_toml(str(record.attrs.get("machine", ""))).get("name", ""))
    except tomllib.TOMLDecodeError:
        name = ""
    mark = str(record.attrs.get("machine_hash", ""))
    return f"{name} {mark}" if name and mark else ""


def common(machines: Iterable[str]) -> str:
    """The machine of several records, empty where they differ."""
    found = set(machines)
    return found.pop() if len(found) == 1 else ""


_WIDTHS = {"axis": 2}


def from_arrays(
    time: Any,
    reference: Any,
    disc_measured: Any,
    angle: Any = None,
    pin: Any = None,
    speed: Any = 0.0,
    pressure: Any = 0.0,
    attrs: dict[str, Any] | None = None,
    probes: dict[str, Any] | None = None,
    **more: Any,
) -> xr.Dataset:
    """Record of the schema from arrays in SI units; the arrays are copied.

    An array that states its unit (`attrs` of xarray and pandas, `units` of pint) is converted from it; one that brings
    times of its own must have those of `time`.

    Parameters
    ----------
    time : (n,) [s], evenly spaced
    reference : (n, 2) [V], or None if the actuators had none
    disc_measured : (n, 2) [m], or None
    angle : (n,) [rad], running on without wrapping
    pin : (n, injectors) [m]
    speed : number or (n,) [rad/s]
    pressure : number or (n,) [Pa], gauge
    attrs : attributes of the record
    probes : of `probe_measured=` (n, probes): `probe`, the names, `probe_unit` and what else is known of
        `identification.PROBE_COORDINATES`, each a list
    more : any other variable of the schema, e.g. `journal=` (n, 2) [m]

    Raises
    ------
    SchemaError
        If a name, a shape, a value, a unit or the times of an array do not fit.

    Examples
    --------
    >>> import rotorsim as rs
    >>> time = np.arange(500) * 2e-4
    >>> reference = np.sign(np.sin(300 * time))[:, None] * [1.0, 0.0]
    >>> made = rs.from_arrays(time, reference, 1e-6 * reference, speed=300.0, pressure=5e5)
    >>> made.sizes["time"]
    500
    """
    time = _numbers("time", time, "s")
    if time.ndim != 1:
        raise SchemaError(f"record.time: shape {time.shape}, expected (n,); give the time of every sample in s")
    given = {"disc_measured": disc_measured, "reference": reference, "angle": angle, "pin": pin}
    given |= {"speed": speed, "pressure": pressure, **more}
    given = {name: value for name, value in given.items() if value is not None}
    for name, value in given.items():
        _check_own_time(name, value, time)
    values = {name: _shaped(name, value, time.size) for name, value in given.items()}
    for key in ("probe", "probe_unit") if "probe_measured" in values else ():
        count, stated = values["probe_measured"].shape[1], len((probes or {}).get(key, ()))
        if stated != count:
            raise SchemaError(
                f"record.probe_measured: {count} probes, but {stated} of '{key}'; "
                "give probes = {'probe': [names], 'probe_unit': [units], ...}"
            )
    return validate(make_record(time, values, attrs, probes))


def _shaped(name: str, value: Any, n: int) -> np.ndarray:
    known = known_variable(name)
    dims = known.dims
    array = _numbers(name, value, known.units)
    if not dims and array.ndim == 0:
        return np.full(n, float(array))
    width = tuple(_WIDTHS.get(dim, array.shape[-1] if array.ndim == 2 else 1) for dim in dims)
    if array.shape != (n, *width):
        expected = ", ".join(["n", *(str(_WIDTHS.get(dim, dim)) for dim in dims)])
        raise SchemaError(
            f"record.{name}: shape {array.shape}, expected ({expected}{'' if dims else ','}) with n = {n}"
        )
    return array


def _check_own_time(name: str, value: Any, time: np.ndarray) -> None:
    """Raise SchemaError for an array of xarray or pandas whose times are not `time` (n,)."""
    coordinates, index = getattr(value, "coords", {}), getattr(value, "index", None)
    own = coordinates.get("time", index)
    own = np.asarray(own) if own is not None and not callable(own) else np.zeros(0)
    if own.dtype.kind != "f" or own.shape != time.shape:  # numbers of rows, dates or none
        return
    apart = float(np.nanmax(np.abs(own - time), initial=0.0))
    if apart > JITTER * float(np.median(np.abs(np.diff(time)))):
        raise SchemaError(
            f"record.{name}: its own times are up to {apart:.4g} s from `time`; bring both on one clock, or give its "
            "values alone"
        )


def _stated_factor(name: str, value: Any, si: str) -> float:
    """Factor from the unit that an array states to the SI unit; 1 where it states none."""
    stated = getattr(value, "attrs", {}).get("units") or getattr(value, "units", None)
    text = "" if stated is None else f"{stated:~}" if hasattr(stated, "dimensionality") else str(stated)
    if not text or text == si or si not in FACTORS:
        return 1.0
    try:
        return factor(text, si)
    except ReadError as error:
        raise SchemaError(f"record.{name}: {error}") from error


def _numbers(name: str, value: Any, si: str) -> np.ndarray:
    scale, value = _stated_factor(name, value, si), getattr(value, "magnitude", value)
    try:
        array = np.asarray(np.ma.filled(value.astype(float), np.nan) if np.ma.isMaskedArray(value) else value)
    except (TypeError, ValueError) as error:
        raise SchemaError(f"record.{name}: is not an array of numbers ({error}); give an array of floats") from error
    if array.dtype.kind not in "fiub":
        raise SchemaError(f"record.{name}: holds {array.dtype} and not real numbers; give an array of floats")
    array = np.array(array, dtype=float)
    return array if scale == 1 else array * scale

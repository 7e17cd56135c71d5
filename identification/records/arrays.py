"""Record from arrays in memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ReadError, SchemaError
from identification.records.sampling import JITTER
from identification.records.schema import known_variable, make_record, validate
from identification.records.units import FACTORS, factor

if TYPE_CHECKING:
    import xarray as xr

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
    if "probe_measured" in values:
        _check_probes(values["probe_measured"], probes or {})
    return validate(make_record(time, values, attrs, probes))


def _check_probes(readings: np.ndarray, probes: dict[str, Any]) -> None:
    for name in ("probe", "probe_unit"):
        if len(probes.get(name, ())) != readings.shape[1]:
            raise SchemaError(
                f"record.probe_measured: {readings.shape[1]} probes, but {len(probes.get(name, ()))} of '{name}'; "
                "give probes = {'probe': [names], 'probe_unit': [units], ...}"
            )


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
    """Raise SchemaError for an array of xarray or pandas whose own times are not `time` (n,)."""
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

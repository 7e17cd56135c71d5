"""Record from arrays in memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import SchemaError
from identification.records.schema import known_variable, make_record
from identification.records.validate import validate

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
        If a name, a shape or a value does not fit.

    Examples
    --------
    >>> import rotorsim as rs
    >>> time = np.arange(500) * 2e-4
    >>> reference = np.sign(np.sin(300 * time))[:, None] * [1.0, 0.0]
    >>> made = rs.from_arrays(time, reference, 1e-6 * reference, speed=300.0, pressure=5e5)
    >>> made.sizes["time"]
    500
    """
    time = _numbers("time", time)
    if time.ndim != 1:
        raise SchemaError(f"record.time: shape {time.shape}, expected (n,); give the time of every sample in s")
    given = {"disc_measured": disc_measured, "reference": reference, "angle": angle, "pin": pin}
    given |= {"speed": speed, "pressure": pressure, **more}
    values = {name: _shaped(name, value, time.size) for name, value in given.items() if value is not None}
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
    dims = known_variable(name).dims
    array = _numbers(name, value)
    if not dims and array.ndim == 0:
        return np.full(n, float(array))
    width = tuple(_WIDTHS.get(dim, array.shape[-1] if array.ndim == 2 else 1) for dim in dims)
    if array.shape != (n, *width):
        expected = ", ".join(["n", *(str(_WIDTHS.get(dim, dim)) for dim in dims)])
        raise SchemaError(
            f"record.{name}: shape {array.shape}, expected ({expected}{'' if dims else ','}) with n = {n}"
        )
    return array


def _numbers(name: str, value: Any) -> np.ndarray:
    try:
        array = np.asarray(np.ma.filled(value.astype(float), np.nan) if np.ma.isMaskedArray(value) else value)
    except (TypeError, ValueError) as error:
        raise SchemaError(f"record.{name}: is not an array of numbers ({error}); give an array of floats") from error
    if array.dtype.kind not in "fiub":
        raise SchemaError(f"record.{name}: holds {array.dtype} and not real numbers; give an array of floats")
    return np.array(array, dtype=float)

r"""Run-up vectors: amplitude and phase of the orders over speed, the second kind of data of the schema.

An order n of the displacement is :math:`\Re\{A_n e^{i n \alpha}\}` with the shaft angle :math:`\alpha`,
:math:`A_n = |A_n| e^{-i \varphi_n}`: amplitudes are 0-pk and the phase is a LAG, so the maximum passes
:math:`\varphi_n / n` of shaft rotation after the mark. A table of a single probe has one axis, and its angle from x
towards y in the attribute `probe_angle` [rad] where it stands elsewhere than there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import SchemaError
from identification.records.schema import AXES, Variable, validate_axes, validate_variable

if TYPE_CHECKING:
    import xarray as xr

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
        raise SchemaError(f"vectors: the attribute probe_angle is {value!r}; give the angle of the probe in rad")
    return found

r"""Slow roll: what probes show of a shaft that turns too slowly to move, subtracted once.

.. math:: A_n - A_n^{slow} \qquad\text{or}\qquad d(t) - \sum_n \Re\{A_n^{slow} e^{i n \alpha(t)}\}

for run-up vectors and for time series, with the shaft angle from the same mark. It holds runout and the bow at low
speed alike. A record notes the subtraction in its attribute `slow_roll`, and a second one is refused.

Cites: api_670.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ReadError, SchemaError
from identification.records.notes import with_notes
from identification.records.runout import estimate_runout
from identification.records.schema import AXES
from identification.records.units import amplitude_at, quantity_at
from rotorsim.base.constants import TO_RPM
from rotorsim.base.sentences import quote

if TYPE_CHECKING:
    import xarray as xr

ATTRIBUTE = "slow_roll"
ALREADY = "subtracted before it was recorded"
SLOW = 0.5
"""Largest share of a record's highest speed at which the shaft rolls slowly."""
Vectors = dict[tuple[int, str], complex]


@dataclass(frozen=True)
class SlowRoll:
    """One of: `subtracted` already; `file` of a slow roll; rows `below` a speed [rad/s]; vectors [m] of order, axis."""

    subtracted: bool = False
    file: Path | None = None
    below: float | None = None
    vectors: Vectors = field(default_factory=dict)


def parse_slow_roll(table: dict[str, Any], order_of: Callable[[str], int], folder: Path) -> SlowRoll:
    """Section [slow_roll] of a mapping; raises ReadError for no or more than one source."""
    keys = {"subtracted", "file", "below"} & set(table)
    orders = [key for key in table if key not in keys]
    if len(keys) + bool(orders) != 1:
        raise ReadError(
            "slow_roll: give one of subtracted = true, file = 'slow.csv', below = '400 rpm' and [slow_roll.1X.x]; "
            "it is subtracted once"
        )
    if "subtracted" in keys and table["subtracted"] is not True:
        raise ReadError(f"slow_roll.subtracted: {quote(table['subtracted'])}; write true, or leave the section out")
    if "file" in keys and not isinstance(table["file"], str):
        raise ReadError(f"slow_roll.file: {quote(table['file'])}; give the path of a slow roll's file")
    return SlowRoll(
        "subtracted" in keys,
        folder / table["file"] if "file" in keys else None,
        quantity_at("slow_roll.below", table["below"], "rad/s") if "below" in keys else None,
        {key: value for order in orders for key, value in _vectors(order, table[order], order_of(order)).items()},
    )


def _vectors(name: str, axes: Any, order: int) -> Vectors:
    found = {}
    for axis, parts in axes.items() if isinstance(axes, dict) else ():
        path = f"slow_roll.{name}.{axis}"
        if axis not in AXES or not isinstance(parts, dict) or set(parts) != {"amplitude", "phase"}:
            raise ReadError(f"{path}: write e.g. [slow_roll.1X.x] with amplitude = '8 um pp' and phase = '30 deg'")
        size = amplitude_at(f"{path}.amplitude", parts["amplitude"])
        found[order, axis] = size * np.exp(-1j * quantity_at(f"{path}.phase", parts["phase"], "rad"))
    if not found:
        raise ReadError(f"slow_roll.{name}: write e.g. [slow_roll.1X.x] with amplitude and phase")
    return found


def without_slow_roll(record: xr.Dataset, how: SlowRoll, slow: xr.Dataset | None = None) -> xr.Dataset:
    """The record less its slow roll; `slow` is what `how.file` holds.

    Raises
    ------
    SchemaError
        If it is subtracted already, if the slow roll is none, or if a record lacks the angle.
    """
    if done := record.attrs.get(ATTRIBUTE):
        raise SchemaError(f"slow roll: was {done}; leave [slow_roll] out, it is subtracted once")
    if how.subtracted:
        return record.assign_attrs({ATTRIBUTE: ALREADY})
    if slow is not None and slow.attrs.get(ATTRIBUTE):
        raise SchemaError("slow roll: its own slow roll is subtracted, nothing is left of it; give the original")
    if "speed" in record.dims:
        vectors, source = _of_vectors(record, how, slow)
        found = _less_vectors(record, vectors)
    else:
        found, source = _less_harmonics(record, how, slow)
    text = f"subtracted: {source}"
    return with_notes(found.assign_attrs({ATTRIBUTE: text}), [f"slow roll {text}"])


def _of_vectors(record: xr.Dataset, how: SlowRoll, slow: xr.Dataset | None) -> tuple[Vectors, str]:
    """Vectors of the slow roll, and where they come from."""
    if how.vectors:
        return how.vectors, "vectors of the mapping"
    if how.below is not None:
        slow = record.isel(speed=np.flatnonzero(np.abs(record["speed"].values) < how.below))
        if not slow.sizes["speed"]:
            raise SchemaError(f"slow roll: no row below {how.below * TO_RPM:.4g} rpm; raise slow_roll.below")
    assert slow is not None
    if "speed" not in slow.dims:
        raise SchemaError("slow roll: is a time series, and the record holds vectors; give vectors of the slow roll")
    top = float(np.abs(slow["speed"].values).max())
    _check_slow(top, float(np.abs(record["speed"].values).max()))
    mean = (slow["amplitude"] * np.exp(-1j * slow["phase"])).mean("speed")
    every = [(int(n), str(axis)) for n in mean["order"].values for axis in mean["axis"].values]
    vectors = {(n, axis): complex(mean.sel(order=n, axis=axis)) for n, axis in every}
    return vectors, f"mean of {slow.sizes['speed']} rows up to {top * TO_RPM:.4g} rpm"


def _less_vectors(record: xr.Dataset, vectors: Vectors) -> xr.Dataset:
    amplitude = (record["amplitude"] * np.exp(-1j * record["phase"])).values.copy()
    orders, axes = record["order"].values.tolist(), record["axis"].values.tolist()
    for (order, axis), value in vectors.items():
        if order in orders and axis in axes:
            amplitude[:, orders.index(order), axes.index(axis)] -= value
    out = record.copy()
    out["amplitude"] = (record["amplitude"].dims, np.abs(amplitude), record["amplitude"].attrs)
    out["phase"] = (record["phase"].dims, -np.angle(amplitude), record["phase"].attrs)
    return out


def _less_harmonics(record: xr.Dataset, how: SlowRoll, slow: xr.Dataset | None) -> tuple[xr.Dataset, str]:
    if how.below is not None:
        raise SchemaError("slow roll: below is for vectors; give the file of a slow roll, or its vectors")
    angle, motion = _turning(record, "the record")
    if how.vectors:
        shown = np.zeros_like(motion)
        for (order, axis), value in how.vectors.items():
            shown[:, AXES.index(axis)] += (value * np.exp(1j * order * angle)).real
        source = "vectors of the mapping"
    else:
        assert slow is not None
        if "speed" in slow.dims:
            raise SchemaError("slow roll: holds vectors, and the record is a time series; give a slow roll over time")
        own, rolled = _turning(slow, "the slow roll")
        speed, high = _speed(slow, own), _speed(record, angle)
        _check_slow(speed, high)
        shown = estimate_runout(own, rolled).at(angle)
        source = f"record at {speed * TO_RPM:.4g} rpm"
    out = record.copy()
    out["disc_measured"] = (record["disc_measured"].dims, motion - shown, record["disc_measured"].attrs)
    return out, source


def _turning(record: xr.Dataset, which: str) -> tuple[np.ndarray, np.ndarray]:
    angle = next((record[name].values for name in ("angle_measured", "angle") if name in record), None)
    if angle is None or "disc_measured" not in record:
        raise SchemaError(f"slow roll: {which} has no shaft angle or no disc_measured; map a keyphasor and the probes")
    return np.asarray(angle, float), np.asarray(record["disc_measured"].values, float)


def _speed(record: xr.Dataset, angle: np.ndarray) -> float:
    """Highest speed [rad/s] of a tenth of a record."""
    time = np.asarray(record["time"].values, float)
    parts = [part for part in np.array_split(np.arange(time.size), 10) if part.size > 1]
    rates = [abs(angle[p[-1]] - angle[p[0]]) / (time[p[-1]] - time[p[0]]) for p in parts]
    return float(np.nanmax(rates))


def _check_slow(slow: float, high: float) -> None:
    if slow > SLOW * high:
        raise SchemaError(
            f"slow roll: {slow * TO_RPM:.4g} rpm is not slow for a record up to {high * TO_RPM:.4g} rpm; "
            f"give one below {SLOW * high * TO_RPM:.4g} rpm"
        )

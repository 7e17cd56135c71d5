r"""Run-up vectors of a record over time: 1X, 2X, 3X of window after window of whole revolutions, without overlap.

.. math:: d(t) = d_0 + d_1 t + \sum_n \Re\{A_n e^{i n \alpha(t)}\}

by least squares over each window, all samples weighing the same; `diagnose` tracks its twin with the same function.
Windows that do not continue the sweep (a speed held at the beginning or end, a dip) are left out, which a note states.

Cites: bendat_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import make_vectors
from identification.records.schema import measured, notes_of, with_notes
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.blocks import TURNING
from rotorsim.discrepancy.data.changes import RING
from rotorsim.discrepancy.data.spectra import displacement_of, only_probe
from rotorsim.base.rounding import answer

if TYPE_CHECKING:
    import xarray as xr

ORDERS = (1, 2, 3)
"""Multiples of the shaft speed."""
FEWEST_ROWS = 3
"""Fewest windows of a sweep."""
SAMPLES_OF_A_TURN = 4
"""Least samples of a period of the highest order."""
KEPT = ("record", "disc_position", "accuracy", "slow_roll", "changes")
"""Attributes of the record that hold for its vectors too."""
SWEEP = 0.05
"""Least span of a sweep, as a share of its highest speed."""
GAIN = 0.2
"""Least gain of speed of a window, as a share of the mean gain."""
TURNED_ROUND = (
    "the shaft turns from y to x: y, or the angle of a single probe, is mirrored, as if it turned from x to y"
)


def runup_vectors(record: xr.Dataset, turns: int = 8, orders: Sequence[int] = ORDERS) -> xr.Dataset:
    """Table of vectors of a run-up or coast-down, as `diagnose` takes it.

    Parameters
    ----------
    record : Dataset
        With an angle [rad] (a keyphasor's, or an encoder's) and displacements of the disc [m], or of one probe.
    turns : int
        Revolutions of a window, from 1; fewer follow a beat, more lower the scatter.
    orders : sequence of int
        Multiples of the shaft speed.

    Returns
    -------
    Dataset
        `amplitude` [m, 0-pk] and `phase` [rad, lag] (speed, order, axis); attributes `rate` [rad/s2], `turns`,
        `pressure` [Pa], `probe_angle` [rad] of a single probe, and the notes of the record.

    Raises
    ------
    DataError
        For a record without angle or displacement, one whose speed does not sweep, and a sampling too coarse for an
        order. Test: ``test_runup_vectors.py``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.discrepancy.runup_vectors(runup, turns=4)["amplitude"].dims
    ('speed', 'order', 'axis')
    """
    name = str(record.attrs.get("record", "record"))
    angle, speed, time, backward = _turning(record, name)
    displacement, probe_angle = displacement_of(record, name)
    displacement = displacement[-len(angle) :] if len(angle) < len(displacement) else displacement
    windows = _windows(angle, int(turns), max(orders), name)
    means = np.array([speed[w].mean() for w in windows])
    kept = _sweep(means)
    if len(kept) < FEWEST_ROWS:
        raise DataError(f"{name}: the speed does not rise or fall over {FEWEST_ROWS} windows of {turns} revolutions")
    fitted = np.array([order_vectors(angle[windows[k]], displacement[windows[k]], orders) for k in kept])
    middle = np.array([time[windows[k]].mean() for k in kept])
    if backward:
        if RING in str(record.attrs.get("changes", "")):
            raise DataError(
                f"{name}: the shaft turns from y to x and the sensor ring is turned; swap x and y and the sign of the "
                "ring's angle"
            )
        fitted[:, :, 1] *= -1
        probe_angle = None if probe_angle is None else -probe_angle
    axes = ("x", "y") if probe_angle is None else ("x",)
    fitted = fitted[:, :, : len(axes)]
    attrs = _attributes(record, probe_angle) | {"turns": float(turns)}
    attrs["rate"] = float(np.median(np.abs(np.diff(means[kept]) / np.diff(middle))))
    table = make_vectors(means[kept], np.abs(fitted), -np.angle(fitted), tuple(orders), attrs, axes)
    more = [TURNED_ROUND] if backward else []
    if len(kept) < len(windows):
        more.append(f"{len(windows) - len(kept)} of {len(windows)} windows do not continue the sweep and are left out")
    return with_notes(table, [*notes_of(record), *more])


def order_vectors(angle: np.ndarray, displacement: np.ndarray, orders: Sequence[int]) -> np.ndarray:
    """Complex amplitudes (orders, k) of displacements (n, k) over shaft angles (n,); the argument is minus the lag.

    Fitted by least squares together with a mean and a slope.
    """
    columns = [np.ones_like(angle), np.linspace(-1, 1, len(angle))]
    columns += [part(n * angle) for n in orders for part in (np.cos, np.sin)]
    # c cos(n a) + s sin(n a) = Re((c - i s) exp(i n a))
    found = answer(np.linalg.lstsq, np.column_stack(columns), displacement, rcond=None)[0]
    return np.asarray(found[2::2] - 1j * found[3::2])


def _attributes(record: xr.Dataset, probe_angle: float | None) -> dict[str, Any]:
    """Attributes of the record that hold for its vectors, its mean pressure, and the single probe's angle and plane."""
    attrs: dict[str, Any] = {key: record.attrs[key] for key in KEPT if key in record.attrs}
    pressure = measured(record, "pressure")
    attrs |= {} if pressure is None else {"pressure": float(np.mean(pressure))}
    if probe_angle is None:
        return attrs
    probe = only_probe(record)
    if probe is not None and np.isfinite(float(probe["probe_position"])):
        attrs["disc_position"] = float(probe["probe_position"])
    return attrs | {"probe_angle": probe_angle}


def _windows(angle: np.ndarray, turns: int, highest: int, name: str) -> list[slice]:
    """Samples of consecutive windows of whole revolutions; raises DataError where they hold too few for an order."""
    if not 1 <= turns < len(angle):
        raise DataError(f"{name}: turns is {turns}; give the revolutions of a window, from 1")
    edges = np.searchsorted(angle, np.arange(angle[0], angle[-1], 2 * np.pi * turns))
    if len(edges) > 1 and np.diff(edges).min() < SAMPLES_OF_A_TURN * highest * turns:
        raise DataError(
            f"{name}: has fewer than {SAMPLES_OF_A_TURN} samples in a period of {highest}X; ask for fewer orders"
        )
    return [slice(low, high) for low, high in pairwise(edges)]


def _turning(record: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Angle (n,) [rad] that rises, speed (n,) [rad/s] and time (n,) [s] from where the shaft turns; whether it fell."""
    angle = measured(record, "angle")
    if angle is None or angle.ndim == 0:
        raise DataError(f"{name}: has no angle of the shaft; map a keyphasor or an encoder")
    time = np.asarray(record["time"].values, float)
    turned = np.unwrap(np.asarray(angle, float))
    backward = bool(turned[-1] < turned[0])
    turned = np.maximum.accumulate(-turned if backward else turned)
    speed = np.gradient(turned, time)
    first = int(np.argmax(speed > TURNING))
    return turned[first:], speed[first:], time[first:], backward


def _sweep(speeds: np.ndarray) -> np.ndarray:
    """Numbers of the windows whose speeds rise, or fall, from the slowest to the fastest without a break."""
    if len(speeds) < FEWEST_ROWS or np.ptp(speeds) < SWEEP * speeds.max():
        return np.arange(0)
    low, high = int(np.argmin(speeds)), int(np.argmax(speeds))
    numbers = np.arange(low, high + 1) if low < high else np.arange(low, high - 1, -1)
    least = GAIN * np.ptp(speeds) / max(len(numbers) - 1, 1)
    kept = [int(numbers[0])]
    for k in numbers[1:]:
        if speeds[k] > speeds[kept[-1]] + least:
            kept.append(int(k))
    return np.sort(kept)

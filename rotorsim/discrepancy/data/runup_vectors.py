r"""Run-up vectors of a record over time: 1X, 2X, 3X of window after window of whole revolutions, without overlap.

.. math:: d(t) = d_0 + d_1 t + \sum_n \Re\{A_n e^{i n \alpha(t)}\}

by least squares over each window, all revolutions weighing the same, as `diagnose` tracks its twin. Windows that do not
continue the sweep (a speed held at the beginning or end) are left out.

Cites: bendat_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import make_vectors
from identification.records.notes import notes_of, with_notes
from identification.records.prefilter import measured
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.spectra import displacement_of

if TYPE_CHECKING:
    import xarray as xr

ORDERS = (1, 2, 3)
FEWEST_ROWS = 3
SAMPLES_OF_A_TURN = 4
"""Least samples of a period of the highest order."""
KEPT = ("record", "disc_position", "accuracy", "slow_roll")
"""Attributes of the record that hold for its vectors too."""
RISING = 1e-3
"""Least share of its speed that a window must gain on the one before."""


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
    """
    name = str(record.attrs.get("record", "record"))
    angle, speed, time = _turning(record, name)
    displacement, probe_angle = displacement_of(record, name)
    windows = _windows(angle, int(turns), max(orders), name)
    means = np.array([speed[w].mean() for w in windows])
    kept = _sweep(means)
    if len(kept) < FEWEST_ROWS:
        raise DataError(f"{name}: the speed does not rise or fall over {FEWEST_ROWS} windows of {turns} revolutions")
    windows = [windows[k] for k in kept]
    fitted = np.array([_orders(angle[w], displacement[w], orders) for w in windows])
    middle = np.array([time[w].mean() for w in windows])
    attrs: dict[str, Any] = {key: record.attrs[key] for key in KEPT if key in record.attrs}
    attrs |= {"rate": float(np.median(np.abs(np.diff(means[kept]) / np.diff(middle)))), "turns": float(turns)}
    pressure = measured(record, "pressure")
    attrs |= {} if pressure is None else {"pressure": float(np.mean(pressure))}
    attrs |= {} if probe_angle is None else {"probe_angle": probe_angle}
    axes = ("x", "y") if probe_angle is None else ("x",)
    fitted = fitted[:, :, : len(axes)]
    table = make_vectors(means[kept], np.abs(fitted), -np.angle(fitted), tuple(orders), attrs, axes)
    return with_notes(table, notes_of(record))


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


def _turning(record: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle (n,) [rad] that rises, speed (n,) [rad/s] and time (n,) [s]."""
    angle = measured(record, "angle")
    if angle is None or angle.ndim == 0:
        raise DataError(f"{name}: has no angle of the shaft; map a keyphasor or an encoder")
    time = np.asarray(record["time"].values, float)
    turned = np.unwrap(np.asarray(angle, float))
    turned *= np.sign(turned[-1] - turned[0]) or 1.0
    return np.maximum.accumulate(turned), np.abs(np.gradient(turned, time)), time


def _sweep(speeds: np.ndarray) -> np.ndarray:
    """Numbers of the longest run of windows whose speed rises, or falls, from each to the next."""
    if len(speeds) < 2:
        return np.arange(len(speeds))
    step = np.diff(speeds) / np.maximum(speeds[:-1], 1e-9)
    trend = np.where(step > RISING, 1, np.where(step < -RISING, -1, 0))
    starts = np.flatnonzero(np.diff(np.concatenate([[2], trend])))
    ends = np.append(starts[1:], len(trend))
    runs = [(end - start, start) for start, end in zip(starts, ends, strict=True) if trend[start]]
    length, first = max(runs, default=(0, 0))
    return np.arange(first, first + length + 1)


def _orders(angle: np.ndarray, displacement: np.ndarray, orders: Sequence[int]) -> np.ndarray:
    """Complex amplitudes (orders, 2) [m] of a window; their argument is minus the lag."""
    columns = [np.ones_like(angle), np.linspace(-1, 1, len(angle))]
    columns += [part(n * angle) for n in orders for part in (np.cos, np.sin)]
    found = np.linalg.lstsq(np.column_stack(columns), displacement, rcond=None)[0]
    return np.asarray(found[2::2] - 1j * found[3::2])

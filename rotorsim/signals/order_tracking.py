r"""Order tracking: amplitude and phase of 1X, 2X, 3X over speed, and resonances, from a record of any length.

Convention of orders: in a window of whole revolutions a displacement is

.. math:: d(t) = d_0 + d_1 t + \sum_n \Re\{A_n e^{i n \alpha(t)}\}, \qquad A_n = |A_n| e^{-i \varphi_n}

with the shaft angle :math:`\alpha` from the record, amplitudes 0-pk and the phase LAG :math:`\varphi_n` positive: the
maximum passes :math:`\varphi_n / n` of shaft rotation after the mark. Mean, slow trend and all orders are fitted at
once by least squares, weighted by a Hann window so that what lies between the orders leaks little. An order's orbit is
:math:`x + i y = r_f e^{i n \alpha} + r_b e^{-i n \alpha}` with
:math:`r_f = (A_x + i A_y)/2` turning forward (as the shaft does) and :math:`r_b = \overline{(A_x - i A_y)}/2` backward;
its semi-axes are :math:`|r_f| \pm |r_b|`.

Assumes: the speed changes little within a window. Records are read in blocks, never as a whole.

Cites: bendat_2010.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import find_peaks

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.signals.record_blocks import BLOCK, Values, blocks, displacement_name

REVOLUTIONS, SECONDS, ENOUGH, LONGEST = 8, 0.25, 60, 30.0
"""A window spans at least so many revolutions and seconds, or of a fast shaft `ENOUGH` revolutions; where it would take
longer than the last, none is made."""
PROMINENCE, FAINT, APART = 0.1, 0.01, 0.05
"""A peak stands out by the first share of the largest amplitude of its order, exceeds the second share of the largest
of all orders, and is the third share of the highest speed away from larger peaks."""


def track_orders(record: xr.Dataset, orders: Sequence[int] = (1, 2, 3), block: int = BLOCK) -> xr.Dataset:
    """Complex amplitudes of the disc at multiples of the shaft speed, window after window.

    Parameters
    ----------
    record : Dataset
        With `angle` [rad] and `disc` (or `disc_measured`) [m].
    orders : sequence of int
        Multiples of the shaft speed.
    block : int
        Samples read at a time; the result does not depend on it.

    Returns
    -------
    Dataset
        `amplitude` (window, order, axis) complex, 0-pk [m]; `forward` and `backward` (window, order) complex [m];
        `mean` (window, axis) [m]; coordinates `time` [s] and `speed` [rad/s] of the window's middle. No windows for a
        shaft that stands still. Test: ``test_tracking.py::test_orders_of_a_ramp_come_out_with_amplitude_and_phase``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> orders = rs.signals.track_orders(rs.signals.prepared(runup), orders=(1,))
    """
    name = displacement_name(record)
    rows = [_fit(window, window[name], orders) for window in _windows(record, name, block)]
    n, axes = len(rows), record.sizes["axis"]
    amplitude = np.array([row[0] for row in rows], complex).reshape(n, len(orders), axes)
    x, y = amplitude[..., 0], amplitude[..., 1]
    length = {"units": "m", "long_name": "amplitude of an order, 0-pk"}
    return xr.Dataset(
        {
            "amplitude": (("window", "order", "axis"), amplitude, length),
            "forward": (("window", "order"), (x + 1j * y) / 2, length),
            "backward": (("window", "order"), np.conj(x - 1j * y) / 2, length),
            "mean": (("window", "axis"), np.array([row[1] for row in rows]).reshape(n, axes), {"units": "m"}),
        },
        {
            "time": ("window", np.array([row[2] for row in rows]), {"units": "s", "long_name": "time"}),
            "speed": ("window", np.array([row[3] for row in rows]), {"units": "rad/s", "long_name": "shaft speed"}),
            "order": list(orders),
            "axis": ["x", "y"],
        },
    )


def _windows(record: xr.Dataset, name: str, block: int) -> Iterator[Values]:
    """Consecutive windows of whole revolutions; a rest too short for one is left out."""
    held: Values = {}
    for values in blocks(record, ("time", "angle", name), block):
        held = {k: np.concatenate((held[k], v)) for k, v in values.items()} if held else values
        while (found := _window_end(held["time"], held["angle"])) is not None:
            end, whole = found
            if whole:
                yield {k: v[:end] for k, v in held.items()}
            held = {k: v[end:] for k, v in held.items()}


def _window_end(time: np.ndarray, angle: np.ndarray) -> tuple[int, bool] | None:
    """Where the window from the first sample ends and whether it is one; None if more samples are needed to know."""
    last = int(np.searchsorted(time, time[0] + LONGEST, side="right"))
    turned = np.abs(angle[: last + 1] - angle[0]) / (2 * np.pi) + 1e-9
    long = (time[: last + 1] - time[0] >= SECONDS) | (turned >= ENOUGH)
    ready = np.flatnonzero((turned >= REVOLUTIONS) & long)
    ends = np.flatnonzero(turned >= np.ceil(turned[ready[0]] - 2e-9)) if ready.size else ready
    if ends.size:
        return int(ends[0]), True
    return (last, False) if last < len(time) else None


def _fit(window: Values, d: np.ndarray, orders: Sequence[int]) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Amplitudes (order, axis), mean (axis), time and speed of the middle of a window."""
    time, angle = window["time"], window["angle"]
    middle = (time[0] + time[-1]) / 2
    waves = np.outer(angle - angle[0], orders) + np.outer(np.ones(len(angle)), np.multiply(angle[0], orders))
    slow = np.column_stack((np.ones(len(time)), (time - middle) / (time[-1] - time[0])))
    weight = np.sin(np.pi * (np.arange(len(time)) + 0.5) / len(time))[:, None]  # its square is the Hann window
    c, *_ = np.linalg.lstsq(np.hstack((slow, np.cos(waves), np.sin(waves))) * weight, d * weight, rcond=None)
    cosine, sine = c[2 : 2 + len(orders)], c[2 + len(orders) :]
    return cosine - 1j * sine, c[0], float(middle), float((angle[-1] - angle[0]) / (time[-1] - time[0]))


def find_resonances(tracked: xr.Dataset, order: int, axis: str) -> list[dict[str, Any]]:
    """Peaks of one order and axis, the largest first; the largest value at an end, flagged, if it exceeds them.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.find_resonances(rs.signals.track_orders(rs.signals.prepared(runup)), 1, "x")
    """
    chosen = tracked["amplitude"].sel(order=order, axis=axis).values
    size, speed = np.abs(chosen), tracked["speed"].values
    if size.size == 0:
        return []
    swept = np.ptp(np.abs(speed)) > 0.02 * np.abs(speed).max()
    found = find_peaks(size, prominence=PROMINENCE * size.max())[0] if swept else np.array([], int)
    top: list[int] = []
    for i in sorted(found, key=lambda i: -size[i]):
        apart = all(abs(speed[i] - speed[j]) > APART * np.abs(speed).max() for j in top)
        if apart and size[i] > FAINT * np.abs(tracked["amplitude"].values).max():
            top.append(int(i))
    end = int(size.argmax())
    if not top or (size.max() > size[top[0]] and end in (0, size.size - 1)):
        return [_peak(tracked, order, axis, i, i != end) for i in [end, *top]]
    return [_peak(tracked, order, axis, i, True) for i in top]


def _peak(tracked: xr.Dataset, order: int, axis: str, i: int, local: bool) -> dict[str, Any]:
    a = complex(tracked["amplitude"].sel(order=order, axis=axis).values[i])
    return {"order": order, "axis": axis, "rpm": float(tracked["speed"][i] * TO_RPM), "um": abs(a) * TO_UM,
            "time_s": float(tracked["time"][i]), "phase_lag_deg": float((90 - np.angle(a, deg=True)) % 360 - 90),
            "local_maximum": local}  # fmt: skip

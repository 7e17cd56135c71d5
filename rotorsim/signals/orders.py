r"""Orders of a record of any length: tracking, resonances, comparison of runs; deceleration of a coast-down.

Amplitude and phase of 1X, 2X, 3X are tracked over the speed.

Convention of orders: in a window of whole revolutions a displacement is

.. math:: d(t) = d_0 + d_1 t + \sum_n \Re\{A_n e^{i n \alpha(t)}\}, \qquad A_n = |A_n| e^{-i \varphi_n}

with the shaft angle :math:`\alpha` from the record, amplitudes 0-pk and the phase LAG :math:`\varphi_n` positive: the
maximum passes :math:`\varphi_n / n` of shaft rotation after the mark. Mean, slow trend and all orders are fitted at
once by least squares, weighted by a Hann window so that what lies between the orders leaks little. An order's orbit is
:math:`x + i y = r_f e^{i n \alpha} + r_b e^{-i n \alpha}` with
:math:`r_f = (A_x + i A_y)/2` turning forward (as the shaft does) and :math:`r_b = \overline{(A_x - i A_y)}/2` backward;
its semi-axes are :math:`|r_f| \pm |r_b|`.

An order is resolved in a window where it turns below the half of the sampling rate and stands out of what the fit
leaves over: white noise of standard deviation s in N samples gives each part of an amplitude the standard deviation
s sqrt(3 / N) under a Hann window.

A simulated run that starts at speed starts at rest in the static equilibrium, under the unbalance: its first turns are
the way onto the orbit. That start transient is left out, see `after_start`.

Assumes: the speed changes little within a window. Records are read in blocks, never as a whole.

Cites: bendat_2010.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # loads its packages where they are first used
import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.signals.record_blocks import BLOCK, Values, blocks, displacement_name, envelopes, need, prepared

REVOLUTIONS = 8
"""Least revolutions of a window."""
SECONDS = 0.25
"""Least length of a window [s], unless it has `ENOUGH` revolutions."""
ENOUGH = 60
"""Revolutions of a fast shaft that make a window however short."""
LONGEST = 30.0
"""Longest window [s]."""
PROMINENCE = 0.1
"""Least prominence of a peak, as a share of the largest amplitude of its order."""
FAINT = 0.01
"""Least size of a peak, as a share of the largest amplitude of all orders."""
APART = 0.05
"""Least distance of a peak from larger ones, as a share of the highest speed."""
STANDS_OUT = 4.0
"""Standard deviations of its noise by which an order is resolved."""
NYQUIST_SHARE = 0.9
"""Share of the half of the sampling rate up to which an order is resolved."""
UNDRIVEN = ("runup", "coastdown", "steady", "slow_roll")
"""Simulated experiments in which nothing but the rotation moves the disc."""
AHEAD = 8
"""Windows of the median to which the rest of a window is compared."""
FEW = 4
"""Fewest windows that show whether the rest falls."""
FALLS = 1.5
"""Rest over a later one from which it falls."""
STILL = 1.1
"""Rest over that a quarter of the windows later from which it still falls, at a held speed."""
HELD = 0.01
"""Change of the speed over the run, as a share of it, below which it is held."""
CALM = 1.25
"""Largest rest of the first window behind the start, as a multiple of that median."""


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
        `mean` (window, axis) [m]; `resolved` (window, order, axis), whether the amplitude stands out of the noise and
        the sampling resolves it; coordinates `time` [s] and `speed` [rad/s] of the window's middle. No windows for a
        shaft that stands still; a start transient is left out. Test:
        ``test_tracking.py::test_orders_of_a_ramp_come_out_with_amplitude_and_phase``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> orders = rs.signals.track_orders(rs.signals.prepared(runup), orders=(1,))
    """
    name = displacement_name(record)
    rows = [_fit(window, window[name], orders) for window in _windows(after_start(record), name, block)]
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
            "resolved": (("window", "order", "axis"), _resolved(rows, amplitude, orders)),
        },
        {
            "time": ("window", np.array([row[2] for row in rows]), {"units": "s", "long_name": "time"}),
            "speed": ("window", np.array([row[3] for row in rows]), {"units": "rad/s", "long_name": "shaft speed"}),
            "order": list(orders),
            "axis": ["x", "y"],
        },
    )


def mean_order(tracked: xr.Dataset, order: int, axis: str) -> tuple[float, float]:
    """Amplitude [m 0-pk] of an order's mean vector over all windows, and its standard error [m]; NaN for one window.

    Each part of the mean of n vectors A has the standard error sqrt(sum |A - mean|^2 / (2 n (n - 1))).
    """
    a = tracked["amplitude"].sel(order=order, axis=axis).values
    spread = np.sum(np.abs(a - a.mean()) ** 2) / (2 * len(a) * (len(a) - 1)) if len(a) > 1 else np.nan
    return float(abs(a.mean())), float(np.sqrt(spread))


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
    """End of the window from the first sample and whether it is one; None if more samples are needed to decide."""
    last = int(np.searchsorted(time, time[0] + LONGEST, side="right"))
    turned = np.abs(angle[: last + 1] - angle[0]) / (2 * np.pi) + 1e-9
    long = (time[: last + 1] - time[0] >= SECONDS) | (turned >= ENOUGH)
    ready = np.flatnonzero((turned >= REVOLUTIONS) & long)
    ends = np.flatnonzero(turned >= np.ceil(turned[ready[0]] - 2e-9)) if ready.size else ready
    if ends.size:
        return int(ends[0]), True
    return (last, False) if last < len(time) else None


def _fit(
    window: Values, d: np.ndarray, orders: Sequence[int]
) -> tuple[np.ndarray, np.ndarray, float, float, np.ndarray, int, float]:
    """Amplitudes (order, axis), mean (axis), time and speed in the middle, rest (axis), samples, angle of a sample."""
    time, angle = window["time"], window["angle"]
    middle = (time[0] + time[-1]) / 2
    waves = np.outer(angle - angle[0], orders) + np.outer(np.ones(len(angle)), np.multiply(angle[0], orders))
    slow = np.column_stack((np.ones(len(time)), (time - middle) / (time[-1] - time[0])))
    weight = np.sin(np.pi * (np.arange(len(time)) + 0.5) / len(time))[:, None]  # its square is the Hann window
    model = np.hstack((slow, np.cos(waves), np.sin(waves))) * weight
    c, *_ = np.linalg.lstsq(model, d * weight, rcond=None)
    rest = np.sqrt(((d * weight - model @ c) ** 2).sum(axis=0) / (weight**2).sum())
    cosine, sine = c[2 : 2 + len(orders)], c[2 + len(orders) :]
    speed = float((angle[-1] - angle[0]) / (time[-1] - time[0]))
    advance = float(np.abs(angle[-1] - angle[0]) / (len(angle) - 1))
    return cosine - 1j * sine, c[0], float(middle), speed, rest, len(time), advance


def _resolved(rows: list[Any], amplitude: np.ndarray, orders: Sequence[int]) -> np.ndarray:
    """Whether amplitudes (window, order, axis) stand out of the noise and the sampling resolves their orders."""
    if not rows:
        return np.zeros(amplitude.shape, bool)
    noise = np.array([np.sqrt(3 / row[5]) * row[4] for row in rows])[:, None, :]
    advance = np.array([row[6] for row in rows])[:, None]
    sampled = np.abs(orders) * advance < NYQUIST_SHARE * np.pi
    return (np.abs(amplitude) > STANDS_OUT * noise) & sampled[:, :, None]


def after_start(record: xr.Dataset) -> xr.Dataset:
    """The record without its start transient, see `start_transient`."""
    begin = start_transient(record)
    if not begin:
        return record
    return record.isel(time=slice(int(np.searchsorted(record["time"].values, begin - 1e-9)), None))


def start_transient(record: xr.Dataset) -> float:
    """Time [s] that a simulated run takes from its static equilibrium onto its orbit; 0 for one that starts at rest.

    The rest of the first windows, which the orders do not explain, falls until the free vibration has decayed; a
    hundredth of the orders counts as nothing. A rest that stays or grows within half of the run is taken for a motion
    of its own, not for the start; of one that still falls there the first half is the start, see `start_settled`.
    """
    return _start(record)[0]


def start_settled(record: xr.Dataset) -> bool:
    """Whether the free vibration of a run's start has decayed within its first half."""
    return _start(record)[1]


def _start(record: xr.Dataset) -> tuple[float, bool]:
    """Time [s] of the start transient, and whether the motion is that of the orbit after it."""
    simulated = "machine" in record.attrs and record.attrs.get("experiment") in UNDRIVEN
    if not simulated or "angle" not in record or abs(float(record["time"][0])) > 1e-9:
        return 0.0, True
    name, speed = displacement_name(record), record["speed"].values
    half = float(record["time"][-1]) / 2
    begins: list[float] = []
    rests: list[float] = []
    if abs(float(speed[0])) < 1e-9:
        return 0.0, True
    held = float(np.ptp(speed)) < HELD * abs(float(speed[0]))
    for window in _windows(record, name, BLOCK):
        begins.append(float(window["time"][0]))
        fit = _fit(window, window[name], (1, 2, 3))
        rests.append(max(float(np.linalg.norm(fit[4])), FAINT * float(np.linalg.norm(fit[0]))))
        k = len(rests) - AHEAD
        if k >= 0 and (begins[-1] > half or (not held and rests[k] <= CALM * np.median(rests[k:]))):
            break
    ahead = [float(np.median(rests[k : k + AHEAD])) for k in range(len(rests))]
    lowest = min(ahead, default=0.0) if held else np.inf  # of a swept run the rest varies with the speed
    if not rests:
        return 0.0, True
    ended = not held and begins[-1] > half and len(rests) >= AHEAD
    last = len(rests) - AHEAD if ended else len(rests) - 1
    calm = [k for k in range(last + 1) if rests[k] <= min(CALM * ahead[k], FALLS * lowest) and begins[k] <= half]
    quarter, middle = max(len(rests) // 4, 1), len(rests) // 2
    first, third, end = (
        float(np.median(part)) for part in (rests[:quarter], rests[middle : middle + quarter], rests[-quarter:])
    )
    falls = third > STILL * end if held else not calm and first > FALLS * end
    if len(rests) >= FEW and falls:
        return max(begin for begin in begins if begin <= half), False
    return (begins[calm[0]] if calm else 0.0), True


def find_resonances(tracked: xr.Dataset, order: int, axis: str) -> list[dict[str, Any]]:
    """Peaks of one order and axis where it is resolved, the largest first; before them a larger value that is none.

    `local_maximum` distinguishes peaks from such a value; `at_end` is "start" or "end" for one in the first or last of
    several windows in which the order is resolved, else "". An order that is resolved nowhere has none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.find_resonances(rs.signals.track_orders(rs.signals.prepared(runup)), 1, "x")
    """
    chosen = tracked["amplitude"].sel(order=order, axis=axis).values
    size, speed = np.abs(chosen), tracked["speed"].values
    if "resolved" in tracked:
        size = np.where(tracked["resolved"].sel(order=order, axis=axis).values, size, 0.0)
    if not size.any():
        return []
    seen = np.flatnonzero(size)
    swept = np.ptp(np.abs(speed)) > 0.02 * np.abs(speed).max()
    found = seen[scipy.signal.find_peaks(size[seen], prominence=PROMINENCE * size.max())[0]] if swept else seen[:0]
    top: list[int] = []
    for i in sorted(found, key=lambda i: -size[i]):
        apart = all(abs(speed[i] - speed[j]) > APART * np.abs(speed).max() for j in top)
        if apart and size[i] > FAINT * np.abs(tracked["amplitude"].values).max():
            top.append(int(i))
    end, ends = int(size.argmax()), {int(seen[0]): "start", int(seen[-1]): "end"} if seen.size > 1 else {}
    if not top or (size.max() > size[top[0]] and end in ends):
        return [_peak(tracked, order, axis, i, "" if i != end else ends.get(i, ""), i != end) for i in [end, *top]]
    return [_peak(tracked, order, axis, i, "", True) for i in top]


def _peak(tracked: xr.Dataset, order: int, axis: str, i: int, at_end: str, local: bool) -> dict[str, Any]:
    a = complex(tracked["amplitude"].sel(order=order, axis=axis).values[i])
    return {"order": order, "axis": axis, "rpm": float(tracked["speed"][i] * TO_RPM), "um": abs(a) * TO_UM,
            "time_s": float(tracked["time"][i]), "phase_lag_deg": float((90 - np.angle(a, deg=True)) % 360 - 90),
            "local_maximum": local, "at_end": at_end}  # fmt: skip


NEAR = 0.2
"""Peaks of two runs belong together where their speeds differ by less than this share."""


@dataclass(frozen=True, eq=False)
class RunComparison:
    """Orders by the name of the run: `amplitude` (window, order, axis) complex [m, 0-pk] over `speed` [rad/s].

    The attribute `channel` of each is `disc`, the true displacement, or `disc_measured`, as of every table of vectors.
    """

    tracked: Mapping[str, xr.Dataset]
    order: int

    @property
    def channels(self) -> dict[str, str]:
        """Channel of each run that is compared."""
        return {name: str(one.attrs["channel"]) for name, one in self.tracked.items()}

    @property
    def mixed(self) -> str:
        """Sentence where the true displacement of some runs stands against the measured one of others; else empty."""
        true, measured = ([n for n, one in self.channels.items() if one == c] for c in ("disc", "disc_measured"))
        if not true or not measured:
            return ""
        return (
            f"true displacements ({', '.join(true)}) stand against measured ones ({', '.join(measured)}): runout and "
            "errors of the sensors are in their differences"
        )

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes that some run has."""
        every = {str(axis) for one in self.tracked.values() for axis in one["axis"].values}
        return tuple(sorted(every))

    def peaks(self) -> list[dict[str, Any]]:
        """Peaks of the order: run, axis, rpm, um (0-pk), phase_lag_deg, and rpm_change, um_change from the first run.

        A change is a share of the first run's value, None where that has no peak near; a phase lag is within half a
        turn of that of the near peak.
        """
        rows: list[dict[str, Any]] = []
        first = next(iter(self.tracked))
        for name, tracked in self.tracked.items():
            for axis in self.axes:
                for peak in _peaks(tracked, self.order, axis):
                    own = [p for p in rows if p["run"] == first and p["axis"] == axis]
                    rows.append({"run": name, **peak, **(_change(peak, own) if name != first else {})})
        return rows


def compare_runs(runs: Mapping[str, xr.Dataset], order: int = 1) -> RunComparison:
    """Track an order of several runs, which may be records over time or run-up vectors.

    Parameters
    ----------
    runs : Datasets by name
        At least two; the first is what the others are compared with.
    order : int
        Multiple of the shaft speed.

    Raises
    ------
    DataError
        For fewer than two runs, a run without displacement or angle, without a turning shaft, or without the order.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.signals.compare_runs({"before": runup, "after": runup}).peaks()[0]["run"]
    'before'
    """
    if isinstance(runs, xr.Dataset) or not isinstance(runs, Mapping):
        raise DataError(
            f"runs: a {type(runs).__name__}; give Datasets by name, e.g. {{'before': first, 'after': second}}"
        )
    if len(runs) < 2:
        raise DataError(f"compare: {len(runs)} run; give at least two")
    return RunComparison({name: _orders(name, run, order) for name, run in runs.items()}, order)


def _orders(name: str, run: xr.Dataset, order: int) -> xr.Dataset:
    """The order over the speed, of a record or of a table of vectors."""
    if "speed" in run.dims:
        if order not in run["order"].values:
            raise DataError(f"{name}: holds no {order}X; its orders are {', '.join(map(str, run['order'].values))}")
        found = run.sel(order=[order]).rename(speed="window")
        amplitude = found["amplitude"] * np.exp(-1j * found["phase"])
        coords = {"speed": ("window", run["speed"].values), "time": ("window", np.full(run.sizes["speed"], np.nan))}
        return xr.Dataset({"amplitude": amplitude.drop_vars("window")}, coords, {"channel": "disc_measured"})
    try:
        found = track_orders(prepared(run), [order])
    except DataError as error:
        raise DataError(f"{name}: {error}") from error
    if not found.sizes["window"] and not {"angle", "angle_measured"} & set(run.variables):
        raise DataError(f"{name}: holds no angle of the shaft, so no {order}X; give a record with the angle or pulses")
    if not found.sizes["window"]:
        raise DataError(f"{name}: the shaft does not turn for eight revolutions; there is no {order}X")
    return found[["amplitude"]].assign_attrs(channel=displacement_name(run))


def _peaks(tracked: xr.Dataset, order: int, axis: str) -> list[dict[str, Any]]:
    if axis not in tracked["axis"].values:
        return []
    kept = ("axis", "rpm", "um", "phase_lag_deg", "local_maximum")
    return [{key: peak[key] for key in kept} for peak in find_resonances(tracked, order, axis)]


def _change(peak: dict[str, Any], of_first: list[dict[str, Any]]) -> dict[str, float | None]:
    """Relative changes of speed and amplitude from the nearest peak of the first run, and the phase lag next to its."""
    near = min(of_first, key=lambda p: abs(p["rpm"] - peak["rpm"]), default=None)
    if near is None or abs(near["rpm"] - peak["rpm"]) > NEAR * abs(peak["rpm"]) or not near["um"]:
        return {"rpm_change": None, "um_change": None}
    turns = round((peak["phase_lag_deg"] - near["phase_lag_deg"]) / 360)
    return {
        "phase_lag_deg": peak["phase_lag_deg"] - 360 * turns,
        "rpm_change": peak["rpm"] / near["rpm"] - 1,
        "um_change": peak["um"] / near["um"] - 1,
    }


DECELERATION_BINS = 200


@dataclass(frozen=True)
class Deceleration:
    """Mean `speed` [rad/s] in stretches about `time` [s] and its negative slope `rate` [rad/s^2], each (stretch,)."""

    time: np.ndarray
    speed: np.ndarray
    rate: np.ndarray


def deceleration_of(record: xr.Dataset) -> Deceleration:
    """Deceleration in at most 200 stretches, of the size of the speed whichever way the shaft turns.

    Examples
    --------
    >>> import rotorsim as rs
    >>> down = rs.experiments.coastdown(plant, start=300.0, stop=280.0, rate=100.0, pressure=0.5e6)
    >>> float(rs.signals.deceleration_of(down).rate.mean().round(1))
    100.0
    """
    data = envelopes(record, ["speed"], DECELERATION_BINS)["speed"]
    need(data.time.size >= 5, "The record is too short for a deceleration.")
    speed = np.abs(data.mean)
    need(bool(speed.max() > 0), "The shaft stands still.")
    return Deceleration(data.time, speed, -np.gradient(speed, data.time))

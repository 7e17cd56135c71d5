r"""Order tracking, spectra and summary of a run, from a record of any length.

Convention of orders: in a window of whole revolutions a displacement is

.. math:: d(t) = d_0 + d_1 t + \sum_n \Re\{A_n e^{i n \alpha(t)}\}, \qquad A_n = |A_n| e^{-i \varphi_n}

with the shaft angle :math:`\alpha` from the record, amplitudes 0-pk and the phase LAG :math:`\varphi_n` positive: the
maximum passes :math:`\varphi_n / n` of shaft rotation after the mark. Mean, slow trend and all orders are fitted at
once by least squares, weighted by a Hann window so that what lies between the orders leaks little. An order's orbit is
:math:`x + i y = r_f e^{i n \alpha} + r_b e^{-i n \alpha}` with
:math:`r_f = (A_x + i A_y)/2` turning forward (from x to y) and :math:`r_b = \overline{(A_x - i A_y)}/2` backward;
its semi-axes are :math:`|r_f| \pm |r_b|`.

Assumes: the speed changes little within a window. Records are read in blocks, never as a whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import detrend, find_peaks
from scipy.signal.windows import hann

from identification.records.schema import named_axes
from rotorsim.base.hdf5_check import check_hdf5
from rotorsim.errors import DataError, MachineFileError

BLOCK = 100_000
"""Samples read at a time."""
REVOLUTIONS, SECONDS, LONGEST = 8, 0.25, 30.0
"""A window spans at least so many revolutions and seconds; where it would take longer than the last, none is made."""
PROMINENCE, FAINT, APART = 0.1, 0.01, 0.05
"""A peak stands out by the first share of the largest amplitude of its order, exceeds the second share of the largest
of all orders, and is the third share of the highest speed away from larger peaks."""
RPM = 30 / np.pi
UM = 1e6
Values = dict[str, np.ndarray]


def open_record(path: str | Path) -> xr.Dataset:
    """Open a record without reading it, not even its time axis where xarray allows that; raises DataError."""
    try:
        if wrong := check_hdf5(Path(path)):
            raise DataError(f"{path}: {wrong}")
        return named_axes(_opened(path))
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as a record ({error}); give a file that a run wrote") from error


def _opened(path: str | Path) -> xr.Dataset:
    try:
        return xr.open_dataset(path, engine="h5netcdf", create_default_indexes=False)
    except TypeError:  # an xarray before that option
        return xr.open_dataset(path, engine="h5netcdf")


def displacement_name(record: xr.Dataset) -> str:
    """`disc` of a virtual record, `disc_measured` of a measured one; raises DataError without either."""
    for name in ("disc", "disc_measured"):
        if name in record:
            return name
    raise DataError("record: neither 'disc' nor 'disc_measured'; give the displacement of the disc")


def blocks(record: xr.Dataset, names: Sequence[str], size: int = BLOCK) -> Iterator[Values]:
    """Values of some variables, block after block of time."""
    missing = [name for name in names if name not in record.variables]
    if missing:
        raise DataError(f"record: no variable '{missing[0]}'; it is needed for this analysis")
    for start in range(0, record.sizes["time"], size):
        part = record.isel(time=slice(start, start + size))
        yield {name: np.asarray(part[name].values, float) for name in names}


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
    ready = np.flatnonzero((turned >= REVOLUTIONS) & (time[: last + 1] - time[0] >= SECONDS))
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


def waterfall(record: xr.Dataset, lines: int = 120, max_frequency: float = 500.0) -> xr.Dataset:
    """Amplitude spectra of the disc along a record, and full spectra that tell forward from backward whirl.

    Hann window, mean and trend removed, corrected for the window so that a sine of amplitude a shows a. Each line is
    the root mean square of the spectra of its stretch of the record, cut into pieces of at most 1 s.

    Parameters
    ----------
    record : Dataset
        With `speed` [rad/s] and `disc` (or `disc_measured`) [m], evenly sampled.
    lines : int
        Spectra along the record; fewer for a record too short for pieces of 0.25 s.
    max_frequency : float
        Highest frequency kept [Hz].

    Returns
    -------
    Dataset
        `amplitude` (line, frequency, axis) 0-pk [m]; `full` (line, signed_frequency) [m], spectrum of x + i y, positive
        frequency = forward; coordinates `time` [s], `speed` [rad/s]; attribute `resolution_hz` = 1 / piece.
    """
    name, n = displacement_name(record), record.sizes["time"]
    if n < 2:
        raise DataError(f"record: {n} samples make no spectrum; give at least 2")
    ends = np.asarray(record["time"].isel(time=[0, -1]).values, float)
    dt = (ends[1] - ends[0]) / (n - 1)
    count = int(np.clip(n * dt / SECONDS, 1, lines))
    edges = np.linspace(0, n, count + 1).astype(int)
    piece = min(int(np.diff(edges).min()), max(2, round(1.0 / dt)))
    rows = []
    for first, last in pairwise(edges):
        part = record.isel(time=slice(first, last))
        d, speed = np.asarray(part[name].values, float), float(part["speed"].values.mean())
        rows.append((*_spectra(d, piece), ends[0] + (first + last - 1) / 2 * dt, speed))
    return _waterfall_dataset(rows, piece, dt, max_frequency)


def _spectra(d: np.ndarray, piece: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude spectra of x and y (frequency, axis) and of x + i y, twice as fine as the piece's own lines."""
    cut = d[: len(d) // piece * piece].reshape(-1, piece, 2)
    taper = hann(piece, sym=False)[:, None]
    cut = detrend(cut, axis=1) * taper / taper.sum()
    single = 2 * np.abs(np.fft.rfft(cut, 2 * piece, axis=1))
    full = np.abs(np.fft.fft(cut[..., 0] + 1j * cut[..., 1], 2 * piece, axis=1))
    return np.sqrt(np.mean(single**2, axis=0)), np.sqrt(np.mean(full**2, axis=0))


def _waterfall_dataset(rows: list[Any], piece: int, dt: float, max_frequency: float) -> xr.Dataset:
    frequency, signed = np.fft.rfftfreq(2 * piece, dt), np.fft.fftshift(np.fft.fftfreq(2 * piece, dt))
    keep, keep_signed = frequency <= max_frequency, np.abs(signed) <= max_frequency
    full = np.array([np.fft.fftshift(row[1])[keep_signed] for row in rows])
    length = {"units": "m", "long_name": "amplitude, 0-pk"}
    return xr.Dataset(
        {
            "amplitude": (("line", "frequency", "axis"), np.array([row[0][keep] for row in rows]), length),
            "full": (("line", "signed_frequency"), full, length),
        },
        {
            "frequency": ("frequency", frequency[keep], {"units": "Hz", "long_name": "frequency"}),
            "signed_frequency": ("signed_frequency", signed[keep_signed], {"units": "Hz", "long_name": "frequency"}),
            "time": ("line", [row[2] for row in rows], {"units": "s", "long_name": "time"}),
            "speed": ("line", [row[3] for row in rows], {"units": "rad/s", "long_name": "shaft speed"}),
            "axis": ["x", "y"],
        },
        {"resolution_hz": 1 / (piece * dt)},
    )


def summarise(record: xr.Dataset, tracked: xr.Dataset, spectra: xr.Dataset | None = None) -> dict[str, Any]:
    """Numbers of a run, ready for JSON, in units for people (rpm, um 0-pk, kg/s, normal litres per minute).

    Parameters
    ----------
    record : Dataset
        The record; what it lacks (film, contact) is None in the answer.
    tracked : Dataset
        Of `track_orders`.
    spectra : Dataset, optional
        Of `waterfall`; made here if not given.

    Returns
    -------
    dict
        duration_s, samples, speed_rpm, peaks, largest_orbit, smallest_film, contact, mass_flow, sub_synchronous.
        A peak with ``local_maximum = False`` is the largest amplitude at an end of the speed range, not a resonance.
        The largest orbit is measured from the slowly moving mean.
    """
    spectra = waterfall(record) if spectra is None else spectra
    seen = _scan(record, tracked)
    flow, contact = seen.get("mass_flow"), seen.get("contact")
    return {
        "duration_s": seen["time"]["last"] - seen["time"]["first"],
        "samples": int(record.sizes["time"]),
        "speed_rpm": {k: seen["speed"][k] * RPM for k in ("first", "last", "min", "max")},
        "peaks": [p for n in tracked["order"].values for axis in "xy" for p in find_resonances(tracked, int(n), axis)],
        "largest_orbit": _at_most(seen["radius"]),
        "smallest_film": _at_least(seen["h_min"]) if "h_min" in seen else None,
        "contact": contact and {"samples": contact["positive"], "first_time_s": contact["first_time"],
                                "first_rpm": contact["first_speed"]},
        "mass_flow": flow and _flow(flow, normal_density(record)),
        "sub_synchronous": largest_sub_synchronous(spectra),
    }  # fmt: skip


def _at_most(seen: dict[str, Any]) -> dict[str, float]:
    return {"um": seen["max"] * UM, "rpm": seen["max_speed"] * RPM, "time_s": seen["max_time"]}


def _at_least(seen: dict[str, Any]) -> dict[str, float]:
    return {"um": seen["min"] * UM, "rpm": seen["min_speed"] * RPM, "time_s": seen["min_time"]}


def _flow(seen: dict[str, Any], density: float) -> dict[str, float]:
    """Mass flow [kg/s] and in normal litres per minute (273.15 K, 101325 Pa)."""
    mean = {"mean": seen["sum"] / seen["count"], "min": seen["min"], "max": seen["max"]}
    return {f"{k}_kg_s": v for k, v in mean.items()} | {f"{k}_nl_min": v / density * 6e4 for k, v in mean.items()}


def _scan(record: xr.Dataset, tracked: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Extremes, sums and ends of all scalars of a record, and of the disc's distance from its mean, in one pass."""
    name = displacement_name(record)
    scalars = [v for v in ("time", "speed", "h_min", "mass_flow", "contact") if v in record.variables]
    seen: dict[str, dict[str, Any]] = {}
    for block in blocks(record, [*scalars, name]):
        block["radius"] = np.hypot(*(block[name] - _centre(tracked, block["time"], block[name])).T)
        for key in (*scalars, "radius"):
            _note(seen.setdefault(key, {}), block[key], block["time"], block["speed"])
    return seen


def _centre(tracked: xr.Dataset, time: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Slowly moving mean (n, 2) of the disc; of the block where the shaft stands still."""
    if tracked.sizes["window"] == 0:
        return d.mean(axis=0, keepdims=True)
    return np.column_stack([np.interp(time, tracked["time"], tracked["mean"][:, i]) for i in range(2)])


def _note(seen: dict[str, Any], values: np.ndarray, time: np.ndarray, speed: np.ndarray) -> None:
    """Take a block into the running numbers of one variable."""
    seen.setdefault("first", float(values[0]))
    seen["last"] = float(values[-1])
    seen["sum"] = seen.get("sum", 0.0) + float(values.sum())
    seen["count"] = seen.get("count", 0) + len(values)
    positive = np.flatnonzero(values > 0)
    seen["positive"] = seen.get("positive", 0) + len(positive)
    if seen.setdefault("first_time", None) is None and positive.size:
        seen["first_time"], seen["first_speed"] = float(time[positive[0]]), float(speed[positive[0]] * RPM)
    seen.setdefault("first_speed", None)
    for key, i in (("min", values.argmin()), ("max", values.argmax())):
        better = key not in seen or (values[i] < seen[key] if key == "min" else values[i] > seen[key])
        if better:
            seen |= {key: float(values[i]), f"{key}_time": float(time[i]), f"{key}_speed": float(speed[i])}


def find_resonances(tracked: xr.Dataset, order: int, axis: str) -> list[dict[str, Any]]:
    """Peaks of one order and axis, the largest first; the largest value at an end, flagged, if it exceeds them."""
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
    return {"order": order, "axis": axis, "rpm": float(tracked["speed"][i] * RPM), "um": abs(a) * UM,
            "time_s": float(tracked["time"][i]), "phase_lag_deg": -float(np.angle(a, deg=True)),
            "local_maximum": local}  # fmt: skip


def largest_sub_synchronous(spectra: xr.Dataset) -> dict[str, float] | None:
    """Largest component of x + i y below 1X, clear of 1X and of the slow drift; None if there is none.

    um 0-pk, frequency_hz (negative = backward), ratio to 1X, rpm and time_s where. What is below 1 % of the largest
    line of its spectrum counts as leakage.
    """
    signed, speeds = spectra["signed_frequency"].values, spectra["speed"].values
    swept = np.abs(np.gradient(speeds)) if speeds.size > 1 else np.zeros(1)
    best: dict[str, float] | None = None
    for i, size in enumerate(spectra["full"].values):
        turning = abs(speeds[i]) / (2 * np.pi)
        guard = 4 * spectra.attrs["resolution_hz"] + swept[i] / (2 * np.pi)
        peaks = find_peaks(size, height=0.01 * size.max())[0]
        inside = peaks[(np.abs(signed[peaks]) > guard) & (np.abs(signed[peaks]) < turning - guard)]
        if inside.size and (best is None or size[inside].max() * UM > best["um"]):
            k = inside[size[inside].argmax()]
            frequency = float(signed[k])
            best = {"um": float(size[k] * UM), "frequency_hz": frequency, "ratio": abs(frequency) / turning,
                    "rpm": float(speeds[i] * RPM), "time_s": float(spectra["time"][i])}  # fmt: skip
    return best


def normal_density(record: xr.Dataset) -> float:
    """Density [kg/m^3] of the machine's gas at 273.15 K and 101325 Pa; of air if the record tells no machine."""
    from rotorsim.machine import Gas, Machine

    try:
        gas = Machine.from_text(str(record.attrs.get("machine", ""))).gas
    except MachineFileError:
        gas = Gas()
    return 101325 / (gas.gas_constant * 273.15)

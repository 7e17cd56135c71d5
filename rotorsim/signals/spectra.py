r"""Spectra and frequency responses of records of any length: averaged, over time and speed, between inputs and motion.

x and y have one-sided spectra; the full spectrum of x + i y separates forward from backward whirl. Amplitudes are 0-pk
and corrected for the Hann window: a sine of amplitude a shows a.

A frequency response has the lines at which its inputs drive it. Spectra are summed block by block; H1 and the multiple
coherence :math:`\gamma_i^2`, the share of the motion along axis i that follows linearly from the inputs, are those of
`identification.records.frequency_response`, which an identification starts from. Assumes: noise at the output only,
inputs that do not follow the output (no feedback).

Cites: bendat_2010.
"""

import operator
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
import scipy  # loads its packages where they are first used
import xarray as xr

from identification.records.frequency_response import CrossSpectra, segments_of, transforms
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.signals.orders import SECONDS, after_start
from rotorsim.signals.record_blocks import blocks, displacement_name, need, overlapping, sampling_time

LONGEST, LEAST = 4.0, 0.1
"""Length of a segment [s]: at most, and at least for there to be a spectrum."""
SWEPT = 2.0
"""Most that the speed may change within a spectrum along a record, times its length: beyond, a line that follows the
speed is smeared over more than the width of the window."""


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes 0-pk [m]: `single` (frequency, axis) over `frequency` [Hz], `full` (signed,) over `signed` [Hz];
    the lines are `resolution` [Hz] wide, `count` segments are averaged."""

    frequency: np.ndarray
    single: np.ndarray
    signed: np.ndarray
    full: np.ndarray
    resolution: float
    count: int


def spectrum_of(record: xr.Dataset, name: str, most: float, less: str = "") -> Spectrum:
    """Root mean square of Hann-weighted amplitude spectra of a variable (time, axis), less another if one is named.

    A sine of amplitude a shows a, a circular orbit of radius a shows a at its signed frequency, positive where it turns
    as the shaft does in the middle of the record. Frequencies reach `most` [Hz].
    Test: ``test_signals.py::test_an_ellipse_shows_its_forward_and_backward_parts``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.spectrum_of(rs.signals.prepared(record), "disc", 500.0)
    """
    dt, n = sampling_time(record), record.sizes["time"]
    need(n * dt >= LEAST, f"The record of {n * dt:.2g} s is too short for a spectrum.")
    length = min(n, round(LONGEST / dt))
    window, single, full, count = segments_of(length, dt), 0.0, 0.0, 0
    sense = -1 if "speed" in record and float(record["speed"].isel(time=n // 2)) < 0 else 1
    for part in overlapping(record, (name, less) if less else (name,), length, window.hop):
        d = transforms(window, part[name] - part[less] if less else part[name], "constant") / window.win.sum()
        single = single + np.sum(np.abs(2 * d) ** 2, axis=-1).T
        full = full + np.sum(two_sided(d, length, sense) ** 2, axis=-1)
        count += d.shape[-1]
    frequency, signed = np.fft.rfftfreq(length, dt), np.fft.fftshift(np.fft.fftfreq(length, dt))
    kept, kept_signed = frequency <= most, np.abs(signed) <= most
    return Spectrum(frequency[kept], np.sqrt(single / count)[kept], signed[kept_signed],
                    np.sqrt(full / count)[kept_signed], 2 / (length * dt), count)  # fmt: skip


def two_sided(found: np.ndarray, n: int, sense: int) -> np.ndarray:
    """Size (n, ...) of the full spectrum of x + i y over rising signed frequencies.

    The one-sided transforms `found` (2, f, ...) are those of n real samples of x and y; a `sense` of -1 gives x - i y.
    """
    x, y = found
    forward, backward = np.abs(x + sense * 1j * y), np.abs(x - sense * 1j * y)
    return np.concatenate((backward[:0:-1], forward[: n - len(x) + 1]))


@dataclass(frozen=True)
class SensorError:
    """Measured less true displacement of the disc, per axis [m]: mean `offset`, `rms` about it, `peak_to_peak`; its
    `spectrum`."""

    offset: np.ndarray
    rms: np.ndarray
    peak_to_peak: np.ndarray
    spectrum: Spectrum


def difference_of(record: xr.Dataset, most: float) -> SensorError:
    """Compare `disc_measured` with `disc`; frequencies up to `most` [Hz]. Raises MissingError without both."""
    need("disc" in record and "disc_measured" in record, "The record has not both the true and the measured motion.")
    count, total, squares = 0, np.zeros(2), np.zeros(2)
    least, largest = np.full(2, np.inf), np.full(2, -np.inf)
    for block in blocks(record, ("disc", "disc_measured")):
        d = block["disc_measured"] - block["disc"]
        count, total, squares = count + len(d), total + d.sum(axis=0), squares + (d**2).sum(axis=0)
        least, largest = np.minimum(least, d.min(axis=0)), np.maximum(largest, d.max(axis=0))
    need(bool(np.any(largest > least) or np.any(total != 0)), "The sensors show the true motion without any error.")
    mean = total / count
    rms = np.sqrt(np.maximum(squares / count - mean**2, 0))
    return SensorError(mean, rms, largest - least, spectrum_of(record, "disc_measured", most, less="disc"))


def waterfall(record: xr.Dataset, lines: int = 120, max_frequency: float = 500.0) -> xr.Dataset:
    """Amplitude spectra of the disc along a record, and full spectra that separate forward from backward whirl.

    Hann window, mean and trend removed, corrected for the window so that a sine of amplitude a shows a. Each line is
    the root mean square of the spectra of its stretch of the record, cut into pieces of at most 1 s. Stretches are
    shorter where the speed changes fast (`SWEPT`). A start transient is left out.

    Parameters
    ----------
    record : Dataset
        With `speed` [rad/s] and `disc` (or `disc_measured`) [m], evenly sampled.
    lines : int
        Spectra along the record; fewer for a record too short for pieces of 0.25 s, which is less where it sweeps.
    max_frequency : float
        Highest frequency kept [Hz].

    Returns
    -------
    Dataset
        `amplitude` (line, frequency, axis) 0-pk [m]; `full` (line, signed_frequency) [m], spectrum of x + i y (of
        x - i y where the shaft turns from y to x), positive frequency = forward; coordinates `time` [s], `speed`
        [rad/s]; attribute `resolution_hz` = 1 / piece.
    """
    record = after_start(record)
    name, n = displacement_name(record), record.sizes["time"]
    if n < 2:
        raise DataError(f"record: {n} samples make no spectrum; give at least 2")
    ends = np.asarray(record["time"].isel(time=[0, -1]).values, float)
    dt = (ends[1] - ends[0]) / (n - 1)
    change = abs(float(record["speed"][-1]) - float(record["speed"][0])) / (2 * np.pi)
    least = min(SECONDS, np.sqrt(SWEPT * n * dt / change)) if change else SECONDS
    count = int(np.clip(n * dt / least, 1, lines))
    edges = np.linspace(0, n, count + 1).astype(int)
    piece = min(int(np.diff(edges).min()), max(2, round(1.0 / dt)))
    rows = []
    for first, last in pairwise(edges):
        part = {"time": slice(first, last)}
        d = np.asarray(record.variables[name].isel(part).values, float)
        speed = float(record.variables["speed"].isel(part).values.mean())
        rows.append((*_piece_spectra(d, piece, 1 if speed >= 0 else -1), ends[0] + (first + last - 1) / 2 * dt, speed))
    return _waterfall_dataset(rows, piece, dt, max_frequency)


def _piece_spectra(d: np.ndarray, piece: int, sense: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude spectra of x and y (frequency, axis) and of x + i y, twice as fine as the piece's own lines."""
    cut = d[: len(d) // piece * piece].reshape(-1, piece, 2)
    taper = scipy.signal.windows.hann(piece, sym=False)[:, None]
    found = np.fft.rfft(scipy.signal.detrend(cut, axis=1) * taper / taper.sum(), 2 * piece, axis=1).transpose(2, 1, 0)
    full = two_sided(found, 2 * piece, sense)
    return np.sqrt(np.mean(np.abs(2 * found) ** 2, axis=-1)).T, np.sqrt(np.mean(full**2, axis=-1))


def _waterfall_dataset(rows: list[Any], piece: int, dt: float, max_frequency: float) -> xr.Dataset:
    frequency, signed = np.fft.rfftfreq(2 * piece, dt), np.fft.fftshift(np.fft.fftfreq(2 * piece, dt))
    keep, keep_signed = frequency <= max_frequency, np.abs(signed) <= max_frequency
    full = np.array([row[1][keep_signed] for row in rows])
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
        peaks = scipy.signal.find_peaks(size, height=0.01 * size.max())[0]
        inside = peaks[(np.abs(signed[peaks]) > guard) & (np.abs(signed[peaks]) < turning - guard)]
        if inside.size and (best is None or size[inside].max() * TO_UM > best["um"]):
            k = inside[size[inside].argmax()]
            frequency = float(signed[k])
            best = {"um": float(size[k] * TO_UM), "frequency_hz": frequency, "ratio": abs(frequency) / turning,
                    "rpm": float(speeds[i] * TO_RPM), "time_s": float(spectra["time"][i])}  # fmt: skip
    return best


LONGEST_AVERAGED = 2.0
"""Longest segment [s] of an average."""
LEAST_AVERAGED = 0.2
"""Shortest segment [s] of an average."""
FEWEST = 4
"""Fewest segments of an average."""
UNDRIVEN = 1e-4
"""Frequencies whose input has less than this share of the largest power are left out."""
AT_REST = 0.01
"""Inputs with less than this share of the power of the strongest at a frequency count as at rest there."""
LINES, WEAKEST_LINE = 0.5, 1e-3
"""Inputs that act at less than the first share of the frequencies are made of lines, of the second share or more of the
strongest line's power."""
SINGULAR = 1e-3
"""Inputs whose spectra leave less than this share independent cannot be separated."""


@dataclass(frozen=True)
class Transfer:
    """Frequency response `H` (frequency, output, input) [m per unit of the input], NaN where undriven, at
    `frequency` [Hz]; `coherence` (frequency, output), None for a single average; `inputs` are the axes driven,
    `count` the averages."""

    frequency: np.ndarray
    H: np.ndarray
    coherence: np.ndarray | None
    inputs: tuple[int, ...]
    input_name: str
    output_name: str
    count: int
    together: bool = False


def welch_transfer(record: xr.Dataset, inputs: tuple[int, ...], drive: str, output: str, most: float) -> Transfer:
    """H1 with Hann segments that overlap by half.

    Parameters
    ----------
    record : Dataset
        With `drive` and `output` (time, axis), evenly sampled; read in blocks.
    inputs : tuple of int
        Axes of `drive` that move.
    drive, output : str
        Names of variables.
    most : float
        Highest frequency kept [Hz].

    Returns
    -------
    Transfer
        Test: ``test_signals.py::test_a_known_two_by_two_system_is_found_with_its_noise_in_the_coherence``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.signals.welch_transfer(record, (0, 1), "reference", "disc", 500.0).H.shape[1:]
    (2, 2)
    """
    dt, n = sampling_time(record), record.sizes["time"]
    length = round(min(LONGEST_AVERAGED, max(LEAST_AVERAGED, n * dt / 8)) / dt)
    averages = f"{FEWEST} averages of {LEAST_AVERAGED:g} s"
    reason = f"The record of {n * dt:.2g} s is too short: a frequency response takes {averages}."
    need(n >= FEWEST / 2 * length + length // 2, reason)
    window = segments_of(length, dt)
    parts = (
        CrossSpectra.of(*(transforms(window, part[k], "constant") for k in (drive, output)))
        for part in overlapping(record, (drive, output), length, window.hop)
    )
    sums = reduce(operator.add, parts)
    return solve(
        sums.at(np.arange(length // 2 + 1), np.array(inputs)), np.fft.rfftfreq(length, dt), inputs, drive, output, most
    )


def solve(
    sums: CrossSpectra, frequency: np.ndarray, inputs: tuple[int, ...], drive: str, output: str, most: float
) -> Transfer:
    """H1 and coherence from summed spectra; inputs that move together are reduced to the first."""
    kept = np.flatnonzero((frequency > 0) & (frequency <= most))
    sums, frequency = sums.at(kept), frequency[kept]
    together = len(inputs) > 1 and _together(sums.uu)
    if together:
        sums, inputs = sums.at(np.arange(len(kept)), slice(1)), inputs[:1]
    H = np.full((len(frequency), sums.yu.shape[1], len(inputs)), np.nan, complex)
    active = driven(np.real(np.einsum("fii->fi", sums.uu)))
    for columns in {tuple(row) for row in active.tolist() if any(row)}:
        rows, c = np.flatnonzero(np.all(active == columns, axis=1)), np.flatnonzero(columns)
        H[np.ix_(rows, np.arange(H.shape[1]), c)] = sums.at(rows, c).h1()[0]
    explained = sums.explained(np.nan_to_num(H))
    coherence = np.clip(explained / np.maximum(sums.yy, 1e-300), 0, 1) if sums.count > len(inputs) else None
    return Transfer(frequency, H, coherence, inputs, drive, output, sums.count, together)


def driven(power: np.ndarray) -> np.ndarray:
    """Which inputs act at which frequency, from their powers (frequency, input); of lines, only their tops."""
    active = (power > UNDRIVEN * power.max(axis=0)) & (power > AT_REST * power.max(axis=1, keepdims=True))
    if active.mean() < LINES:
        padded = np.pad(power, ((1, 1), (0, 0)))
        active &= (power >= padded[:-2]) & (power >= padded[2:]) & (power > WEAKEST_LINE * power.max(axis=0))
    return active


def _together(uu: np.ndarray) -> bool:
    """Whether two inputs cannot be separated at most frequencies at which both act."""
    power = np.real(np.einsum("fii->fi", uu))
    both = driven(power).all(axis=1)
    share = np.abs(np.linalg.det(uu[both])) / power[both].prod(axis=1)
    return bool(both.any() and np.median(share) < SINGULAR)


def peak_of(transfer: Transfer, output: int, column: int) -> tuple[float, float]:
    """Frequency [Hz] and size of the largest value of one element, among frequencies of coherence above one half."""
    size = np.abs(transfer.H[:, output, column])
    if transfer.coherence is not None:
        size = np.where(transfer.coherence[:, output] > 0.5, size, np.nan)
    if not np.isfinite(size).any():
        return float("nan"), float("nan")
    i = int(np.nanargmax(size))
    return float(transfer.frequency[i]), float(size[i])

"""Spectra of a motion: averaged over a steady record, over time and speed, of the sensors' error.

x and y have one-sided spectra; the full spectrum of x + i y separates forward from backward whirl. Amplitudes are 0-pk
and corrected for the Hann window: a sine of amplitude a shows a.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import detrend, find_peaks
from scipy.signal.windows import hann

from identification.records.frequency_response import segments_of, transforms
from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.base.errors import DataError
from rotorsim.signals.orders import SECONDS, after_start
from rotorsim.signals.record_blocks import blocks, displacement_name, need, overlapping, sampling_time

LONGEST, LEAST = 4.0, 0.1
"""Length of a segment [s]: at most, and at least for there to be a spectrum."""


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
    """Root mean square of Hann-weighted amplitude spectra of a variable (time, axis), less another if given.

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
    the root mean square of the spectra of its stretch of the record, cut into pieces of at most 1 s. A start transient
    is left out.

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
    count = int(np.clip(n * dt / SECONDS, 1, lines))
    edges = np.linspace(0, n, count + 1).astype(int)
    piece = min(int(np.diff(edges).min()), max(2, round(1.0 / dt)))
    rows = []
    for first, last in pairwise(edges):
        part = record.isel(time=slice(first, last))
        d, speed = np.asarray(part[name].values, float), float(part["speed"].values.mean())
        rows.append((*_piece_spectra(d, piece, 1 if speed >= 0 else -1), ends[0] + (first + last - 1) / 2 * dt, speed))
    return _waterfall_dataset(rows, piece, dt, max_frequency)


def _piece_spectra(d: np.ndarray, piece: int, sense: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude spectra of x and y (frequency, axis) and of x + i y, twice as fine as the piece's own lines."""
    cut = d[: len(d) // piece * piece].reshape(-1, piece, 2)
    taper = hann(piece, sym=False)[:, None]
    found = np.fft.rfft(detrend(cut, axis=1) * taper / taper.sum(), 2 * piece, axis=1).transpose(2, 1, 0)
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
        peaks = find_peaks(size, height=0.01 * size.max())[0]
        inside = peaks[(np.abs(signed[peaks]) > guard) & (np.abs(signed[peaks]) < turning - guard)]
        if inside.size and (best is None or size[inside].max() * TO_UM > best["um"]):
            k = inside[size[inside].argmax()]
            frequency = float(signed[k])
            best = {"um": float(size[k] * TO_UM), "frequency_hz": frequency, "ratio": abs(frequency) / turning,
                    "rpm": float(speeds[i] * TO_RPM), "time_s": float(spectra["time"][i])}  # fmt: skip
    return best

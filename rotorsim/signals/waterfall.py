"""Waterfall: spectra over time and speed, full spectrum of x + i y, largest component below 1X."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import detrend, find_peaks
from scipy.signal.windows import hann

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.base.errors import DataError
from rotorsim.signals.order_tracking import SECONDS, after_start
from rotorsim.signals.record_blocks import displacement_name

MIRROR = np.array([1.0, -1.0])
"""Mirror image of a displacement (..., 2): that of a shaft that turns the other way."""


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
        rows.append((*_spectra(d if speed >= 0 else d * MIRROR, piece), ends[0] + (first + last - 1) / 2 * dt, speed))
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

"""Averaged spectra of a steady motion: x and y, and full spectrum of x + i y (forward and backward whirl)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.missing import need
from rotorsim.signals.prepare import sampling_time
from rotorsim.signals.segments import segments, taper

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
    window, single, full, count = taper(length), np.zeros(()), np.zeros(()), 0
    turned = -1j if "speed" in record and float(record["speed"].isel(time=n // 2)) < 0 else 1j
    for part in segments(record, (name, less) if less else (name,), length, max(1, length // 2)):
        d = part[name] - part[less] if less else part[name]
        d = (d - d.mean(axis=0)) * window / window.sum()
        single = single + np.abs(2 * np.fft.rfft(d, axis=0)) ** 2
        full = full + np.abs(np.fft.fftshift(np.fft.fft(d[:, 0] + turned * d[:, 1]))) ** 2
        count += 1
    frequency, signed = np.fft.rfftfreq(length, dt), np.fft.fftshift(np.fft.fftfreq(length, dt))
    kept, kept_signed = frequency <= most, np.abs(signed) <= most
    return Spectrum(frequency[kept], np.sqrt(single / count)[kept], signed[kept_signed],
                    np.sqrt(full / count)[kept_signed], 2 / (length * dt), count)  # fmt: skip

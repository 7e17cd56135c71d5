r"""Logarithmic decrement and damped frequency of a ring-down, from its extrema.

.. math:: d(t) = a e^{-\sigma t} \cos(\omega_d t + \varphi), \qquad \delta = 2 \pi \sigma / \omega_d,
          \qquad \zeta = \delta / \sqrt{4 \pi^2 + \delta^2}

The logarithm of the extremes falls on a straight line of slope -sigma; they follow each other every half period.
Assumes: one mode dominates; `scatter` shows how far that holds.

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

from rotorsim.signals.missing import need

SMALLEST, NOISE = 0.05, 4.0
"""Extremes count down to the first share of the largest, and to so many times the rms of the last tenth."""
FEWEST = 4


@dataclass(frozen=True)
class Decay:
    """Damped `frequency` [Hz], `decrement` [1], damping ratio `zeta` [1], `rate` sigma [1/s], `amplitude` [unit of the
    signal] at t = 0; `time` [s] and `size` of the extremes used; rms `scatter` of their logarithms about the line."""

    frequency: float
    decrement: float
    zeta: float
    rate: float
    amplitude: float
    time: np.ndarray
    size: np.ndarray
    scatter: float


def decay_of(time: np.ndarray, signal: np.ndarray) -> Decay:
    """Fit a ring-down, signal (n,) at evenly spaced time (n,) [s].

    Raises
    ------
    MissingError
        With fewer than four extremes above the noise.

    Notes
    -----
    Test: ``test_signals.py::test_a_ring_down_gives_its_decrement_and_frequency``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> t = np.arange(0, 0.5, 2e-4)
    >>> float(round(rs.signals.decay_of(t, np.exp(-10 * t) * np.cos(700 * t)).zeta, 3))
    0.014
    """
    need(len(time) >= 32, "The ring-down is too short.")
    dt = (time[-1] - time[0]) / (len(time) - 1)
    main = dominant_frequency(signal, dt)
    smooth = _smooth(signal, main, dt)
    i = find_peaks(np.abs(smooth), distance=max(1, round(0.35 / main / dt)))[0]
    i = i[time[i] - time[0] > 0.4 / main]
    tail = float(np.sqrt(np.mean(smooth[-max(8, len(smooth) // 10) :] ** 2)))
    least = max(SMALLEST * float(np.abs(smooth[i]).max(initial=0.0)), NOISE * tail)
    low = np.flatnonzero(np.abs(smooth[i]) < least)
    i = i[: low[0]] if low.size else i
    need(i.size >= FEWEST, f"The ring-down shows {i.size} extremes above the noise; a decrement takes {FEWEST}.")
    slope, level = np.polyfit(time[i], np.log(np.abs(smooth[i])), 1)
    left = np.log(np.abs(smooth[i])) - level - slope * time[i]
    frequency = 1 / (2 * float(np.polyfit(np.arange(i.size), time[i], 1)[0]))
    decrement = -float(slope) / frequency
    zeta = decrement / np.hypot(2 * np.pi, decrement)
    return Decay(frequency, decrement, float(zeta), -float(slope), float(np.exp(level)), time[i], np.abs(smooth[i]),
                 float(left.std()))  # fmt: skip


def dominant_frequency(signal: np.ndarray, dt: float) -> float:
    """Frequency [Hz] of the largest line of a decaying signal, from zero-padded spectra.

    Examples
    --------
    >>> import rotorsim as rs
    >>> t = np.arange(0, 1, 2e-4)
    >>> float(round(rs.signals.dominant_frequency(np.sin(2 * np.pi * 50 * t), 2e-4)))
    50.0
    """
    padded = 8 * len(signal)
    size = np.abs(np.fft.rfft(signal - signal.mean(), padded))
    size[:8] = 0
    return float(np.fft.rfftfreq(padded, dt)[size.argmax()])


def _smooth(signal: np.ndarray, main: float, dt: float) -> np.ndarray:
    """Without what lies above twice the main frequency, not shifted in time."""
    if 2 * main >= 0.45 / dt:
        return signal
    return np.asarray(sosfiltfilt(butter(3, 2 * main, fs=1 / dt, output="sos"), signal))

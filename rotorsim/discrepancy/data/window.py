"""Window of a record that is compared: whole periods of its excitation, or whole revolutions where it has none."""

from __future__ import annotations

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.errors import DataError

SETTLING = 0.5
"""Beginning [s] of a record that is never compared: the twin starts at rest in equilibrium."""
SHORTEST_PERIOD = 0.2
"""Shortest period [s] of an excitation, and shortest window."""
TURNING = 1.0
"""Slowest speed [rad/s] that counts as turning."""


def find_window(rows: np.ndarray, speed: float, n: int, name: str, period: int | None) -> tuple[int, int, int]:
    """Start, length and number of the blocks that are compared."""
    least = int(SETTLING / RIG_SAMPLE)
    if period is not None and n >= least + period:
        blocks = (n - least) // period
        return n - blocks * period, period, blocks
    length = n - least
    if length < SHORTEST_PERIOD / RIG_SAMPLE:
        raise DataError(
            f"{name}: lasts {n * RIG_SAMPLE:.3g} s, a diagnosis needs at least {SETTLING + SHORTEST_PERIOD} s"
        )
    if rows[:, 4:6].any():
        first = int(np.argmax(rows[:, 4:6].any(axis=1)))
        least = min(least, max(first - 1, 0))
        length = n - least
    if abs(speed) > TURNING:
        turn = 2 * np.pi / abs(speed) / RIG_SAMPLE
        turns = int(length / turn)
        length = round(turns * turn) if turns else length
    # two halves where they hold whole turns too, so that the record shows its own scatter
    steady = not rows[:, 2:6].any()
    if steady and length >= 2 * SHORTEST_PERIOD / RIG_SAMPLE:
        half = length // 2
        if abs(speed) > TURNING:
            half = round(int(half / turn) * turn)
        return n - 2 * half, half, 2
    return n - length, length, 1


def find_period(signal: np.ndarray) -> int | None:
    """Period of a signal (n, 2) in samples, from the exact repetition of its end; None if there is none."""
    n = len(signal)
    tail = signal[n // 3 :]
    power = np.abs(np.fft.rfft(tail - tail.mean(axis=0), 2 * len(tail), axis=0)) ** 2
    overlap = np.arange(len(tail), 0, -1)
    correlation = np.fft.irfft(power.sum(axis=1))[: len(tail)] / overlap
    least = int(SHORTEST_PERIOD / RIG_SAMPLE)
    most = int(0.6 * len(tail))
    if most <= least or correlation[0] <= 0:
        return None
    peak = correlation[least:most].max()
    for lag in least + np.flatnonzero(correlation[least:most] > 0.98 * peak):
        moved = np.abs(tail[lag:] - tail[:-lag]).max()
        if moved < 1e-6 * np.abs(tail).max():
            return int(lag)
    return None


__all__ = ["TURNING", "find_period", "find_window"]

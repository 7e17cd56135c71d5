"""Samples of a live rig: inputs of the coming ones by drive and hammer, and the window over the last ones.

The drive holds a speed with limited acceleration; the hammer exerts half-sine forces on the disc with an exact
impulse.
"""

from __future__ import annotations

import numpy as np


def ramp(speed: float, target: float, acceleration: float, samples: int, Ts: float) -> np.ndarray:
    """Speeds [rad/s] at the ends of the next samples of Ts [s] on a ramp from `speed` to `target`."""
    reach = acceleration * Ts * np.arange(1, samples + 1)
    return speed + np.clip(target - speed, -reach, reach)


WIDTH = 5
"""Samples of a hit: 1 ms at 5 kHz."""


def hit(impulse: float, axis: int, Ts: float) -> np.ndarray:
    """Force (WIDTH, 2) [N] on the disc along x (0) or y (1) for an impulse [N s], in samples of Ts [s]."""
    edges = np.cos(np.pi * np.arange(WIDTH + 1) / WIDTH)
    force = np.zeros((WIDTH, 2))
    force[:, axis] = impulse * (edges[:-1] - edges[1:]) / 2 / Ts
    return force


class Hammer:
    """Pending and active hammer impacts."""

    def __init__(self, Ts: float) -> None:
        self._Ts = Ts
        self._waiting = np.zeros((0, 2))

    def strike(self, impulse: float, axis: int, wait: int = 0) -> None:
        """Add a hit that begins after `wait` more samples."""
        blow = np.vstack([np.zeros((wait, 2)), hit(impulse, axis, self._Ts)])
        both = np.zeros((max(len(blow), len(self._waiting)), 2))
        both[: len(self._waiting)] += self._waiting
        both[: len(blow)] += blow
        self._waiting = both

    def take(self, samples: int) -> np.ndarray:
        """Force (samples, 2) [N] of the coming samples."""
        force = np.zeros((samples, 2))
        now = self._waiting[:samples]
        force[: len(now)], self._waiting = now, self._waiting[samples:]
        return force


LENGTH = 10_000
"""Samples that are kept: 2 s."""


class History:
    """Sliding window of at least the last `length` rows."""

    def __init__(self, columns: int, length: int = LENGTH) -> None:
        self._rows = np.zeros((2 * length, columns))
        self._length, self._end = length, 0
        self.total = 0

    def add(self, rows: np.ndarray) -> None:
        """Append rows (n, columns); more than `length` at a time keep their end."""
        self.total += len(rows)
        rows = rows[-self._length :]
        if self._end + len(rows) > len(self._rows):
            kept = self._rows[max(self._end - self._length, 0) : self._end].copy()
            self._rows[: len(kept)], self._end = kept, len(kept)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def last(self, count: int) -> np.ndarray:
        """The last rows, at most `count` of them (and of `length`)."""
        return self._rows[max(self._end - min(count, self._length), 0) : self._end]

    def clear(self) -> None:
        """Forget everything."""
        self._end = self.total = 0

"""Hammer of the live rig: half-sine force on the disc with exact impulse."""

from __future__ import annotations

import numpy as np

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

"""Real-time pacing of a run; a run that falls behind the clock does not catch up."""

from __future__ import annotations

import time
from collections import deque

BLOCK = 50
"""Most samples at a time: 10 ms of a rig of 5 kHz."""
BEHIND = 0.05
"""Seconds of the plant that may wait before they are given up."""
SPAN = 0.5
"""Seconds over which the real-time factor is taken."""
REST = 0.01


class Pacer:
    """Number of samples due by the clock, and the real-time factor."""

    def __init__(self, Ts: float) -> None:
        self._Ts = Ts
        self._last, self._credit = time.monotonic(), 0.0
        self._marks: deque[tuple[float, int]] = deque([(self._last, 0)])

    def due(self, pace: float) -> int:
        """Samples to compute now for a pace (1 is real time, infinity as fast as possible); 0 after a short rest."""
        now = time.monotonic()
        passed, self._last = now - self._last, now
        if pace == float("inf"):
            self._credit = 0.0
            return BLOCK
        self._credit = min(self._credit + passed * pace, BEHIND)
        block = max(min(round(BLOCK * pace), BLOCK), 1)
        if pace > 0 and self._credit >= block * self._Ts:
            self._credit -= block * self._Ts
            return block
        time.sleep(min((block * self._Ts - self._credit) / pace, REST) if pace > 0 else REST)
        return 0

    def count(self, samples: int) -> None:
        """Note that samples were computed."""
        self._marks.append((time.monotonic(), self._marks[-1][1] + samples))
        while len(self._marks) > 2 and self._marks[-1][0] - self._marks[1][0] > SPAN:
            self._marks.popleft()

    @property
    def factor(self) -> float:
        """Seconds of the plant per second of the clock, lately."""
        (begin, before), (end, after) = self._marks[0], self._marks[-1]
        return (after - before) * self._Ts / (end - begin) if end > begin else 0.0

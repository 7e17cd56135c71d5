"""Clock of a live rig: samples due in real time, and computations in the background while it runs.

A run that falls behind the clock does not catch up; of each kind of computation only the newest request is answered.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

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


PAUSE = 0.1
"""Seconds between two answers, so that the plant keeps its processor."""


class Aside:
    """Runs the newest job of each kind, one at a time; `failed` receives kind and error of a failed job."""

    def __init__(self, failed: Callable[[str, Exception], None]) -> None:
        self._failed = failed
        self._change = threading.Condition()
        self._jobs: dict[str, Callable[[], None]] = {}
        self._over = False
        self._thread = threading.Thread(target=self._work, name="aside", daemon=True)
        self._thread.start()

    def ask(self, kind: str, job: Callable[[], None]) -> None:
        """Leave a job in place of one of the same kind that has not begun."""
        with self._change:
            self._jobs[kind] = job
            self._change.notify()

    def close(self) -> None:
        """End after the job under way, which is not waited for."""
        with self._change:
            self._over = True
            self._jobs.clear()
            self._change.notify()

    def _work(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._over or self._jobs)
                if self._over:
                    return
                kind = next(iter(self._jobs))
                job = self._jobs.pop(kind)
            try:
                job()
            except Exception as error:  # the thread must live on
                self._failed(kind, error)
            with self._change:
                self._change.wait_for(lambda: self._over, timeout=PAUSE)

"""Progress bar of a campaign: cases done, rate, time left."""

from __future__ import annotations

import time

from rotorsim.base.progress import BAR, Update

RECENT = 60.0
"""Time [s] over which the rate is averaged."""
COMPILING = "the first case compiles its machine, if it is new"
COLUMNS = (
    "{task.completed} of {task.total} cases",
    BAR,
    "{task.percentage:.0f} %",
    "{task.fields[rate]}",
    "{task.fields[left]}",
    "{task.fields[failed]}",
)
FIRST = {"rate": COMPILING, "left": "", "failed": ""}


class Rate:
    """Recent rate in cases per second, counted from the first finished case, before which kernels may compile."""

    def __init__(self) -> None:
        self._marks: list[tuple[float, int]] = []

    def note(self, done: int) -> None:
        """Count what is done by now."""
        now = time.monotonic()
        if done and (len(self._marks) < 2 or now - self._marks[-1][0] >= 0.5):
            self._marks.append((now, done))
        while len(self._marks) > 2 and now - self._marks[1][0] > RECENT:
            self._marks.pop(0)

    @property
    def value(self) -> float:
        """Cases per second."""
        if not self._marks:
            return 0.0
        (begin, first), (end, last) = self._marks[0], self._marks[-1]
        return (last - first) / max(end - begin, 1e-9) if last > first else 0.0


def spell(seconds: float) -> str:
    """Time in readable units."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, hours = seconds / 60, seconds / 3600
    return f"{minutes:.0f} min" if minutes < 100 else f"{hours:.1f} h"


def show(update: Update | None, done: int, rate: float, left: int, failed: int) -> None:
    """Show what is done on a bar of COLUMNS."""
    if update is not None:
        shown = f"{rate:.3g} cases/s" if rate >= 1 else f"{rate * 60:.3g} cases/min"
        update(
            completed=done,
            rate=shown if rate else "" if done else COMPILING,
            left=f"{spell(left / rate)} left" if rate else "",
            failed=f"{failed} failed" if failed else "",
        )

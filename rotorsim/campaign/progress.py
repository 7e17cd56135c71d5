"""Progress bar of a campaign on a terminal: cases done, rate, time left; nothing in a pipe."""

from __future__ import annotations

import sys
import time
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

RECENT = 60.0
"""Time [s] over which the rate is averaged."""
COMPILING = "the first case compiles its machine, if it is new"


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


def bar(show: bool, total: int, done: int) -> AbstractContextManager[Any]:
    """Progress bar (rich) with the fields `rate` and `left`, or none."""
    if not (show and sys.stderr.isatty()):
        return nullcontext(None)
    columns = (
        TextColumn("{task.completed} of {task.total} cases"),
        BarColumn(),
        TextColumn("{task.percentage:.0f} %"),
        TextColumn("{task.fields[rate]}"),
        TextColumn("{task.fields[left]}"),
        TextColumn("{task.fields[failed]}"),
    )
    progress = Progress(*columns, console=Console(stderr=True))
    progress.add_task("", total=total, completed=done, rate=COMPILING, left="", failed="")
    return progress


def update(progress: Any, done: int, rate: float, left: int, failed: int) -> None:
    """Update the progress bar."""
    if progress is not None:
        shown = f"{rate:.3g} cases/s" if rate >= 1 else f"{rate * 60:.3g} cases/min"
        progress.update(
            progress.task_ids[0],
            completed=done,
            rate=shown if rate else "" if done else COMPILING,
            left=f"{spell(left / rate)} left" if rate else "",
            failed=f"{failed} failed" if failed else "",
        )

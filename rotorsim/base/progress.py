"""Progress on a terminal: bars, counters, a run's simulated time; nothing in a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import count
from typing import Any, TypeVar

from rotorsim.base.display import direct, visible

Block = TypeVar("Block", bound=tuple)
Update = Callable[..., None]
Report = Callable[[str], None]
"""Function that takes the name of a step before it starts."""
BAR, LEFT = "bar", "time left"
"""Columns of a bar that are not text."""
RUN = (
    "{task.fields[simulated]:.1f} s simulated",
    BAR,
    "{task.percentage:.0f} %",
    "{task.fields[factor]:.0f} x real time",
    LEFT,
)
"""Columns of a run: simulated time, real-time factor, time left."""


def on_terminal() -> bool:
    """Whether standard error, where progress is shown, is a terminal."""
    return sys.stderr.isatty()


@contextmanager
def bar(columns: Sequence[str] = (), text: str = "", show: bool = True, **fields: Any) -> Iterator[Update | None]:
    """Progress bar of these columns, by default those of rich after a text; `fields` are their first values.

    Gives a function that updates fields, such as `completed` and `total`; None where nothing is shown.
    """
    if not (show and on_terminal()):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    drawn = {BAR: BarColumn, LEFT: TimeRemainingColumn}
    shown = [drawn[column]() if column in drawn else TextColumn(column) for column in columns]
    with Progress(*shown, console=Console(stderr=True)) as progress:
        yield partial(progress.update, progress.add_task(visible(text), **{"total": None} | fields))


def silent(text: str) -> None:
    """A `Report` that shows nothing."""


def line(text: str, last: bool = False) -> None:
    """Write over the line of progress; the `last` text stays."""
    if on_terminal():
        print(f"\r{visible(text)}\x1b[K", end="\n" if last else "", file=direct(sys.stderr), flush=True)


def end_line() -> None:
    """End the line of progress, so that it stays."""
    if on_terminal():
        print(file=sys.stderr)


def counter(total: int, things: str) -> Callable[..., None]:
    """A function that counts its calls: '3 of 12 records'."""
    numbers = count(1)

    def show(*_: Any) -> None:
        done = next(numbers)
        line(f"{done} of {total} {things}", done == total)

    return show


def track(blocks: Iterable[Block], samples: int, sample: float, show: bool) -> Iterator[Block]:
    """Pass blocks (table, ...) on; if `show`, count their samples of `sample` [s] on a progress bar."""
    with bar(RUN, show=show, total=samples, simulated=0.0, factor=0.0) as update:
        if update is None:
            yield from blocks
            return
        begin, done = time.perf_counter(), 0
        for block in blocks:
            done += len(block[0])
            elapsed = max(time.perf_counter() - begin, 1e-9)
            update(completed=done, simulated=done * sample, factor=done * sample / elapsed)
            yield block

"""Progress bar of a run on a terminal: simulated time, real-time factor, time left; nothing in a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

Block = TypeVar("Block", bound=tuple)


def track(blocks: Iterable[Block], samples: int, sample: float, show: bool) -> Iterator[Block]:
    """Pass blocks (table, ...) on; if `show`, count their samples of `sample` [s] on a terminal's progress bar."""
    if not (show and sys.stderr.isatty()):
        yield from blocks
        return
    columns = (
        TextColumn("{task.fields[simulated]:.1f} s simulated"),
        BarColumn(),
        TextColumn("{task.percentage:.0f} %"),
        TextColumn("{task.fields[factor]:.0f} x real time"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=samples, simulated=0.0, factor=0.0)
        begin, done = time.perf_counter(), 0
        for block in blocks:
            done += len(np.asarray(block[0]))
            elapsed = max(time.perf_counter() - begin, 1e-9)
            bar.update(task, completed=done, simulated=done * sample, factor=done * sample / elapsed)
            yield block

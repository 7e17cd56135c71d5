"""Parallel map over processes, results in the order of completion; serial for one process."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from typing import Any

from threadpoolctl import threadpool_limits

from rotorsim.base.processes import Processes

WORTH = 60
"""Points that make one more process worth its start."""


def useful(workers: int | None, points: int) -> int:
    """Processes for a number of points: all cores when None, but none that would not pay for its start."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(workers or cores, points // WORTH))


def spread(job: Callable[..., Any], jobs: Sequence[tuple], workers: int) -> Iterator[tuple[int, Any]]:
    """(number of the job, result) in the order of completion."""
    if workers <= 1:
        with threadpool_limits(1):  # the matrices are small: more threads only wait for each other
            for number, arguments in enumerate(jobs):
                yield number, job(*arguments)
        return
    with Processes(workers) as pool:
        waiting = {pool.submit(job, *arguments): number for number, arguments in enumerate(jobs)}
        while waiting:
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield waiting.pop(future), future.result()

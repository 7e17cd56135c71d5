"""Dispatch of cases to workers with a bounded number in flight, so memory does not grow with the plan.

A task is one case, or several short ones: a task costs Dask some milliseconds, whatever it does. Workers on this
computer are threads, each with a child process for its cases, and nothing listens on a port.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Protocol

from dask.system import CPU_COUNT

from rotorsim.campaign.cluster import Tls, cluster
from rotorsim.campaign.errors import ClusterError
from rotorsim.campaign.worker import end_run, run_orders

AHEAD = 8
"""Number of tasks that wait besides two for every worker."""
TASK = 0.4
"""Approximate time [s] of a task of several short cases."""
LARGEST = 64
"""Largest number of cases in a task."""
STEP = 2e-3
"""Time [s] between two cases of a task."""
TICK = 0.5
"""Longest wait [s] before signals are checked."""
LOOK = 2.0
"""Time [s] between two counts of the workers."""
ALONE = 600.0
"""Time [s] without any worker after which a campaign gives up."""


class Workers(Protocol):
    """Workers of this computer, or of a cluster; a task has `add_done_callback` of futures."""

    def admit(self, folder: Path, name: str) -> None:
        """Raise ClusterError for a worker of other versions, or one that sees no file `name` in the store."""

    def count(self) -> int:
        """Number of cases that can run at once now."""

    def check(self) -> None:
        """Raise ClusterError if they are gone."""

    def submit(self, key: str, orders: str) -> Any:
        """Task of orders, as JSON."""

    def answers(self, tasks: Sequence[Any]) -> list[str | None]:
        """Result rows of finished tasks as JSON; None for one that failed as a whole."""

    def why(self, task: Any) -> str:
        """Sentence about a task that failed as a whole; raises ClusterError where no other will do better."""

    def free(self, run: str) -> None:
        """End the cases of a run that are under way."""


def begun(scheduler: str | None, workers: int | None, most: int, tls: Tls | None) -> AbstractContextManager[Workers]:
    """Context of the workers of a scheduler, or of this computer (at most `most`) where none is named."""
    return local_workers(workers, most) if scheduler is None else cluster(scheduler, tls)


class Pump:
    """Cases in flight."""

    def __init__(self, workers: Workers, run: str) -> None:
        self._workers, self._run = workers, run
        self._under_way: dict[str, tuple[Any, list[dict[str, Any]]]] = {}
        self._given = 0
        self._mean = TASK
        self._finished: SimpleQueue[str] = SimpleQueue()
        self._seen = time.monotonic()
        self._counted, self._known = -LOOK, 0

    def __len__(self) -> int:
        return len(self._under_way)

    @property
    def room(self) -> int:
        """Number of tasks that should be submitted now."""
        return 2 * self._count() + AHEAD - len(self)

    def size(self, left: int) -> int:
        """Number of cases for the next task: fewer towards the end, for an even load."""
        return max(1, min(int(TASK / self._mean), LARGEST, left // (2 * (2 * self._known + AHEAD))))

    def _count(self) -> int:
        """Number of cases that the workers can run at once, counted now and then."""
        if time.monotonic() - self._counted > LOOK:
            self._counted, self._known = time.monotonic(), self._workers.count()
        return self._known

    def give(self, orders: list[dict[str, Any]]) -> None:
        """Give orders as one task."""
        self._given += 1
        key = f"{self._run}-{self._given}"
        task = self._workers.submit(key, json.dumps(orders))
        self._under_way[key] = task, orders
        task.add_done_callback(lambda _: self._finished.put(key))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Rows of what has finished since, after at most a tick."""
        keys = self._drain()
        self._check()
        done = [self._under_way.pop(key) for key in keys if key in self._under_way]
        answers = self._workers.answers([task for task, _ in done])
        for text in filter(None, answers):
            for row in json.loads(text):
                self._mean += 0.05 * (row.get("duration", TASK) + STEP - self._mean)
                yield row
        for (task, orders), answer in zip(done, answers, strict=True):
            if answer is None:
                yield from self._lost(task, orders)

    def _lost(self, task: Any, orders: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        """Rows of a task that failed as a whole; of several cases each is given once more, alone."""
        why = self._workers.why(task)
        for order in orders:
            if len(orders) > 1:
                self.give([order])
            else:
                yield {"number": order["number"], "status": "failed", "error": why}

    def _drain(self) -> list[str]:
        keys = []
        try:
            keys.append(self._finished.get(timeout=TICK))
            while True:
                keys.append(self._finished.get_nowait())
        except Empty:
            return keys

    def _check(self) -> None:
        """Raise ClusterError if the workers are gone, or there was none for long."""
        self._workers.check()
        if self._count():
            self._seen = time.monotonic()
        elif time.monotonic() - self._seen > ALONE:
            raise ClusterError(f"workers: none for {ALONE:g} s; start some and run the same command again")


class LocalWorkers:
    """Threads that run orders; a `Workers` of `rotorsim.campaign.scheduler`."""

    def __init__(self, threads: ThreadPoolExecutor, count: int) -> None:
        self._threads, self._count = threads, count

    def admit(self, folder: Path, name: str) -> None:
        """Accept all: each child process states its versions, and the folder is that of this computer."""

    def count(self) -> int:
        """Number of cases that can run at once."""
        return self._count

    def check(self) -> None:
        """Do nothing: they are there as long as this process."""

    def submit(self, key: str, orders: str) -> Future[str]:
        """Begin a task."""
        try:
            return self._threads.submit(run_orders, orders)
        except RuntimeError as error:  # no thread can be started
            raise _no_process(error) from error

    def answers(self, tasks: Sequence[Future[str]]) -> list[str | None]:
        """Result rows of finished tasks as JSON; None for one that failed as a whole."""
        return [None if task.exception() else task.result() for task in tasks]

    def why(self, task: Future[str]) -> str:
        """Sentence about a task that failed as a whole; raises ClusterError if its process cannot be started."""
        error = task.exception()
        if isinstance(error, OSError):
            raise _no_process(error) from error
        return f"worker: {type(error).__name__}: {(str(error).splitlines() or [''])[0][:150]}"

    def free(self, run: str) -> None:
        """End the child processes of a run."""
        end_run(run)


@contextmanager
def local_workers(workers: int | None, most: int) -> Iterator[LocalWorkers]:
    """Number of workers, by default one per core; not more than `most`."""
    count = max(min(CPU_COUNT if workers is None else workers, most), 1)
    threads = ThreadPoolExecutor(count, "rotorsim worker")
    try:
        yield LocalWorkers(threads, count)
    finally:
        threads.shutdown(cancel_futures=True)


def _no_process(error: Exception) -> ClusterError:
    reason = (str(error).splitlines() or ["no reason given"])[0][:150]
    return ClusterError(
        f"workers: cannot be started on this machine ({reason}); check free memory, processes and space for "
        "temporary files"
    )

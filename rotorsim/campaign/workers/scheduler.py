"""Dispatch of cases to workers with a bounded number in flight, so memory does not grow with the plan.

A task of Dask is one case, or several short ones: a task costs Dask some milliseconds, whatever it does.
"""

from __future__ import annotations

import json
import time
from asyncio import CancelledError
from collections.abc import Iterator
from concurrent.futures import CancelledError as Cancelled
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Any

from rotorsim.campaign.errors import ClusterError
from rotorsim.campaign.workers.cluster import threads
from rotorsim.campaign.workers.worker import run_orders

AHEAD = 8
"""Tasks that wait at the scheduler, besides two for every worker."""
TASK = 0.4
"""Time [s] of a task, about, whose cases are shorter."""
LARGEST = 64
"""Cases of a task, at most."""
STEP = 2e-3
"""Time [s] between two cases of a task."""
TICK = 0.5
"""Longest time [s] without a look at signals."""
LOOK = 2.0
"""Time [s] between two looks at how many workers there are."""
ALONE = 600.0
"""Time [s] without any worker after which a campaign gives up."""


LOST = "scheduler: the connection is lost; start it again and run the same command, what is done is kept"


@contextmanager
def connected() -> Iterator[None]:
    """Convert Dask's errors about a lost scheduler to ClusterError."""
    try:
        yield
    except (OSError, RuntimeError, TimeoutError, Cancelled, CancelledError) as error:
        raise ClusterError(LOST) from error


class Pump:
    """Cases in flight at one client."""

    def __init__(self, client: Any, run: str) -> None:
        self._client, self._run, self._function, self._threads = client, run, run_orders, threads
        self._under_way: dict[str, tuple[Any, list[dict[str, Any]]]] = {}
        self._given = 0
        self._mean = TASK
        self._finished: SimpleQueue[str] = SimpleQueue()
        self._seen = time.monotonic()
        self._counted, self._workers = -LOOK, 0

    def __len__(self) -> int:
        return len(self._under_way)

    @property
    def room(self) -> int:
        """How many more tasks should be given."""
        return 2 * self._count() + AHEAD - len(self)

    def size(self, left: int) -> int:
        """How many of the cases left should go into the next task: fewer towards the end, for an even load."""
        return max(1, min(int(TASK / self._mean), LARGEST, left // (2 * (2 * self._workers + AHEAD))))

    def _count(self) -> int:
        """How many cases the workers can run at once; asking costs some milliseconds, so it is done now and then."""
        if time.monotonic() - self._counted > LOOK:
            self._counted, self._workers = time.monotonic(), self._threads(self._client)
        return self._workers

    def give(self, orders: list[dict[str, Any]]) -> None:
        """Give orders as one task."""
        self._given += 1
        with connected():
            key = f"{self._run}-{self._given}"
            future = self._client.submit(self._function, json.dumps(orders), key=key, pure=False)
        self._under_way[future.key] = future, orders
        future.add_done_callback(lambda done: self._finished.put(done.key))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Rows of what has finished since, after at most a tick."""
        keys = self._drain()
        self._check()
        done = [self._under_way.pop(key) for key in keys if key in self._under_way]
        with connected():
            answers = self._client.gather([future for future, _ in done if future.status == "finished"])
        for answer in answers:
            for row in json.loads(answer):
                self._mean += 0.05 * (row.get("duration", TASK) + STEP - self._mean)
                yield row
        for future, orders in done:
            if future.status != "finished":
                yield from self._lost(future, orders)

    def _lost(self, future: Any, orders: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        """Rows of a task that Dask gave up; of several cases each is given once more, alone."""
        why = self._why(future)
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
        """Raise ClusterError if the scheduler is gone, or every worker for long."""
        if self._client.status != "running":
            raise ClusterError(LOST)
        if self._count():
            self._seen = time.monotonic()
        elif time.monotonic() - self._seen > ALONE:
            raise ClusterError(f"workers: none for {ALONE:g} s; start some and run the same command again")

    def _why(self, future: Any) -> str:
        """Sentence about an order that Dask gave up; a lost scheduler cancels all."""
        if future.status in ("cancelled", "lost"):
            raise ClusterError(LOST)
        error = future.exception()
        if type(error).__name__ == "KilledWorker":
            return "case: the worker died several times while it ran; give workers more memory"
        return f"worker: {type(error).__name__}: {(str(error).splitlines() or [''])[0][:150]}"

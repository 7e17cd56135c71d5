"""Cases to workers and rows back: a bounded number is under way at any time, so memory does not grow with the plan."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from queue import Empty, SimpleQueue
from typing import Any

from rotorsim.campaign.errors import ClusterError

AHEAD = 32
"""Cases that wait at the scheduler, beside two for every worker."""
TICK = 0.5
"""Longest time [s] without a look at signals and workers."""
ALONE = 600.0
"""Time [s] without any worker after which a campaign gives up."""


class Pump:
    """Orders under way at one client."""

    def __init__(self, client: Any, run: str) -> None:
        from rotorsim.campaign.cluster import threads
        from rotorsim.campaign.worker import run_order

        self._client, self._run, self._function, self._threads = client, run, run_order, threads
        self._under_way: dict[str, tuple[Any, int]] = {}
        self._finished: SimpleQueue[str] = SimpleQueue()
        self._seen = time.monotonic()
        self._counted, self._room = 0.0, 0

    def __len__(self) -> int:
        return len(self._under_way)

    @property
    def room(self) -> int:
        """How many more orders should be given."""
        if time.monotonic() - self._counted > TICK:
            self._counted, self._room = time.monotonic(), 2 * self._threads(self._client) + AHEAD
        return self._room - len(self)

    def give(self, number: int, order: dict[str, Any]) -> None:
        """Give an order."""
        future = self._client.submit(self._function, json.dumps(order), key=f"{self._run}-{number}", pure=False)
        self._under_way[future.key] = future, number
        future.add_done_callback(lambda done: self._finished.put(done.key))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Rows of what has finished since, after at most a tick."""
        keys = self._drain()
        self._check()
        done = [self._under_way.pop(key) for key in keys if key in self._under_way]
        whole = [(future, number) for future, number in done if future.status == "finished"]
        for told in self._client.gather([future for future, _ in whole]):
            yield json.loads(told)
        for future, number in done:
            if future.status != "finished":
                yield {"number": number, "status": "failed", "error": self._why(future)}

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
            raise ClusterError(
                "scheduler: the connection is lost; start it again and run the same command, what is done is kept"
            )
        if self._threads(self._client):
            self._seen = time.monotonic()
        elif time.monotonic() - self._seen > ALONE:
            raise ClusterError(f"workers: none for {ALONE:g} s; start some and run the same command again")

    def _why(self, future: Any) -> str:
        """Sentence about an order that Dask gave up; a lost scheduler cancels all."""
        if future.status in ("cancelled", "lost"):
            raise ClusterError("scheduler: the connection is lost; run the same command again, what is done is kept")
        error = future.exception()
        if type(error).__name__ == "KilledWorker":
            return "case: the worker died several times while it ran; give workers more memory"
        return f"worker: {type(error).__name__}: {(str(error).splitlines() or [''])[0][:150]}"

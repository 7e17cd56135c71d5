"""Background computations in a thread while the rig runs; only the newest request of each kind is computed."""

from __future__ import annotations

import threading
from collections.abc import Callable

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

"""Processes beside this one: each with one thread of linear algebra, deaf to Ctrl-C, ended at once where we are."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, resource_tracker
from types import TracebackType
from typing import Any


@contextmanager
def deaf_processes() -> Iterator[None]:
    """Processes started inside, or by threads that begin inside, do not hear the Ctrl-C of their terminal.

    What is blocked is inherited by threads and processes (POSIX); the signal itself waits for the end of the block.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # its start unblocks the signal in the thread that needs it first
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Processes(ProcessPoolExecutor):
    """A pool whose work under way ends with an exception in its `with` block, Ctrl-C too."""

    def __init__(self, workers: int) -> None:
        self._others = set(active_children())
        super().__init__(workers, get_context("spawn"), _one_thread)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Give work; a process is started here if none is free."""
        with deaf_processes():
            return super().submit(fn, *args, **kwargs)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        if kind is not None:
            self.shutdown(wait=False, cancel_futures=True)
            for child in set(active_children()) - self._others:
                child.terminate()
        return super().__exit__(kind, error, trace)


def _one_thread() -> None:
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)

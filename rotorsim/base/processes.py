"""Worker pool: one BLAS thread per process, SIGINT ignored, terminated at once by an exception or Ctrl-C.

No library's pool: after SIGKILL of the parent in a case of 20 s, both processes here end within 0.1 s; all four of loky
3.7 were alive after 25 s, those of Pebble 5.2 worked to the end of their case (20 s). Pebble alone loses only the case
whose process is killed; here the pool ends, and studies resume with what was kept.
"""

from __future__ import annotations

import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from multiprocessing import get_context, parent_process, resource_tracker
from types import TracebackType
from typing import Any

from threadpoolctl import ThreadpoolController, threadpool_limits

from rotorsim.base.errors import Unusual

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables of the environment that limit the threads of libraries loaded later."""


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """Processes started inside, or by threads that begin inside, do not receive the Ctrl-C of their terminal.

    The signal is blocked in this thread, which threads and processes inherit (POSIX); if no other thread receives
    it, it waits for the end of the block.
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
    """A pool whose work under way is ended, not waited for, by an exception in its `with` block, Ctrl-C too."""

    def __init__(self, workers: int) -> None:
        super().__init__(workers, get_context("spawn"), _begin)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Give work; a process is started here if none is free."""
        with sigint_blocked():
            return super().submit(fn, *args, **kwargs)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        if kind is None:
            return super().__exit__(kind, error, trace)
        own = list((self._processes or {}).values())
        self.shutdown(wait=False, cancel_futures=True)
        for process in own:
            process.terminate()
        return None


def _begin() -> None:
    """One thread of linear algebra; Ctrl-C is the parent's business, on systems without signal masks too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore", Unusual)  # the parent has asked
    os.environ.update(dict.fromkeys(THREADS, "1"))  # of scipy's library, which is not loaded yet
    threadpool_limits(1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A parent that was killed cannot end its processes, and they would wait for work for ever."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401 - brings its library, which must be loaded to be found

    return ThreadpoolController()


def one_thread() -> Any:
    """Context of one thread of linear algebra: for small matrices several only wait for each other."""
    return _libraries().limit(limits=1)

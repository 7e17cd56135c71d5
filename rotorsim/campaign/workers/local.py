"""Workers on this computer: threads, each with a child process for its cases.

They speak through pipes. Nothing listens on a port, which every user of the computer could reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from dask.system import CPU_COUNT

from rotorsim.campaign.errors import ClusterError
from rotorsim.campaign.workers.worker import end_run, run_orders


class LocalWorkers:
    """Threads that run orders; a `Workers` of `rotorsim.campaign.workers.scheduler`."""

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

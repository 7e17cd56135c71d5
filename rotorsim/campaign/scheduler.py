"""Dispatch of cases to workers with a bounded number in flight, so memory does not grow with the plan.

A task is one case, or several short ones: a task costs Dask some milliseconds, whatever it does. Workers on this
computer are threads, each with a child process for its cases, and nothing listens on a port; those of an existing Dask
cluster are reached by its scheduler's address.
"""

import gc
import json
import logging
import time
import warnings
from asyncio import CancelledError
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError as Cancelled, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Protocol

from dask.system import CPU_COUNT

from rotorsim.base.errors import RotorsimError
from rotorsim.base.processes import NoProcessError, spread
from rotorsim.campaign.store import mismatch, parts_folder, versions
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
CONNECT = 10.0
"""Longest wait [s] for a scheduler."""
JOIN = 120.0
"""Longest wait [s] for the first worker."""
LOST = "scheduler: the connection is lost; start it again and run the same command, what is done is kept"


class ClusterError(RotorsimError):
    """Raised for workers that cannot be reached, are lost or do not match."""


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
            raise ClusterError(
                f"workers: none for {ALONE:g} s; start some and run the same command again",
                argument="workers",
                value=ALONE,
            )


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
        if isinstance(error, (OSError, NoProcessError)):
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


@dataclass(frozen=True)
class Tls:
    """TLS certificate files (PEM) of the client; missing ones come from Dask's configuration."""

    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None


@contextmanager
def connected() -> Iterator[None]:
    """Convert Dask's errors about a lost scheduler to ClusterError."""
    try:
        yield
    except (OSError, RuntimeError, TimeoutError, Cancelled, CancelledError) as error:
        raise ClusterError(LOST) from error


class ClusterWorkers:
    """Workers behind a Dask client; a `Workers` of `rotorsim.campaign.scheduler`."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def admit(self, folder: Path, name: str) -> None:
        """Raise ClusterError unless every worker has the same versions and access to the store."""
        here = versions()
        for address, answer in self._ask(_about, str(folder), name):
            found = json.loads(answer)
            if wrong := mismatch(here, found["versions"]):
                raise ClusterError(
                    f"worker {address}: other versions ({wrong}); install the same on client and workers"
                )
            if not found["sees"]:
                raise ClusterError(
                    f"worker {address}: does not see {folder}; choose one on a file system that all workers share"
                )

    def _ask(self, function: Any, *arguments: Any) -> Iterator[tuple[str, Any]]:
        for address, answer in self._client.run(function, *arguments, on_error="return").items():
            if isinstance(answer, Exception):
                raise ClusterError(
                    f"worker {address}: cannot run rotorsim ({_reason(answer)}); install it there as it is here"
                ) from answer
            yield address, answer

    def count(self) -> int:
        """Number of cases that the workers can run at once now; asking costs some milliseconds."""
        return sum(worker["nthreads"] for worker in self._client.scheduler_info(n_workers=-1)["workers"].values())

    def check(self) -> None:
        """Raise ClusterError if the scheduler is gone."""
        if self._client.status != "running":
            raise ClusterError(LOST)

    def submit(self, key: str, orders: str) -> Any:
        """Begin a task; nothing but the name of a function is pickled."""
        with connected():
            return self._client.submit(run_orders, orders, key=key, pure=False)

    def answers(self, tasks: Sequence[Any]) -> list[str | None]:
        """Result rows of finished tasks as JSON; None for one that Dask gave up."""
        with connected():
            found = iter(self._client.gather([task for task in tasks if task.status == "finished"]))
        return [next(found) if task.status == "finished" else None for task in tasks]

    def why(self, task: Any) -> str:
        """Sentence about a task that Dask gave up; a lost scheduler cancels all."""
        if task.status in ("cancelled", "lost"):
            raise ClusterError(LOST)
        error = task.exception()
        if type(error).__name__ == "KilledWorker":
            return "case: the worker died several times while it ran; give workers more memory"
        return f"worker: {type(error).__name__}: {(str(error).splitlines() or [''])[0][:150]}"

    def spread(self, function: Callable[..., Any], calls: Sequence[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
        """(number, result) of calls of a module's function, in the order of completion.

        Raises ClusterError for workers of other versions or a lost scheduler.
        """
        from distributed import as_completed

        for address, found in self._ask(versions):
            if wrong := mismatch(versions(), found):
                raise ClusterError(f"worker {address}: other versions ({wrong}); install the same everywhere")
        with connected():
            numbers = {self._client.submit(function, *one, pure=False): k for k, one in enumerate(calls)}
        for future in as_completed(numbers, loop=self._client.loop):
            with connected():
                result = future.result()
            yield numbers[future], result

    def free(self, run: str) -> None:
        """End the cases of a run that workers still compute."""
        with suppress(Exception):
            self._client.run(end_run, run, wait=True, on_error="ignore")


def _about(folder: str, name: str) -> str:
    """Runs in a worker: its versions, and whether it sees the store and may write there."""
    place = parts_folder(Path(folder))
    sees = False
    with suppress(OSError):
        sees = (place / name).read_text() == name
    return json.dumps({"versions": versions(), "sees": sees})


@contextmanager
def cluster(address: str, tls: Tls | None) -> Iterator[ClusterWorkers]:
    """Workers of a running scheduler; raises ClusterError."""
    _silence()
    from distributed import Client

    gc.collect()  # a client of an earlier failure that Python drops while this one starts would wait for it for ever
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # versions are compared in `admit`, by what matters
        try:
            client = Client(address, timeout=CONNECT, security=_security(address, tls), set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise ClusterError(
                f"scheduler {address}: cannot be reached within {CONNECT:g} s ({_reason(error)}); check address, port, "
                "firewall and TLS files",
                argument="scheduler",
                value=address,
            ) from error
        try:
            _wait_for_workers(client, address)
            yield ClusterWorkers(client)
        finally:
            with suppress(Exception):
                client.close(timeout=CONNECT)


@contextmanager
def spread_on(address: str | None, tls: Tls | None, workers: int | None) -> Iterator[Callable[..., Any]]:
    """`rotorsim.base.processes.spread` on the workers of a scheduler, or on processes here, one for each core.

    Raises ClusterError where the scheduler cannot be reached.
    """
    if address is None:
        yield lambda function, calls: spread(function, calls, workers or CPU_COUNT)
        return
    with cluster(address, tls) as found:
        yield found.spread


def _silence() -> None:
    """Leave stderr to our own sentences; importing `distributed` gives some of its loggers levels of their own."""
    import distributed  # noqa: F401

    for name in ("distributed", *(name for name in logging.root.manager.loggerDict if name.startswith("distributed."))):
        logging.getLogger(name).setLevel(logging.CRITICAL)


def _security(address: str, tls: Tls | None) -> Any:
    from distributed import Security

    if tls is None:
        return Security()
    for path in (tls.ca, tls.cert, tls.key):
        if path is not None and not path.is_file():
            raise ClusterError(f"{path}: is not a file; give a PEM file for TLS")
    if not address.startswith("tls://"):
        raise ClusterError(
            f"scheduler {address}: is not a TLS address; write tls://host:port to use the TLS files",
            argument="scheduler",
            value=address,
        )
    given = {"tls_ca_file": tls.ca, "tls_client_cert": tls.cert, "tls_client_key": tls.key}
    return Security(require_encryption=True, **{name: str(path) for name, path in given.items() if path is not None})


def _reason(error: Exception) -> str:
    root: BaseException = error
    while root.__cause__ is not None:
        root = root.__cause__
    return (str(root).splitlines() or ["no answer"])[0][:150] or "no answer"


def _wait_for_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=JOIN)
    except TimeoutError as error:
        raise ClusterError(
            f"scheduler {address}: no worker joined it within {JOIN:g} s; start some with 'dask worker {address}'"
        ) from error

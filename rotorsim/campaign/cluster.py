"""Workers of an existing Dask cluster, reached by its scheduler's address."""

from __future__ import annotations

import json
import logging
import warnings
from asyncio import CancelledError
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError as Cancelled
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorsim.campaign.errors import ClusterError
from rotorsim.campaign.store import mismatch, parts_folder, versions
from rotorsim.campaign.worker import end_run, run_orders

CONNECT = 10.0
"""Longest wait [s] for a scheduler."""
JOIN = 120.0
"""Longest wait [s] for the first worker."""
LOST = "scheduler: the connection is lost; start it again and run the same command, what is done is kept"


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
                    f"worker {address}: does not see {folder}; put --out on a file system that all workers share"
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

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # versions are compared in `admit`, by what matters
        try:
            client = Client(address, timeout=CONNECT, security=_security(address, tls), set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise ClusterError(
                f"scheduler {address}: cannot be reached within {CONNECT:g} s ({_reason(error)}); check address, port, "
                "firewall and TLS files"
            ) from error
        try:
            _wait_for_workers(client, address)
            yield ClusterWorkers(client)
        finally:
            with suppress(Exception):
                client.close(timeout=CONNECT)


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
        raise ClusterError(f"scheduler {address}: is not a TLS address; write tls://host:port to use the TLS files")
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

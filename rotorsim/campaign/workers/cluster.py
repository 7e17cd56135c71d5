"""Dask workers: one process per core of this machine, or an existing cluster by its scheduler's address."""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rotorsim.base.processes import sigint_blocked
from rotorsim.campaign.errors import ClusterError
from rotorsim.campaign.store.store import parts_folder
from rotorsim.campaign.store.versions import mismatch, versions
from rotorsim.campaign.workers.worker import end_run

CONNECT = 10.0
"""Time [s] to wait for a scheduler."""
JOIN = 120.0
"""Time [s] to wait for the first worker."""
LOOPBACK = "127.0.0.1"
CALM = {
    "distributed.scheduler.worker-ttl": None,  # a wall clock that is set would make workers look dead
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "2 s",
    "distributed.admin.system-monitor.interval": "10 s",
}
"""Workers here do not watch themselves many times a second: that took some percent of the processors from the cases."""


@dataclass(frozen=True)
class Tls:
    """TLS certificate files (PEM) of the client; missing ones come from Dask's configuration."""

    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None


@contextmanager
def cluster(scheduler: str | None, workers: int | None, most: int, tls: Tls | None = None) -> Iterator[Any]:
    """Dask client of local workers (at most `most`, ended with it) or of a running scheduler."""
    _silence()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # versions are compared below, by what matters
        if scheduler is None:
            with _local(workers, most) as client:
                yield client
        else:
            with _remote(scheduler, tls) as client:
                yield client


def _silence() -> None:
    """Leave stderr to our own sentences; importing `distributed` gives some of its loggers levels of their own."""
    import distributed  # noqa: F401

    for name in ("distributed", *(name for name in logging.root.manager.loggerDict if name.startswith("distributed."))):
        logging.getLogger(name).setLevel(logging.CRITICAL)


@contextmanager
def _local(workers: int | None, most: int) -> Iterator[Any]:
    import dask
    from dask.system import CPU_COUNT
    from distributed import Client, LocalCluster

    count = max(min(CPU_COUNT if workers is None else workers, most), 1)
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(CALM))
        scratch = stack.enter_context(TemporaryDirectory(prefix="rotorsim-", ignore_cleanup_errors=True))
        try:
            with sigint_blocked():
                local = LocalCluster(
                    n_workers=count, threads_per_worker=1, processes=True, host=LOOPBACK, dashboard_address=None,
                    memory_limit=0, silence_logs=logging.CRITICAL, local_directory=scratch,
                )  # fmt: skip
            stack.enter_context(local)
            client = stack.enter_context(Client(local))
        except (OSError, RuntimeError) as error:
            raise ClusterError(
                f"workers: cannot be started on this machine ({_reason(error)}); check free memory, processes and "
                "space for temporary files; a script that runs a campaign does so under if __name__ == '__main__'"
            ) from error
        yield client


@contextmanager
def _remote(address: str, tls: Tls | None) -> Iterator[Any]:
    from distributed import Client

    try:
        client = Client(address, timeout=CONNECT, security=_security(address, tls), set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise ClusterError(
            f"scheduler {address}: cannot be reached within {CONNECT:g} s ({_reason(error)}); check address, port, "
            "firewall and TLS files"
        ) from error
    try:
        _wait_for_workers(client, address)
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=CONNECT)


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


def threads(client: Any) -> int:
    """Number of cases that the workers can run at once now."""
    return sum(worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values())


def check_workers(client: Any, folder: Path, name: str) -> None:
    """Raise ClusterError unless every worker has the same versions and access to the store."""
    here = versions()
    for address, answer in _ask(client, _about, str(folder), name):
        found = json.loads(answer)
        if wrong := mismatch(here, found["versions"]):
            raise ClusterError(f"worker {address}: other versions ({wrong}); install the same on client and workers")
        if not found["sees"]:
            raise ClusterError(
                f"worker {address}: does not see {folder}; put --out on a file system that all workers share"
            )


def _ask(client: Any, function: Any, *arguments: Any) -> Iterator[tuple[str, Any]]:
    for address, answer in client.run(function, *arguments, on_error="return").items():
        if isinstance(answer, Exception):
            raise ClusterError(
                f"worker {address}: cannot run rotorsim ({_reason(answer)}); install it there as it is here"
            ) from answer
        yield address, answer


def _about(folder: str, name: str) -> str:
    """Runs in a worker: its versions, and whether it sees the store and may write there."""
    place = parts_folder(Path(folder))
    sees = False
    with suppress(OSError):
        sees = (place / name).read_text() == name
    return json.dumps({"versions": versions(), "sees": sees})


def free_workers(client: Any, run: str) -> None:
    """End the cases of a run that workers still compute."""
    with suppress(Exception):
        client.run(end_run, run, wait=True, on_error="ignore")

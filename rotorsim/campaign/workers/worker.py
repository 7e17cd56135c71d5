"""Code in a worker, of Dask or a thread here: starts a child process for cases, supervises it, returns the results.

No library's pool: Pebble 5.2 has the time limit and keeps the other cases when a process is killed, but its processes
outlive a killed worker until their case ends (20 s of 20 s; loky 3.7 more than 25 s). This one ends with its pipe.

Orders and answers are text.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from rotorsim.base.cache import ROOT
from rotorsim.base.processes import THREADS
from rotorsim.campaign.store.store import clear_parts_of

PREPARE_LIMIT = 3600.0
"""Longest time [s] until a case's machine code is there: others may be compiling before."""
ATTEMPTS = 2
"""A case whose process dies is tried again, once: the system may have taken it for another's memory."""
ROOM = 1_000_000
"""Free space [byte] below which a process that died is taken for the victim of a full disk."""
ENDING = ("storage", "versions")
"""Errors that stop the whole campaign."""
_own = threading.local()
_cells: set[Cell]
_over: set[str] = set()


class CellDiedError(Exception):
    """Child process that ended unexpectedly; the text gives the cause."""


class Cell:
    """Child process that runs cases."""

    def __init__(self, run: str) -> None:
        paths = filter(None, (str(ROOT), os.environ.get("PYTHONPATH")))
        environment = os.environ | dict.fromkeys(THREADS, "1") | {"PYTHONPATH": os.pathsep.join(paths)}
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "rotorsim.campaign.workers.case_process"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=self._stderr, env=environment, text=True, bufsize=1, start_new_session=True,
        )  # fmt: skip
        self.run = run
        self._answers: SimpleQueue[str] = SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        _cells.add(self)
        if run in _over:  # it ended while the process began
            self.process.kill()
        try:
            self.versions: dict[str, str] = self.answer(PREPARE_LIMIT)["versions"]
        except CellDiedError:
            self.kill()
            raise

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._answers.put(line)
        self._answers.put("")

    def send(self, order: str) -> None:
        """Give an order."""
        assert self.process.stdin is not None
        with suppress(OSError):
            self.process.stdin.write(order + "\n")
            self.process.stdin.flush()

    def answer(self, limit: float) -> Any:
        """The next answer; raises TimeoutError or CellDiedError."""
        try:
            line = self._answers.get(timeout=limit)
        except Empty as error:
            raise TimeoutError from error
        if not line.endswith("\n"):
            raise CellDiedError(self._how())
        return json.loads(line)

    def _how(self) -> str:
        self.process.wait()
        code = self.process.returncode
        self._stderr.seek(max(self._stderr.seek(0, os.SEEK_END) - 2000, 0))
        last = (self._stderr.read().decode(errors="replace").strip().splitlines() or [""])[-1][:200]
        if code < 0:
            with suppress(ValueError):
                return f"was ended by {signal.Signals(-code).name}"
        return f"ended with code {code}" + (f" ({last})" if last else "")

    def kill(self) -> None:
        """End the process now."""
        self.process.kill()
        self.process.wait()
        _cells.discard(self)


_cells = set()


def own_cell(run: str) -> Cell:
    """Child process of this thread, now for a run; started if there is none."""
    cell: Cell | None = getattr(_own, "cell", None)
    if cell is None or cell.process.poll() is not None:
        if cell is not None:
            cell.kill()
        _own.cell = cell = Cell(run)
    cell.run = run
    return cell


def end_run(run: str) -> None:
    """End the child processes of a run and start no more of its cases; other campaigns are unaffected."""
    _over.add(run)
    for cell in list(_cells):
        if cell.run == run:
            cell.kill()


def run_orders(orders: str) -> str:
    """Run cases of one run and return their result rows; both as JSON."""
    rows: list[dict[str, Any]] = []
    for order in json.loads(orders):
        if order["run"] in _over:
            break
        rows.append(_row(order) | {"number": order["number"], "host": socket.gethostname()})
        if rows[-1]["status"] in ENDING:
            break
    return json.dumps(rows)


def _row(order: dict[str, Any]) -> dict[str, Any]:
    for _ in range(ATTEMPTS):
        row = _try(order)
        if row["status"] != "died" or order["run"] in _over:
            break
    return row | {"status": "failed"} if row["status"] == "died" else row


def _try(order: dict[str, Any]) -> dict[str, Any]:
    try:
        cell = own_cell(order["run"])
        if order["run"] in _over:  # asked after it is known whose process this is, for then it can be ended
            cell.kill()
        if cell.versions != order["versions"]:
            return {"status": "versions", "error": "", "versions": cell.versions}
        cell.send(json.dumps(order))
        row: dict[str, Any] = cell.answer(PREPARE_LIMIT)
        if row.get("ready"):
            row = cell.answer(order["time_limit"])
        return row
    except TimeoutError:
        _end(order)
        limit = order["time_limit"]
        return {
            "status": "failed",
            "duration": limit,
            "error": f"case: took longer than the time limit of {limit:g} s; raise time_limit or make it shorter",
        }
    except CellDiedError as error:
        _end(order)
        if _full(order["folder"]):
            return {
                "status": "storage",
                "error": f"{order['folder']}: no space left; free some and run the same command",
            }
        return {
            "status": "died",
            "error": f"case: its process {error}, {ATTEMPTS} times; it may need more memory than there is",
        }


def _end(order: dict[str, Any]) -> None:
    """End this thread's process, and remove what it was writing."""
    cell: Cell | None = getattr(_own, "cell", None)
    if cell is not None:
        cell.kill()
        clear_parts_of(Path(order["folder"]), cell.process.pid)


def _full(folder: str) -> bool:
    with suppress(OSError):
        return shutil.disk_usage(folder).free < ROOM
    return False

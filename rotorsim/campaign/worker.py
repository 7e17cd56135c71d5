"""Cases of a campaign in a worker, of Dask or a thread here, each in a child process with a time limit.

Orders and rows of results are JSON. The child prepares and solves a case; whatever fails becomes a row.
"""

import faulthandler
import json
import shutil
import socket
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rotorsim.base.errors import RotorsimError
from rotorsim.base.files import WriteError
from rotorsim.base.processes import Child, ProcessDiedError
from rotorsim.campaign.plan import Case
from rotorsim.campaign.store import StorageError, clear_parts_of, machines, versions

GRACE = 60.0
"""Time [s] after its limit at which a case ends its process by itself, should nobody else do it."""
_machines: dict[tuple[Path, str], str] = {}


def prepare(order: dict[str, Any]) -> dict[str, Any]:
    """Load the machine code of a case, before its time limit counts; empty, or the row of a case that failed."""
    return _tried(lambda physics, case, text: physics[0](case, text) or {}, order)


def solve(order: dict[str, Any]) -> dict[str, Any]:
    """Result row of a case: status 'done', 'failed', or 'storage' if the store cannot be written."""
    folder = Path(order["folder"])
    begin, worked = time.perf_counter(), time.process_time()
    faulthandler.dump_traceback_later(order["time_limit"] + GRACE, exit=True)
    try:
        row = _tried(
            lambda physics, case, text: {"status": "done"} | physics[1](folder, case, text, order["summary"]), order
        )
    finally:
        faulthandler.cancel_dump_traceback_later()
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    spent = {"duration": time.perf_counter() - begin, "cpu": time.process_time() - worked}
    return row | spent | {"finished": finished}


def _tried(act: Callable[[Any, Case, str], dict[str, Any]], order: dict[str, Any]) -> dict[str, Any]:
    """Row that `act` makes of the physics, the case and its machine's text, or one with the reason of a failure."""
    from rotorsim.campaign.simulate_case import PHYSICS  # loads plant and experiments, in a child process alone

    case = Case.from_text(order["case"])
    try:
        return act(PHYSICS[order["physics"]], case, machine_text(Path(order["folder"]), case.machine))
    except (StorageError, WriteError) as error:
        return {"status": "storage", "error": str(error)}
    except RotorsimError as error:
        return {"status": "failed", "error": str(error).splitlines()[0]}
    except MemoryError:
        return {"status": "failed", "error": "case: needs more memory than there is; make it shorter or keep less"}
    except Exception as error:
        return {"status": "failed", "error": _unexpected(error), "trace": traceback.format_exc()}


def _unexpected(error: Exception) -> str:
    first_line = (str(error).splitlines() or [""])[0][:200]
    return f"{type(error).__name__}: {first_line}; this is a fault of the program, campaign.log has the details"


def machine_text(folder: Path, known: str) -> str:
    """Text of a store's machine by its hash."""
    if (folder, known) not in _machines:
        _machines.update({(folder, name): text for name, text in machines(folder).items()})
    return _machines[folder, known]


PREPARE_LIMIT = 3600.0
"""Longest time [s] until a case's machine code is there: others may be compiling before."""
ATTEMPTS = 2
"""A case whose process dies is tried again, once: the system may have taken it for another's memory."""
ROOM = 1_000_000
"""Free space [byte] below which a process that died is taken for the victim of a full disk."""
ENDING = ("storage", "versions")
"""Errors that stop the whole campaign."""
_thread = threading.local()
_runs: dict[Child, str] = {}
_ended_runs: set[str] = set()


def child_of(run: str) -> tuple[Child, dict[str, str]]:
    """Child process of this thread, now for a run, and its versions; started if there is none."""
    child: Child | None = getattr(_thread, "child", None)
    if child is None or not child.alive:
        if child is not None:
            _end(child)
        _thread.child = child = Child()
        _runs[child] = run
        if run in _ended_runs:  # it ended while the process began
            child.kill()
        _thread.versions = child.call(versions, limit=PREPARE_LIMIT)
    _runs[child] = run
    if run in _ended_runs:  # asked after it is known whose process this is, for then it can be ended
        _end(child)
    return child, _thread.versions


def _end(child: Child) -> None:
    child.kill()
    _runs.pop(child, None)


def end_run(run: str) -> None:
    """End the child processes of a run and start no more of its cases; other campaigns are unaffected."""
    _ended_runs.add(run)
    for child in [child for child, own in list(_runs.items()) if own == run]:
        child.process.kill()
        child.process.wait()


def run_orders(orders: str) -> str:
    """Run cases of one run and return their result rows; both as JSON."""
    rows: list[dict[str, Any]] = []
    for order in json.loads(orders):
        if order["run"] in _ended_runs:
            break
        rows.append(_row(order) | {"number": order["number"], "host": socket.gethostname()})
        if rows[-1]["status"] in ENDING:
            break
    return json.dumps(rows)


def _row(order: dict[str, Any]) -> dict[str, Any]:
    for _ in range(ATTEMPTS):
        row = _attempt(order)
        if row["status"] != "died" or order["run"] in _ended_runs:
            break
    return row | {"status": "failed"} if row["status"] == "died" else row


def _attempt(order: dict[str, Any]) -> dict[str, Any]:
    limit, folder = order["time_limit"], order["folder"]
    try:
        child, there = child_of(order["run"])
        if there != order["versions"]:
            return {"status": "versions", "error": "", "versions": there}
        row: dict[str, Any] = child.call(prepare, order, limit=PREPARE_LIMIT)
        return row or child.call(solve, order, limit=limit)
    except TimeoutError:
        _clear(folder)
        sentence = f"case: took longer than the time limit of {limit:g} s; raise time_limit or make it shorter"
        return {"status": "failed", "duration": limit, "error": sentence}
    except ProcessDiedError as error:
        _clear(folder)
        if _is_full(folder):
            return {"status": "storage", "error": f"{folder}: no space left; free some and run the same command"}
        sentence = f"case: its process {error}, {ATTEMPTS} times; it may need more memory than there is"
        return {"status": "died", "error": sentence}


def _clear(folder: str) -> None:
    """Remove what this thread's process, which has ended, was writing."""
    child: Child | None = getattr(_thread, "child", None)
    if child is not None:
        clear_parts_of(Path(folder), child.process.pid)


def _is_full(folder: str) -> bool:
    with suppress(OSError):
        return shutil.disk_usage(folder).free < ROOM
    return False

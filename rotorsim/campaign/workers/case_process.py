"""Preparation and solution of one case, as a child process of a worker does them: a row of results, never an error."""

from __future__ import annotations

import faulthandler
import time
import traceback
from collections.abc import Callable
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any

from rotorsim.base.errors import RotorsimError
from rotorsim.base.files import WriteError
from rotorsim.campaign.errors import StorageError
from rotorsim.campaign.plan.case import Case
from rotorsim.campaign.store.store import machines

PHYSICS = {"rotorsim": "rotorsim.campaign.workers.run_case", "stub": "rotorsim.campaign.workers.stub"}
"""Modules that prepare and solve cases, by the name that `Settings.physics` gives."""
GRACE = 60.0
"""Time [s] after its limit at which a case ends its process by itself, should nobody else do it."""
_machines: dict[tuple[Path, str], str] = {}


def prepare(order: dict[str, Any]) -> dict[str, Any]:
    """Load the machine code of a case, before its time limit counts; empty, or the row of a case that failed."""
    return _tried(lambda physics, case, text: physics.prepare(case, text) or {}, order)


def solve(order: dict[str, Any]) -> dict[str, Any]:
    """Result row of a case: status 'done', 'failed', or 'storage' if the store cannot be written."""
    folder = Path(order["folder"])
    begin, worked = time.perf_counter(), time.process_time()
    faulthandler.dump_traceback_later(order["time_limit"] + GRACE, exit=True)
    try:
        row = _tried(
            lambda physics, case, text: {"status": "done"} | physics.solve(folder, case, text, order["summary"]), order
        )
    finally:
        faulthandler.cancel_dump_traceback_later()
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    spent = {"duration": time.perf_counter() - begin, "cpu": time.process_time() - worked}
    return row | spent | {"finished": finished}


def _tried(act: Callable[[Any, Case, str], dict[str, Any]], order: dict[str, Any]) -> dict[str, Any]:
    """What `act` makes of the physics, the case and its machine's text, or a row with the reason why it failed."""
    case = Case.from_text(order["case"])
    try:
        return act(import_module(PHYSICS[order["physics"]]), case, machine_text(Path(order["folder"]), case.machine))
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

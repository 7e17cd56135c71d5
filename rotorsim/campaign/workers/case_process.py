"""Child process that runs cases one after the other, isolated from the worker against hangs and crashes.

Orders come as lines of JSON on stdin, answers leave as lines of JSON on stdout. For a case it first sends "ready", when
the machine code is there and the time limit starts to count, then what came out. The process ends with its stdin.
"""

from __future__ import annotations

import faulthandler
import json
import os
import sys
import threading
import time
import traceback
import warnings
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from rotorsim.base.errors import Unusual

PHYSICS = {"rotorsim": "rotorsim.campaign.workers.run_case", "stub": "rotorsim.campaign.workers.stub"}
GRACE = 60.0
"""Time [s] after its limit at which a case ends its process by itself, should nobody else do it."""


def main() -> None:
    """Process requests until stdin ends."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what libraries print must not be taken for an answer
    warnings.simplefilter("ignore", Unusual)  # who began the campaign was asked
    orders: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_listen, args=(orders,), daemon=True).start()
    from rotorsim.campaign.store.versions import versions

    send(answers, {"versions": versions()})
    while True:
        order = json.loads(orders.get())
        send(answers, run(order, answers))


def send(answers: Any, result: dict[str, Any]) -> None:
    """Write one line of JSON."""
    answers.write(json.dumps(result) + "\n")


def _listen(orders: SimpleQueue[str]) -> None:
    for line in sys.stdin:
        orders.put(line)
    os._exit(0)


def run(order: dict[str, Any], answers: Any) -> dict[str, Any]:
    """Result row of a case: status 'done', 'failed', or 'storage' if the store cannot be written."""
    from rotorsim.base.errors import RotorsimError
    from rotorsim.base.files import WriteError
    from rotorsim.campaign.plan.case import Case
    from rotorsim.campaign.workers.run_case import StorageError

    physics = import_module(PHYSICS[order["physics"]])
    folder, case = Path(order["folder"]), Case.from_text(order["case"])
    begin, worked = time.perf_counter(), time.process_time()
    try:
        text = machine_text(folder, case.machine)
        physics.prepare(case, text)
        send(answers, {"ready": True})
        begin, worked = time.perf_counter(), time.process_time()
        faulthandler.dump_traceback_later(order["time_limit"] + GRACE, exit=True)
        result = {"status": "done"} | physics.solve(folder, case, text, order["summary"])
    except (StorageError, WriteError) as error:
        result = {"status": "storage", "error": str(error)}
    except RotorsimError as error:
        result = {"status": "failed", "error": str(error).splitlines()[0]}
    except MemoryError:
        result = {"status": "failed", "error": "case: needs more memory than there is; make it shorter or keep less"}
    except Exception as error:
        result = {"status": "failed", "error": _unexpected(error), "trace": traceback.format_exc()}
    finally:
        faulthandler.cancel_dump_traceback_later()
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    spent = {"duration": time.perf_counter() - begin, "cpu": time.process_time() - worked}
    return result | spent | {"finished": finished}


def _unexpected(error: Exception) -> str:
    first_line = (str(error).splitlines() or [""])[0][:200]
    return f"{type(error).__name__}: {first_line}; this is a fault of the program, campaign.log has the details"


_machines: dict[tuple[Path, str], str] = {}


def machine_text(folder: Path, known: str) -> str:
    """Text of a store's machine by its hash."""
    from rotorsim.campaign.store.store import machines

    if (folder, known) not in _machines:
        _machines.update({(folder, name): text for name, text in machines(folder).items()})
    return _machines[folder, known]


if __name__ == "__main__":
    main()

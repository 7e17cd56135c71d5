"""Files of a diagnosis: verdict, gap, new machine file, difference, report and the whole of it in one folder."""

from __future__ import annotations

import json
from pathlib import Path

from rotorsim.base.errors import DataError
from rotorsim.base.files import replacing_all, write_bytes, write_text
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.discrepancy.outcome.machine_file import difference
from rotorsim.discrepancy.outcome.result import Diagnosis
from rotorsim.discrepancy.outcome.stored import AGAIN, from_bytes, to_bytes
from rotorsim.discrepancy.outcome.stored_plan import StoredPlan
from rotorsim.discrepancy.plan.plan import Plan
from rotorsim.machine import Machine, load_machine, shipped_machines

RESULTS = {
    "gap": "gap.nc",
    "machine": "machine.toml",
    "difference": "machine.diff",
    "plan": "next.toml",
    "believed": "believed.toml",
    "report": "report.html",
    "data": "report_data.npz",
    "verdict": "diagnosis.json",
}
"""Files in the folder; where the verdict is, the others are complete."""


def save_diagnosis(diagnosis: Diagnosis, folder: str | Path, report: bool = True) -> dict[str, str]:
    """Write all files of a diagnosis, in place of an older one's, or nothing; returns their paths by kind.

    Parameters
    ----------
    diagnosis : Diagnosis
    folder : path
        Is made; raises WriteError where it cannot be written.
    report : bool
        Whether to write the HTML report.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.diagnose("dtu_gas_bearing", "puzzle/records")  # doctest: +SKIP
    >>> rs.discrepancy.save_diagnosis(found, "diagnosis")["report"]  # doctest: +SKIP
    'diagnosis/report.html'
    """
    out = Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    with replacing_all(out, tuple(RESULTS.values())) as part:
        write_netcdf(part / RESULTS["gap"], diagnosis.gap)
        if diagnosis.status != "unknown":
            after = diagnosis.apply()
            after.save(part / RESULTS["machine"])
            write_text(part / RESULTS["difference"], difference(diagnosis.machine, after) + "\n")
        planned = ""
        if diagnosis.planned is not None and diagnosis.planned.as_dict()["proposals"]:
            planned = write_plan(part, diagnosis.planned, diagnosis.machine)
        if report:
            diagnosis.report(part / RESULTS["report"])
        verdict = json.dumps(diagnosis.as_dict(), indent=2, default=float) + "\n"
        write_bytes(part / RESULTS["data"], to_bytes(diagnosis, verdict, planned))
        write_text(part / RESULTS["verdict"], verdict)
        written = {kind: name for kind, name in RESULTS.items() if (part / name).exists()}
    return {kind: str(out / name) for kind, name in written.items()}


def write_plan(folder: Path, plan: Plan | StoredPlan, machine: Machine) -> str:
    """Write the plan of the next experiment and return its text.

    It names the new machine file where there is one, else the machine as it is believed to be: a shipped one by its
    name, another one by a copy next to the plan.
    """
    name = RESULTS["machine"]
    if not (folder / name).exists():
        shipped = machine.name in shipped_machines() and machine == load_machine(machine.name)
        name = machine.name if shipped else RESULTS["believed"]
        if not shipped:
            machine.save(folder / name)
    text = plan.campaign(machine, name)
    write_text(folder / RESULTS["plan"], text)
    return text


def load_diagnosis(folder: str | Path) -> Diagnosis:
    """The diagnosis that `save_diagnosis` or `rotorsim diagnose` wrote into a folder; its report can be written again.

    Nothing is computed, and nothing in the files is executed. Of its plan it has the numbers and texts. Raises
    DataError for a folder without a verdict and for files that are damaged, changed or of another version.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.discrepancy.load_diagnosis("diagnosis")  # doctest: +SKIP
    >>> found.report("again.html")  # doctest: +SKIP
    """
    folder = Path(folder)
    verdict, data = folder / RESULTS["verdict"], folder / RESULTS["data"]
    if not folder.is_dir():
        raise DataError(f"{folder}: is not a folder; give the one that 'rotorsim diagnose' wrote")
    if not verdict.is_file():
        raise DataError(f"{folder}: has no {verdict.name}, so no verdict; give a folder that 'rotorsim diagnose' wrote")
    if not data.is_file():
        raise DataError(f"{folder}: has no {data.name}, from which the report is made; {AGAIN}")
    try:
        return from_bytes(data.read_bytes(), verdict.read_text(encoding="utf-8-sig", errors="replace"))
    except OSError as error:
        raise DataError(f"{error.filename}: cannot be read: {error.strerror}") from error
    except DataError as error:
        raise DataError(f"{data}: {error}") from error

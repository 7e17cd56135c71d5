"""Files of a diagnosis: verdict, gap, new machine file, difference and report in one folder."""

from __future__ import annotations

from pathlib import Path

from rotorsim.base.file_set import replacing_all
from rotorsim.base.files import write_json, write_text
from rotorsim.base.netcdf import write_netcdf
from rotorsim.discrepancy.outcome.machine_file import difference
from rotorsim.discrepancy.outcome.result import Diagnosis

RESULTS = {
    "gap": "gap.nc",
    "machine": "machine.toml",
    "difference": "machine.diff",
    "plan": "next.toml",
    "report": "report.html",
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
        if diagnosis.plan is not None and diagnosis.plan.proposals:
            known = RESULTS["machine"] if (part / RESULTS["machine"]).exists() else diagnosis.machine.name
            write_text(part / RESULTS["plan"], diagnosis.plan.campaign(known))
        if report:
            diagnosis.report(part / RESULTS["report"])
        write_json(part / RESULTS["verdict"], diagnosis.as_dict(), indent=2, default=float)
        written = {kind: name for kind, name in RESULTS.items() if (part / name).exists()}
    return {kind: str(out / name) for kind, name in written.items()}

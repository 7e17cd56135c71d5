"""Files of a diagnosis: verdict, gap, new machine file, difference, report and the whole of it in one folder.

The whole diagnosis is an npz file of numbers, texts and arrays, nothing of which is executed when it is read. It has
the arrays, as `content` a JSON text and as `seal` the digest of both. The text holds the version of the format, a
digest of the verdict's file that it was written with, the machine file, the gap and every field.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_type_hints

import numpy as np
import xarray as xr

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.files import replacing_all, write_bytes, write_text
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.input_files import ArchiveError, parse_json, read_archive
from rotorsim.base.plain_data import from_plain, to_plain
from rotorsim.discrepancy.machine_file import difference
from rotorsim.discrepancy.result import LAW_FILE, Diagnosis
from rotorsim.machine import Machine, load_machine, shipped_machines

if TYPE_CHECKING:
    from rotorsim.discrepancy.ranking import ExperimentPlan

RESULTS = {
    "gap": "gap.nc",
    "machine": "machine.toml",
    "difference": "machine.diff",
    "law": LAW_FILE,
    "plan": "next.toml",
    "believed": "believed.toml",
    "report": "report.html",
    "data": "report_data.npz",
    "verdict": "diagnosis.json",
}
"""Files in the folder; where the verdict is, the others are complete."""
VERSION = 2
"""Version of the format."""
KIND = "stored diagnosis"
"""Kind of file, as its content states it."""
OWN = ("machine", "gap", "planned", "planner")
"""Fields with a form of their own."""
LARGEST = 1_000_000_000
"""Bytes that a stored diagnosis may take, packed or unpacked."""
AGAIN = "run 'rotorsim diagnose' again"
"""Way out where files are damaged, changed or of another version."""


@dataclass(frozen=True)
class StoredPlan:
    """Plan that was read from a file, with the numbers and texts that pages and files show."""

    content: dict[str, Any]
    toml: str = ""

    @property
    def sentence(self) -> str:
        """Sentence on the next experiment."""
        return str(self.content.get("sentence", ""))

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        return dict(self.content)

    def campaign(self, *_: Any) -> str:
        """The best experiment as the plan of a campaign, of the machine that it was written for."""
        return self.toml


def to_bytes(diagnosis: Diagnosis, verdict: str, toml: str = "") -> bytes:
    """The npz file of a diagnosis; `verdict` is the JSON text next to it, `toml` the plan of the next experiment."""
    arrays: dict[str, np.ndarray] = {}
    machine, plan = diagnosis.machine, diagnosis.planned
    content = {
        "kind": KIND,
        "version": VERSION,
        "verdict": digest(verdict),
        "machine": machine._source or machine.text,
        "gap": _gap_to_plain(diagnosis.gap, arrays),
        "plan": None if plan is None else to_plain({"content": plan.as_dict(), "toml": toml}, arrays),
        "fields": {
            f.name: to_plain(getattr(diagnosis, f.name), arrays) for f in fields(diagnosis) if f.name not in OWN
        },
    }
    arrays["content"] = np.frombuffer(json.dumps(content).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, seal=_seal(arrays), **arrays)
    return buffer.getvalue()


def from_bytes(data: bytes, verdict: str) -> Diagnosis:
    """The diagnosis of an npz file that was written with the text `verdict`; raises DataError with a sentence."""
    arrays = _arrays(data)
    content = _content(arrays)
    if content.get("kind") != KIND or content.get("version") != VERSION:
        raise DataError(f"is of another version of rotorsim; {AGAIN}")
    if not np.array_equal(arrays.pop("seal", np.zeros(0)), _seal(arrays)):
        raise DataError(f"was changed since it was written; {AGAIN}")
    if content.get("verdict") != digest(verdict):
        raise DataError(f"does not belong to the verdict next to it, which was changed or is another's; {AGAIN}")
    try:
        return _diagnosis(content, arrays)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        reason = f"{error}" if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        raise DataError(f"is damaged or of another version of rotorsim ({reason}); {AGAIN}") from error


def digest(verdict: str) -> str:
    """SHA-256 of a verdict's JSON, whatever its spaces and line ends; raises DataError for other text."""
    try:
        content = parse_json(verdict)
    except ValueError as error:
        raise DataError(f"stands next to a verdict that is not JSON; {AGAIN}") from error
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _seal(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """SHA-256 (32,) of names, types, shapes and values of arrays."""
    sum_of_all = hashlib.sha256()
    for name in sorted(arrays):
        sum_of_all.update(f"{name} {arrays[name].dtype.str} {arrays[name].shape}".encode())
        sum_of_all.update(np.ascontiguousarray(arrays[name]).tobytes())
    return np.frombuffer(sum_of_all.digest(), np.uint8)


def _arrays(data: bytes) -> dict[str, np.ndarray]:
    try:
        files = read_archive(data, LARGEST, densest=float("inf"))  # arrays of zeros pack by 1 : 1000
        return {name.removesuffix(".npy"): _array(content) for name, content in files.items()}
    except Exception as error:  # numpy raises many kinds for damaged files
        reason = f" ({error})" if isinstance(error, ArchiveError) else ""
        raise DataError(f"is damaged{reason}; {AGAIN}") from error


def _array(content: bytes) -> np.ndarray:
    found: np.ndarray = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    return found


def _content(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    try:
        content = parse_json(arrays["content"].tobytes())
    except (KeyError, ValueError) as error:
        raise DataError(f"has no content that can be read; {AGAIN}") from error
    if not isinstance(content, dict):
        raise DataError(f"has no content that can be read; {AGAIN}")
    return content


def _diagnosis(content: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Diagnosis:
    # names that the result imports for types alone; a stored plan stands for the plan
    hints = get_type_hints(Diagnosis, localns={"xr": xr, "ExperimentPlan": StoredPlan})
    stored = content["fields"]
    given: dict[str, Any] = {"machine": _machine(content["machine"]), "gap": _gap_from_plain(content["gap"], arrays)}
    for field in (f for f in fields(Diagnosis) if f.name not in OWN):
        if field.name in stored:
            given[field.name] = from_plain(hints[field.name], stored[field.name], arrays, field.name)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise ValueError(f"{field.name} is missing")
    if content["plan"] is not None:
        plan = from_plain(StoredPlan, content["plan"], arrays, "plan")
        given["planned"] = cast("ExperimentPlan", plan)  # has all of a plan that is shown
    return Diagnosis(**given)


def _machine(text: Any) -> Machine:
    try:
        return Machine.from_text(text)
    except MachineFileError as error:
        raise ValueError(f"its machine: {str(error).splitlines()[0]}") from error


def _gap_to_plain(gap: xr.Dataset, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """A dataset as objects; texts of coordinates as lists."""
    variables = {
        str(name): {
            "dims": list(one.dims), "attrs": to_plain(dict(one.attrs), arrays),
            "values": to_plain(one.values if one.dtype.kind in "biufc" else one.values.tolist(), arrays),
        }
        for name, one in gap.variables.items()
    }  # fmt: skip
    return {"coords": [str(name) for name in gap.coords], "variables": variables, "attrs": to_plain(gap.attrs, arrays)}


def _gap_from_plain(stored: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> xr.Dataset:
    made = {}
    for name, one in stored["variables"].items():
        values = from_plain(Any, one["values"], arrays, f"gap.{name}")
        made[name] = xr.Variable(one["dims"], values, one["attrs"])
    coords = {name: made.pop(name) for name in stored["coords"]}
    return xr.Dataset(made, coords, stored["attrs"])


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
        if diagnosis.discovered is not None and diagnosis.discovered.source:
            write_text(part / RESULTS["law"], diagnosis.discovered.source)
        if diagnosis.status not in ("unknown", "stochastic"):
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


def write_plan(folder: Path, plan: ExperimentPlan | StoredPlan, machine: Machine) -> str:
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
        raise DataError(
            f"{folder}: is not a folder; give the one that 'rotorsim diagnose' wrote", argument="folder", value=folder
        )
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

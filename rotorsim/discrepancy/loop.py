"""`decide`: diagnose, plan, make the experiment and diagnose again, until one explanation is settled.

Its rig is a hidden machine that is simulated, or a folder into which measured records are put.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Protocol

from identification.readers import endings
from rotorsim.base.errors import DataError
from rotorsim.base.files import make_folder
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.interrupt import undoing
from rotorsim.discrepancy.calibration import CompiledModels, ParameterPoint, Progress
from rotorsim.discrepancy.changes import known_changes
from rotorsim.discrepancy.data_vector import TOLERANCE
from rotorsim.discrepancy.decision import DecisionStep, DecisionSteps, allowed_here, check_allowed, read_steps
from rotorsim.discrepancy.diagnosis import diagnose
from rotorsim.discrepancy.experiments import SET_UP, ExperimentOption, PlannedRecord
from rotorsim.discrepancy.files import write_plan
from rotorsim.discrepancy.hidden_machine import read_truth, record_of, truth_twin
from rotorsim.discrepancy.ranking import ExperimentPlan, Proposal
from rotorsim.discrepancy.result import Diagnosis
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import NOTHING, SURE
from rotorsim.machine import Machine, load_machine

if TYPE_CHECKING:
    import xarray as xr

ShowSteps = Callable[[DecisionSteps], None]
UNFINISHED = "unfinished"
"""Folder of what was computed, by which an interrupted loop resumes."""
VIRTUAL = "virtual:"
"""Prefix of the folder of a hidden machine."""
FIRST_NOISE = 1000
"""Number of the noise of the first new record: those of `hide` are lower."""
LOOK = 1.0
"""Time [s] between two looks into a folder."""


def decide(
    machine: Machine | str | Path,
    rig: ExperimentRig | str | Path,
    budget: float = 30.0,
    records: Iterable[Any] = (),
    allow: Iterable[str] = (),
    effects: Iterable[str] | None = None,
    sure: float = SURE,
    out: str | Path | None = None,
    mapping: Any = None,
    progress: Progress = lambda stage, most=0: None,
    shown: ShowSteps = lambda steps: None,
    models: CompiledModels | None = None,
    tolerance: float = TOLERANCE,
    anew: bool = False,
    noted: Callable[[str], None] = lambda note: None,
) -> Diagnosis:
    """Diagnose and make the experiment that should tell most, until one explanation has a probability of `sure`.

    Parameters
    ----------
    machine : Machine, name or path
        The machine as it is believed to be.
    rig : Rig, or text
        'virtual:FOLDER' of `hide`, whose hidden machine makes the experiments, or a folder into which their records are
        put by hand.
    budget : float
        Minutes of rig time.
    records : Datasets or paths
        Records to begin with: in place of those that were hidden with a truth, besides those of a folder.
    allow : names
        What experiments may change (`decision.ALLOWED`); all for none.
    effects : names, optional
        Candidates.
    sure : float
        Probability that ends the loop.
    out : folder, optional
        Where steps and records are kept, so that the same call resumes.
    mapping :
        Columns of records that are not netCDF files.
    progress, shown : functions
        Called with each stage of the work, and with all steps after each of them.
    models : CompiledModels, optional
        Compiled twins of the machine.
    tolerance : float
        Declared tolerance of the model, as a share of every line.
    anew : bool
        Begin anew where `out` has steps already.
    noted : function
        As of `diagnose`.

    Returns
    -------
    Diagnosis
        The last one; `steps` has the odds after each step.

    Raises
    ------
    DataError
        With one sentence: no records, a budget too small for any experiment, a rig that is not there.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.discrepancy.decide("dtu_gas_bearing", "virtual:puzzle", budget=30.0)  # doctest: +SKIP
    >>> print(found.steps.table())  # doctest: +SKIP
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    if not budget > SET_UP:
        raise DataError(
            f"budget: {budget:g} min allow no experiment; the shortest takes more than {SET_UP:g} min",
            argument="budget",
            value=budget,
        )
    if not 0.5 < sure < 1:
        raise DataError(f"sure: {sure:g} is not between 0.5 and 1; give e.g. 0.95", argument="sure", value=sure)
    there = rig if not isinstance(rig, (str, Path)) else open_rig(str(rig), machine)
    names = check_allowed(allow)
    allowed = allowed_here(machine, names)
    there.check(out)
    alike = mapping is not None and isinstance(there, FolderRig)
    only = None if effects is None else tuple(effects)
    given = [r if not isinstance(r, (str, Path)) else Path(r).resolve() for r in records]
    asked = {
        "machine": machine.name, "content": machine.hash, "rig": there.name, "allow": sorted(allowed), "sure": sure,
        "effects": None if only is None else sorted(only), "records": [str(r) for r in given if isinstance(r, Path)],
        "mapping": None if mapping is None else str(mapping),
    }  # fmt: skip
    with TemporaryDirectory() as scratch, undoing():
        folder = make_folder(Path(scratch if out is None else out).resolve())
        loop = DecisionLoop(
            machine, there, budget, names, alike, only, sure, folder, mapping, progress, shown, models, tolerance, noted
        )
        first = there.begin(given)
        return loop.run(first, DecisionSteps(asked) if anew else read_steps(folder, asked))


@dataclass(eq=False)
class DecisionLoop:
    """Loop of diagnoses and experiments in progress."""

    machine: Machine
    rig: ExperimentRig
    budget: float
    allow: Sequence[str]
    alike: bool
    """Whether one mapping holds for all records, so that none can state what was changed for it alone."""
    effects: tuple[str, ...] | None
    sure: float
    folder: Path
    mapping: Any
    progress: Progress
    shown: ShowSteps
    models: CompiledModels | None
    tolerance: float
    noted: Callable[[str], None] = lambda note: None

    def run(self, first: list[Any], steps: DecisionSteps) -> Diagnosis:
        """Diagnoses and experiments until the loop ends."""
        self.models = self.models or CompiledModels.of(self.machine, self.effects, self.progress)
        steps = _with_files(steps, first)
        while True:
            found = self._diagnosed([*(r for r in first if str(r) not in steps.records), *map(Path, steps.records)])
            if not steps.steps or steps.made:
                steps = steps.with_step(self._step(found, steps))
                self._keep(steps)
            if not self._settled(found):
                found = replace(found, planned=self._next_plan(found))
            best, end = self._next(found, steps), self._end(found, steps)
            if end != "decided" and (new := self.rig.arrived()):
                steps = steps.with_new(list(map(str, new)))
                self._keep(steps)
                continue
            steps = replace(steps, end=end)
            if end != "open" or best is None:
                self._keep(steps)
                shutil.rmtree(self.folder / UNFINISHED, ignore_errors=True)
                return replace(found, steps=steps, planned=None if end in ("budget", "decided") else found.planned)
            plan = found.planned
            if plan is not None:  # the experiment that is made before the others
                plan = replace(plan, proposals=(best, *(p for p in plan.proposals if p is not best)))
            found = replace(found, planned=plan)
            steps = self._experiment(found, best, steps)
            self._keep(steps)
            if not steps.made:
                return replace(found, steps=steps)

    def _diagnosed(self, records: list[Any]) -> Diagnosis:
        """Diagnosis of all records."""
        return diagnose(
            self.machine, records, effects=self.effects, mapping=self.mapping, models=self.models,
            tolerance=self.tolerance, progress=self.progress, resume=self.folder / UNFINISHED, noted=self.noted,
        )  # fmt: skip

    def _next_plan(self, found: Diagnosis) -> ExperimentPlan:
        """Plan of the next experiment, among those whose records can state their changes."""
        plan = found.plan(self.allow, sure=self.sure)
        able = tuple(p for p in plan.proposals if not (self.alike and p.option.stated))
        return replace(plan, proposals=able)

    def _step(self, found: Diagnosis, steps: DecisionSteps) -> DecisionStep:
        """The diagnosis as a step, with the experiment that was made before it."""
        made: dict[str, Any] = {"experiment": "", "minutes": 0.0, "records": ()}
        made |= dict(steps.pending)
        return DecisionStep(**made, status=found.status, odds=found.odds, entropy=found.entropy)

    def _settled(self, found: Diagnosis) -> bool:
        """Whether one explanation is settled; "nothing is missing" never is while a run may show something."""
        return max((p for name, p in found.odds.items() if name != NOTHING), default=0.0) >= self.sure

    def _end(self, found: Diagnosis, steps: DecisionSteps) -> str:
        """End of the loop, a key of `ENDS`; 'open' while it goes on."""
        if self._settled(found):
            return "decided"
        end = self._unsettled_end(found, steps)
        return "decided" if end != "open" and max(found.odds.values(), default=0.0) >= self.sure else end

    def _unsettled_end(self, found: Diagnosis, steps: DecisionSteps) -> str:
        plan = found.planned
        if plan is None or not plan.proposals:
            return "no_plan"
        if not plan.settles:
            return "inseparable"
        if self._next(found, steps) is not None:
            return "open"
        if not any(step.experiment for step in steps.steps) and max(found.odds.values()) < self.sure:
            least = min(p.option.minutes for p in plan.proposals if plan.helps(p))
            raise DataError(
                f"budget: {self.budget:.3g} min; the shortest experiment takes {least:.3g} min; give more",
                argument="budget",
                value=self.budget,
            )
        return "budget"

    def _next(self, found: Diagnosis, steps: DecisionSteps) -> Proposal | None:
        """The experiment that waits for its record, else the best that helps and that the budget still pays for."""
        plan, left = found.planned, self.budget - steps.spent
        if plan is None:
            return None
        waiting = steps.pending.get("experiment")
        asked = next((p for p in plan.proposals if p.option.name == waiting and p.option.minutes <= left), None)
        return asked or plan.first(left)

    def _experiment(self, found: Diagnosis, best: Proposal, steps: DecisionSteps) -> DecisionSteps:
        """Steps with the next experiment made, which is pending until it is diagnosed."""
        assert found.planned is not None
        write_plan(self.folder, found.planned, self.machine)
        ahead = {
            "experiment": best.option.name,
            "minutes": best.option.minutes,
            "expected": best.outlook.decided,
            "expected_of_effects": best.outlook.of_effects,
        }
        self._keep(replace(steps, pending=ahead | {"records": ()}))
        made = self._made(best.option, len(steps.steps))
        return replace(steps, pending=ahead | {"records": tuple(made)}, end="open" if made else "no_record")

    def _made(self, option: ExperimentOption, number: int) -> list[str]:
        """Files of an experiment's records."""
        paths = []
        for k, record in enumerate(self.rig.run(option, number, lambda: self.progress("experiment"))):
            if isinstance(record, Path):
                paths.append(record)
                continue
            path = make_folder(self.folder / "records") / f"next_{number}{f'_{k}' if k else ''}.nc"
            write_netcdf(path, record)
            paths.append(path)
        return [str(path) for path in paths]

    def _keep(self, steps: DecisionSteps) -> None:
        steps.write(self.folder)
        self.shown(steps)


def _with_files(steps: DecisionSteps, first: Sequence[Any]) -> DecisionSteps:
    """Steps with the files to begin with, and those that have come since the loop was interrupted."""
    files = [str(r) for r in first if isinstance(r, Path)]
    if not steps.steps:
        return replace(steps, first=tuple(files))
    return steps.with_new([name for name in files if name not in (*steps.first, *steps.records)])


class ExperimentRig(Protocol):
    """Rig that makes the records of a loop."""

    @property
    def name(self) -> str:
        """Name of the rig, as the command line gives it."""

    def check(self, out: str | Path | None) -> None:
        """Raise DataError where the rig is not there, or where results in `out` would be among its records."""

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """Records to begin with, as Datasets or absolute paths, where others are `given`."""

    def arrived(self) -> list[Any]:
        """Absolute paths of records that have come since the last call of any of these, without being waited for."""

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Records of an experiment, the loop's one of this number from 1; none if none came in time."""


@dataclass(frozen=True)
class VirtualRig:
    """A machine that `hide` has made: its records to begin with, its hidden truth for new ones."""

    folder: Path
    machine: Machine

    @property
    def name(self) -> str:
        """Name of the rig, as the command line gives it."""
        return f"{VIRTUAL}{self.folder.resolve()}"

    def check(self, out: str | Path | None) -> None:
        """Raise DataError if the truth is missing, or if `out` lies in the folder of the hidden machine."""
        refuse_same(out, self.folder)
        self.truth  # noqa: B018  (found missing before hours of work)

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """The records that are given, else those that were hidden with the truth."""
        if given:
            return list(given)
        found = sorted((self.folder / "records").resolve().glob("*.nc"))
        if not found:
            raise DataError(f"{self.folder}: has no folder 'records'; give the folder that rotorsim hide has made")
        return list(found)

    @cached_property
    def truth(self) -> Any:
        """Sealed truth, which the diagnosis never reads."""
        return read_truth(self.folder / "sealed" / "truth.json")

    @cached_property
    def twin(self) -> Twin:
        """Plant of the hidden machine."""
        return truth_twin(self.machine)

    def arrived(self) -> list[Any]:
        """No records: the machine is recorded by experiments alone."""
        return []

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Record of an experiment on the hidden machine."""
        waiting()
        return [record_on(self.machine, self.twin, self.truth.point, self.truth.seed, option, number)]


def record_on(
    machine: Machine, twin: Twin, point: ParameterPoint, seed: int, option: ExperimentOption, number: int
) -> xr.Dataset:
    """Record of an experiment on a hidden machine, which states what was changed on purpose."""
    stated = option.changes(machine)
    planned = PlannedRecord(f"next_{number}", "fit", option.experiment, FIRST_NOISE + number)
    changes = known_changes(machine, stated, "next")
    record = record_of(twin, planned, point, seed, tiled=True, changes=changes)
    return record.assign_attrs(changes=json.dumps(stated)) if stated else record


@dataclass(frozen=True)
class FolderRig:
    """A folder into which records are put, one after another, as their experiments were made."""

    folder: Path
    longest: float = 8 * 3600.0
    """Time [s] to wait for a record."""
    taken: set[Path] = field(default_factory=set)

    @property
    def name(self) -> str:
        """Absolute path of the folder."""
        return str(self.folder.resolve())

    def check(self, out: str | Path | None) -> None:
        """Raise DataError if the folder is missing, or if `out` is not given or lies in it."""
        if not self.folder.is_dir():
            raise DataError(
                f"--rig: {self.folder} is not a folder; make it and put the records there are into it",
                argument="rig",
                value=str(self.folder),
            )
        if out is None:
            raise DataError(
                "decide: a rig that is a folder needs out, where the plan of the next experiment is put", argument="out"
            )
        refuse_same(out, self.folder)

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """The records that are given and those that are there and complete."""
        self.taken.update(self._complete())
        return [*given, *sorted(self.taken - {r for r in given if isinstance(r, Path)})]

    def arrived(self) -> list[Any]:
        """New records that are complete; one that still grows is waited for."""
        new = self._complete() - self.taken
        self.taken.update(new)
        return sorted(new)

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """New records, as soon as there are any that do not grow any more."""
        end = time.monotonic() + self.longest
        while time.monotonic() < end:
            waiting()
            if new := self.arrived():
                return new
        return []

    def _complete(self) -> set[Path]:
        """Absolute paths of the records, once none of them grows any more."""
        while True:
            before = self._sizes()
            time.sleep(LOOK if set(before) - self.taken else 0.2 * LOOK)
            if before == self._sizes():
                return {path for path, size in before.items() if size > 0}

    def _sizes(self) -> dict[Path, int]:
        found = {}
        for path in self.folder.resolve().rglob("*"):
            with suppress(FileNotFoundError):
                if path.suffix.lower() in endings() and path.is_file():
                    found[path] = path.stat().st_size
        return found


def refuse_same(out: str | Path | None, folder: Path) -> None:
    """Raise DataError for results in a rig's folder, where they would be taken for records."""
    if out is not None and Path(out).resolve().is_relative_to(folder.resolve()):
        raise DataError(
            f"--out: {out} is in the folder of the rig, {folder}; give another one", argument="out", value=out
        )


def open_rig(text: str, machine: Machine, longest: float = 8 * 3600.0) -> ExperimentRig:
    """Rig from its text: virtual:FOLDER of `hide`, or a folder of records; raises DataError for neither."""
    if text.startswith(VIRTUAL):
        return VirtualRig(Path(text.removeprefix(VIRTUAL)), machine)
    if ":" in text and not Path(text).exists():
        raise DataError(
            f"--rig: '{text}' is neither virtual:FOLDER (of rotorsim hide) nor a folder; give one of these",
            argument="rig",
            value=text,
        )
    return FolderRig(Path(text), longest)

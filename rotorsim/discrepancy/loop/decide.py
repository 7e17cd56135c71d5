"""`decide`: diagnose, plan, make the experiment and diagnose again, until one explanation is settled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.files import make_folder, write_text
from rotorsim.base.netcdf import write_netcdf
from rotorsim.discrepancy.diagnose_records import diagnose
from rotorsim.discrepancy.diagnosis import Progress, Workshop
from rotorsim.discrepancy.loop.rigs import Rig, open_rig
from rotorsim.discrepancy.loop.steps import Step, Steps, read_steps
from rotorsim.discrepancy.odds.explanation import SURE
from rotorsim.discrepancy.outcome.files import RESULTS
from rotorsim.discrepancy.outcome.result import Diagnosis
from rotorsim.discrepancy.plan.allowed import allowed_here, check_allowed
from rotorsim.discrepancy.plan.options import Option
from rotorsim.discrepancy.plan.plan import Proposal
from rotorsim.machine import Machine, load_machine

Shown = Callable[[Steps], None]


def decide(
    machine: Machine | str | Path,
    rig: Rig | str | Path,
    budget: float = 30.0,
    records: Iterable[Any] = (),
    allow: Iterable[str] = (),
    effects: Iterable[str] | None = None,
    sure: float = SURE,
    out: str | Path | None = None,
    mapping: Any = None,
    progress: Progress = lambda stage: None,
    shown: Shown = lambda steps: None,
    workshop: Workshop | None = None,
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
        What experiments may change (`plan.allowed.ALLOWED`); all for none.
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
    workshop : Workshop, optional
        Compiled twins of the machine.

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
    if not budget > 0:
        raise DataError(f"budget: {budget:g} min; give minutes of rig time above 0")
    if not 0.5 < sure < 1:
        raise DataError(f"sure: {sure:g} is no probability between 0.5 and 1; give e.g. 0.95")
    there = rig if not isinstance(rig, (str, Path)) else open_rig(str(rig), machine)
    allowed = check_allowed(allow)
    allowed_here(machine, allowed)
    asked = {"machine": machine.name, "rig": there.name, "allow": list(allowed), "sure": sure}
    with TemporaryDirectory() as scratch:
        folder = make_folder(Path(scratch if out is None else out))
        wanted = Loop(machine, there, budget, allowed, effects, sure, folder, mapping, progress, shown, workshop)
        return wanted.run(there.begin(list(records)), read_steps(folder, asked))


@dataclass(eq=False)
class Loop:
    """A loop in progress."""

    machine: Machine
    rig: Rig
    budget: float
    allow: Sequence[str]
    effects: Iterable[str] | None
    sure: float
    folder: Path
    mapping: Any
    progress: Progress
    shown: Shown
    workshop: Workshop | None

    def run(self, first: list[Any], steps: Steps) -> Diagnosis:
        """All steps that are left."""
        effects = None if self.effects is None else tuple(self.effects)
        self.workshop = self.workshop or Workshop.of(self.machine, effects, self.progress)
        steps = _with_files(steps, first)
        while True:
            found = self._diagnosed([*(r for r in first if str(r) not in steps.records), *steps.records])
            if not steps.steps or steps.made:
                steps = steps.with_step(self._step(found, steps))
            steps = replace(steps, end=self._end(found, steps))
            self._keep(steps)
            if steps.end != "open":
                return replace(found, steps=steps)
            steps = self._experiment(found, steps)
            self._keep(steps)
            if not steps.made:
                return replace(found, steps=steps)

    def _diagnosed(self, records: list[Any]) -> Diagnosis:
        """Diagnosis with a plan."""
        return diagnose(
            self.machine, records, effects=self.effects, mapping=self.mapping, workshop=self.workshop,
            progress=self.progress, resume=self.folder / "unfinished", plan_next=self.allow,
        )  # fmt: skip

    def _step(self, found: Diagnosis, steps: Steps) -> Step:
        """The diagnosis as a step, with the experiment that was made before it."""
        made: dict[str, Any] = {"experiment": "", "minutes": 0.0, "records": (), "expected": None}
        made |= dict(steps.pending)
        return Step(**made, status=found.status, odds=found.odds, entropy=found.entropy)

    def _end(self, found: Diagnosis, steps: Steps) -> str:
        """How the loop ends, or 'open'."""
        if max(found.odds.values(), default=0.0) >= self.sure:
            return "decided"
        plan = found.planned
        if plan is None or not plan.settles:
            return "inseparable"
        if self._next(found, steps) is None:
            if not any(step.experiment for step in steps.steps):
                least = min(p.option.minutes for p in plan.proposals)
                raise DataError(
                    f"budget: {self.budget:.3g} min are less than any experiment takes; give {least:.3g} min"
                )
            return "budget"
        return "open"

    def _next(self, found: Diagnosis, steps: Steps) -> Proposal | None:
        """The experiment that waits for its record, else the best that helps and that the budget still pays for."""
        plan, left = found.planned, self.budget - steps.spent
        if plan is None:
            return None
        waiting = steps.pending.get("experiment")
        asked = next((p for p in plan.proposals if p.option.name == waiting and p.option.minutes <= left), None)
        return asked or plan.first(left)

    def _experiment(self, found: Diagnosis, steps: Steps) -> Steps:
        """The next experiment made; pending until it is diagnosed."""
        best, number = self._next(found, steps), len(steps.steps)
        assert found.planned is not None and best is not None
        ordered = replace(found.planned, proposals=(best, *(p for p in found.planned.proposals if p is not best)))
        write_text(self.folder / RESULTS["plan"], ordered.campaign(self.machine, self.machine.name))
        ahead = {"experiment": best.option.name, "minutes": best.option.minutes, "expected": best.outlook.decided}
        steps = replace(steps, pending=ahead | {"records": ()})
        self._keep(steps)
        made = self._made(best.option, number)
        return replace(steps, pending=ahead | {"records": tuple(made)}, end="open" if made else "no_record")

    def _made(self, option: Option, number: int) -> list[str]:
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

    def _keep(self, steps: Steps) -> None:
        steps.write(self.folder)
        self.shown(steps)


def _with_files(steps: Steps, first: Sequence[Any]) -> Steps:
    """Steps that know the files to begin with; what has come since the loop waited is of its pending experiment."""
    files = tuple(str(r) for r in first if isinstance(r, (str, Path)))
    if not steps.steps:
        return replace(steps, first=files)
    new = tuple(name for name in files if name not in (*steps.first, *steps.records))
    return replace(steps, pending={**steps.pending, "records": new}) if new and steps.pending else steps

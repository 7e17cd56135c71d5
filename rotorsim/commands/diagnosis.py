"""`rotorsim diagnose`: finds the effect that a machine file lacks; `hide` makes test data.

On the terminal stand progress, steps of a loop, verdict, odds, sizes, misfit and plan, as text or JSON.
"""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.display import end_line, line, on_terminal
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.units import MINUTE, TO_UM, parse
from rotorsim.commands import options
from rotorsim.commands.registry import command
from rotorsim.commands.results import results
from rotorsim.discrepancy.decision import ALLOWED, check_allowed

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis
    from rotorsim.discrepancy.calibration import Progress
    from rotorsim.discrepancy.decision import DecisionSteps
    from rotorsim.discrepancy.loop import ExperimentRig
    from rotorsim.discrepancy.ranking import ExperimentPlan
    from rotorsim.machine import Machine

BUDGET, WAIT = "30 min", "8 h"
"""Rig time of the experiments, and longest time to wait for a record, where none is given."""


@dataclass(frozen=True)
class DataOptions:
    """Records by their use, columns, candidates, and tolerance of the model."""

    records: Annotated[
        list[Path] | None, typer.Argument(metavar="RECORDS", help="Records to fit: files, or a folder of .nc.")
    ] = None
    held_out: Annotated[
        list[Path] | None, typer.Option(help="Record at another operating point that chooses the effect.")
    ] = None
    untouched: Annotated[list[Path] | None, typer.Option(help="Record that only shows the gap; repeatable.")] = None
    mapping: Annotated[Path | None, typer.Option(help="Columns of files that are not .nc.")] = None
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="Only this is a candidate, e.g. runout or runout.amplitude_2x; may be repeated.",
            autocompletion=options.parameters,
        ),
    ] = None
    tolerance: Annotated[float, typer.Option(help="Tolerance of the model: share of a line.")] = 0.004

    def check(self, records: bool) -> None:
        """Raise DataError for a tolerance that is not a fraction, and without `records` where they are needed."""
        if records and not self.records:
            raise DataError("diagnose: no records; name files or a folder, or give --self-test")
        if not 0 < self.tolerance < 1:
            text = f"--tolerance: {self.tolerance:g} is not a fraction; give a number between 0 and 1, e.g. 0.004"
            raise DataError(text)


@dataclass(frozen=True)
class ExperimentOptions:
    """Next experiments: planned or made, on which rig, with which changes and rig time."""

    plan_next: Annotated[
        bool, typer.Option("--plan-next", help="Rank the experiments that may come next; write the best as a plan.")
    ] = False
    allow: Annotated[
        str | None, typer.Option(help=f"What experiments may change: {', '.join(ALLOWED)}; all if not given.")
    ] = None
    until_decided: Annotated[
        bool, typer.Option("--until-decided", help="Make experiments on --rig until one explanation has 95 %.")
    ] = False
    rig: Annotated[
        str | None, typer.Option(help="virtual:FOLDER of 'hide', or the folder into which new records are put.")
    ] = None
    budget: Annotated[str | None, typer.Option(help=f"Rig time of the experiments; {BUDGET} if not given.")] = None
    wait: Annotated[str | None, typer.Option(help=f"Longest time to wait for a record; {WAIT} if not given.")] = None

    def check(self, roles: bool) -> None:
        """Raise DataError for options that do not belong together; `roles`: whether records have one by an option."""
        if self.allow is not None and not (self.plan_next or self.until_decided):
            raise DataError("--allow: is about a plan; give --plan-next or --until-decided too")
        _ = self.allowed
        if not self.until_decided:
            for option, given in (("rig", self.rig), ("budget", self.budget), ("wait", self.wait)):
                if given is not None:
                    raise DataError(f"--{option}: is about a loop of experiments; give --until-decided too")
        elif self.rig is None:
            raise DataError(
                "--until-decided: needs --rig: virtual:FOLDER of rotorsim hide, or a folder for new records"
            )
        elif roles:  # records that are yet to come cannot have one
            raise DataError(
                "--until-decided: takes no --held-out and --untouched; state the attribute role in the records"
            )

    @property
    def allowed(self) -> tuple[str, ...]:
        """Changes that experiments may make; raises DataError for something unknown."""
        return check_allowed([] if self.allow is None else [name.strip() for name in self.allow.split(",")])

    @property
    def budget_minutes(self) -> float:
        """Rig time of the experiments [min]; raises DataError."""
        return _minutes("--budget", self.budget or BUDGET)

    def open_rig(self, machine: Machine) -> ExperimentRig:
        """The rig, with the longest wait for a record; raises DataError where the text names none."""
        from rotorsim.discrepancy.loop import open_rig

        longest = MINUTE * _minutes("--wait", self.wait or WAIT)
        return open_rig(str(self.rig), machine, longest)


def _minutes(option: str, text: str) -> float:
    """Minutes of a time as text; raises DataError."""
    try:
        found = parse(text, "s") / MINUTE
    except ValueError as error:
        raise DataError(f"{option}: {error}") from error
    if found <= 0:
        raise DataError(f"{option}: '{text}' is not above 0; give e.g. '30 min'")
    return found


FOLDER = Path("decision")
"""Folder of a loop when none is given; one name, so that the same command resumes."""
MONTH = 30 * 86400.0
"""Time [s] for which an interrupted diagnosis waits for the same command."""


@command(
    "diagnose",
    "rotorsim diagnose dtu_gas_bearing puzzle/records --out diagnosis",
    "rs.diagnose('dtu_gas_bearing', 'puzzle/records')",
)
@options.resumable
def diagnose(
    machine: options.GivenMachine,
    data: DataOptions,
    seed: Annotated[int, typer.Option(help="Kept with the verdict; nothing is drawn.")] = 0,
    self_test: Annotated[
        bool, typer.Option("--self-test", help="Print which effects the campaign cannot distinguish, and stop.")
    ] = False,
    *,
    experiments: ExperimentOptions,
    result: options.ResultOptions,
) -> None:
    """Find the effect that a machine file lacks against records.

    It is written into a new machine file; the report shows the gap before and after.

    Exit code: 0 no disagreement, 10 an effect is named, 11 a tie or a partial explanation, 12 unknown, 13 numbers of
    the file are far off, 14 a law is discovered, 15 what is left does not repeat, 2 bad input.
    Records of one folder may state in their attribute `role` what they are for: fit, held_out or untouched. What was
    computed is kept, so that an interrupted diagnosis resumes where it was.
    """
    from rotorsim.machine import load_machine

    if self_test:
        _self_test(machine, data, result.as_json)
        return
    result.check()
    data.check(records=not experiments.until_decided)
    experiments.check(roles=bool(data.held_out or data.untouched))
    load_machine(machine)  # refused here, before anything that computes is loaded
    if experiments.until_decided:
        found, files = run_loop(machine, data, experiments, result, Stages().show)
    else:
        allow = experiments.allowed if experiments.plan_next else None
        found, files = _diagnosed(machine, data, allow, seed, result)
    show(found, files, result.as_json)
    raise typer.Exit(found.exit_code)


def _diagnosed(
    machine: str, data: DataOptions, allow: tuple[str, ...] | None, seed: int, result: options.ResultOptions
) -> tuple[Diagnosis, dict[str, str]]:
    """The diagnosis, with a plan of experiments that change what `allow` names, and its files."""
    from rotorsim.discrepancy import diagnose as diagnose_records
    from rotorsim.discrepancy.files import RESULTS

    names = [name for kind, name in RESULTS.items() if kind != "report"]
    given = (data.records, data.held_out, data.untouched, data.mapping, data.effect, data.tolerance)
    with result.folder("diagnosis", *names, page=RESULTS["report"]) as folder, unfinished(machine, *given) as kept:
        found = diagnose_records(
            machine, data.records or (), data.held_out, data.untouched, data.effect, seed, data.tolerance,
            data.mapping, progress=Stages().show, resume=kept, plan_next=allow, noted=_print_note,
        )  # fmt: skip
        return found, _saved(found, folder)


def _print_note(note: str) -> None:
    """Print a note before the work begins, after the line of an earlier round's progress."""
    end_line()
    print(f"note: {note}", file=sys.stderr, flush=True)


def _saved(found: Diagnosis, folder: options.ResultFolder) -> dict[str, str]:
    """Paths of the files of a diagnosis by kind, which are written."""
    from rotorsim.discrepancy import save_diagnosis

    files = save_diagnosis(found, folder.path, folder.options.report)
    return files | (folder.options.page.finish(files["report"]) if folder.options.report else {})


def _self_test(machine: str, data: DataOptions, as_json: bool) -> None:
    """Print how alike effects are under the records, or under the campaign of `hide`."""
    from rotorsim.discrepancy import alias_matrix, markdown

    matrix = alias_matrix(machine, data.records or None, data.mapping, Stages().show)
    end_line()
    typer.echo(json.dumps(matrix.as_dict(), indent=2) if as_json else markdown(matrix))


def run_loop(
    machine: str, data: DataOptions, experiments: ExperimentOptions, result: options.ResultOptions,
    progress: Progress,
) -> tuple[Diagnosis, dict[str, str]]:  # fmt: skip
    """The last diagnosis of a loop of experiments, and its files."""
    from rotorsim.discrepancy import decide
    from rotorsim.discrepancy.decision import FILE
    from rotorsim.discrepancy.files import RESULTS
    from rotorsim.machine import load_machine

    out, loaded = result.out or FOLDER, load_machine(machine)
    budget, rig = experiments.budget_minutes, experiments.open_rig(loaded)
    resumed = replace(result, out=out, force=result.force or (out / FILE).exists())
    names = [name for kind, name in RESULTS.items() if kind != "report"]
    with resumed.folder(str(FOLDER), *names, FILE, page=RESULTS["report"]) as folder:
        found = decide(
            loaded, rig, budget, data.records or (), experiments.allowed, data.effect, out=folder.path,
            mapping=data.mapping, progress=progress, tolerance=data.tolerance, anew=result.force,
            shown=StepPrinter(folder.path / RESULTS["plan"], result.as_json).show,
            noted=_print_note,
        )  # fmt: skip
        return found, _saved(found, folder) | {"steps": str(folder.path / FILE)}


@contextmanager
def unfinished(*asked: Any) -> Iterator[Path]:
    """Folder in the cache by which an interrupted diagnosis of one version resumes: until its end, or for a month."""
    from rotorsim.base.cache import RUNS, in_cache, key_of, sources_hash

    root, version = in_cache("diagnoses"), sources_hash(*RUNS, "rotorsim/analysis", "rotorsim/discrepancy")
    folder = root / key_of(Path.cwd(), asked, version)
    for old in root.iterdir():
        if time.time() - old.stat().st_mtime > MONTH:
            shutil.rmtree(old, ignore_errors=True)
    if kept := len([*folder.glob("*.npy")]):
        print(f"taking up the {kept} simulated responses of an earlier run of this command", file=sys.stderr)
    try:
        yield folder
    except RotorsimError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)


@command(
    "hide",
    "rotorsim hide dtu_gas_bearing --effect coupling.force_2x --seed 3 --out puzzle",
    "rs.hide(rs.load_machine('dtu_gas_bearing'), ('coupling.force_2x',), 3, 'puzzle')",
)
def hide(
    machine: options.GivenMachine,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="What to hide, e.g. runout or runout.amplitude_2x; may be repeated.", autocompletion=options.parameters
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Draws size, phase, calibration and noise.")] = 0,
    out: Annotated[Path, typer.Option(callback=options.a_folder, help="Folder for records and sealed truth.")] = Path(
        "hidden"
    ),
    as_json: options.AsJson = False,
) -> None:
    """Make records with hidden effects, to try 'diagnose' on.

    Without --effect nothing is hidden.

    Records go to OUT/records; the truth to OUT/sealed/truth.json, which `rotorsim diagnose` never opens.
    """
    if not 0 <= seed < 2**31:
        raise DataError(f"--seed: {seed} must be a whole number from 0 to 2^31 - 1; give e.g. 0")

    from rotorsim.machine import load_machine

    believed = load_machine(machine)
    from rotorsim.discrepancy.hidden_machine import hide as record_hidden, truth_twin

    def progress(done: int, of: int) -> None:
        line(f"record {done} of {of}", done == of)

    twin = truth_twin(believed)
    with results(out, "hidden", ("records", "sealed"), force=None):
        options.note_compiling(twin.assembly, "settle", "run")
        records = record_hidden(believed, tuple(effect or ()), seed, out, twin=twin, progress=progress)
    files = [str(out / "records" / f"{r.attrs['record']}.nc") for r in records]
    if as_json:
        options.print_json({"records": files, "sealed": str(out / "sealed" / "truth.json")})
        return
    typer.echo(f"{len(files)} records: {out / 'records'}; the truth, sealed: {out / 'sealed' / 'truth.json'}")


STAGES = {
    "compile": "compiling the machine with all candidate effects, on two grids",
    "check": "checking the records",
    "calibrate": "re-calibrating",
    "prove": "proving the solver",
    "screen": "screening candidates",
    "name": "re-fitting candidates",
    "discover": "looking for a law",
    "laws": "fitting laws to the plant, with the calibration",
    "remember": "trying forces that remember the motion",
    "show": "showing the gap",
    "plan": "planning the next experiment",
    "experiment": "waiting for the record of the experiment",
}


def show(diagnosis: Diagnosis, files: dict[str, str], as_json: bool) -> None:
    """Print the diagnosis and the paths of its files by kind."""
    if as_json:
        options.print_json(diagnosis.as_dict() | {"files": files})
        return
    end_line()
    for text in _lines(diagnosis):
        typer.echo(text)
    options.print_files(files)


def _lines(diagnosis: Diagnosis) -> Iterator[str]:
    if diagnosis.steps is not None:
        yield diagnosis.steps.table()
        yield diagnosis.steps.sentence
    yield diagnosis.sentence
    if diagnosis.free_force is not None:
        yield f"  {diagnosis.free_force.sentence}"
    yield from _effects(diagnosis)
    yield from [f"  next: {diagnosis.next_step}"] if diagnosis.planned is None else _plan(diagnosis.planned)
    yield from [f"  {note}" for note in diagnosis.file_notes[:1]]
    yield from _odds(diagnosis)
    yield from _disagreement(diagnosis)
    if diagnosis.status in ("unknown", "partial"):
        for row in diagnosis.recalibration:
            yield f"  re-calibrated, not trusted: {row.sentence}"
    for note in diagnosis.notes:
        yield f"  note: {note}"


def _odds(diagnosis: Diagnosis) -> Iterator[str]:
    from rotorsim.discrepancy.verdict import LEAST_SHOWN, shown_share

    if diagnosis.discovered is not None and not diagnosis.explanations:
        yield f"  probability {shown_share(diagnosis.discovered.probability)}: this law"
    for one in diagnosis.leading[:4]:
        if one.probability >= LEAST_SHOWN:
            yield f"  probability {shown_share(one.probability)}: {one.name}"
            if one.unseen:
                yield f"    {one.unseen_sentence}"


def _effects(diagnosis: Diagnosis) -> Iterator[str]:
    """Each effect that was found, with its sizes and what is indistinguishable from it, and the gap that is gone."""
    from rotorsim.discrepancy.gap import reduction

    for found in diagnosis.effects:
        numbers = (f"{p} = {value}" + (f" +- {sd}" if sd else "") for p, value, sd in found.sizes())
        yield f"  {found.form}: {', '.join(numbers)}"
        others = [k for k in found.tie_class if k != found.form]
        if others:
            yield f"    no record distinguishes it from: {', '.join(others)}"
    share = reduction(diagnosis.gap)
    if diagnosis.explained and share == share:
        yield f"  gap on untouched records, re-calibrated to with effect: {100 * share:.0f} % gone"


def _disagreement(diagnosis: Diagnosis) -> Iterator[str]:
    """Groups of lines beyond the floor, and the equivalent input and force of what is left."""
    if count := len(diagnosis.localisation):
        more = ", of which the first are" if count > 6 else ""
        yield f"  groups of lines beyond the floor, after re-calibration alone: {count}{more}"
    for flag in diagnosis.localisation[:6]:
        yield (
            f"    {flag.record} ({flag.point}), {flag.channel}, {flag.group}: {flag.rms * TO_UM:.3g} um over a floor "
            f"of {flag.floor * TO_UM:.2g} um" + (f", largest {flag.place}" if flag.place else "")
        )
    for own in diagnosis.inputs:
        yield f"  equivalent input of {own.sentence}"
    for one in diagnosis.unknown.get("lines", ())[:3] if diagnosis.stochastic is None else ():
        place = f"{one['frequency_hz']:.4g} Hz, {one['direction']}, {one['point']}"
        yield f"  equivalent force {one['force_n']:.3g} N at {place}"


def _plan(plan: ExperimentPlan) -> Iterator[str]:
    """The sentence and the best five experiments."""
    yield plan.sentence
    for sentence in plan.unbreakable:
        yield f"  {sentence}"
    for one in plan.proposals[:5]:
        yield (
            f"  {one.option.name}: {one.option.minutes:.0f} min, {one.outlook.entropy:.2f} bit left, "
            f"{100 * one.outlook.decided:.0f} % chance of a decision"
        )


QUIET = 30.0
"""Time [s] after which a long stage has another line in a pipe."""


class Stages:
    """Progress by stage on a terminal; in a pipe a line when a stage begins first, and every `QUIET` seconds."""

    def __init__(self) -> None:
        self.stage, self.steps, self.begin = "", 0, time.monotonic()
        self.seen: set[str] = set()
        self.printed = self.begin

    def show(self, stage: str, most: int = 0) -> None:
        """Note one step of a stage, with the most steps that it takes where they are known.

        A step of an earlier stage counts as one of the present stage: their numbers rise.
        """
        order = list(STAGES)
        anew = stage in order[:2] and self.stage in order[order.index("show") :]  # another diagnosis of a loop
        if self.stage and not anew and order.index(stage) < order.index(self.stage):
            stage, most = self.stage, 0
        self.steps = self.steps + 1 if stage == self.stage else 1
        new, self.stage = stage != self.stage, stage
        now = time.monotonic()
        elapsed, number = now - self.begin, order.index(stage) + 1
        text = f"{STAGES[stage]} ({number} of {len(STAGES)})"
        limit = f" of at most {most}" if most else ""
        if not on_terminal():
            if stage not in self.seen or now - self.printed > QUIET:
                more = f": step {self.steps}{limit}, {elapsed:.0f} s" if stage in self.seen else ""
                print(f"{text}{more}", file=sys.stderr, flush=True)
                self.printed = now
            self.seen.add(stage)
            return
        if new and elapsed > 0.5:
            end_line()
        bar = "#" * number + "." * (len(STAGES) - number)
        line(f"[{bar}] {text}: step {self.steps}{limit}, {elapsed:.0f} s")


@dataclass
class StepPrinter:
    """Printer of a loop's steps: the odds after each, and the experiment to make next."""

    plan: Path
    as_json: bool
    steps: int = 0
    waited: str = ""

    def show(self, steps: DecisionSteps) -> None:
        """Print what is new, on standard error where the result is JSON."""

        from rotorsim.discrepancy.verdict import shown_share

        stream = sys.stderr if self.as_json else sys.stdout
        if on_terminal():
            end_line()
        if len(steps.steps) > self.steps:
            self.steps, last = len(steps.steps), steps.steps[-1]
            odds = sorted(last.odds.items(), key=lambda one: -one[1])[:3]
            text = ", ".join(f"{shown_share(p)} {name}" for name, p in odds)
            print(f"step {self.steps - 1}, {steps.names[-1]}: {text}", file=stream, flush=True)
        name = str(steps.pending.get("experiment", ""))
        if name and not steps.made and name != self.waited:
            self.waited = name
            text = f"next: {name} ({steps.pending['minutes']:.0f} min); as a plan: {self.plan}"
            print(text, file=stream, flush=True)

"""`rotorsim diagnose MACHINE RECORDS`: finds the physical effect that is missing in a machine file."""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from reynolds.jit import cache_root
from rotorsim.base.cache import key_of
from rotorsim.base.constants import TO_UM
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.progress import end_line, line, on_terminal
from rotorsim.commands.completion import parameters
from rotorsim.commands.diagnosis.loop import BUDGET, WAIT, Asked, print_steps, run_loop
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson, GivenMachine, WithReport, a_folder, resumable
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import results
from rotorsim.discrepancy import Diagnosis, diagnose as find
from rotorsim.discrepancy.identifiability import alias_matrix, markdown
from rotorsim.discrepancy.odds.explanation import LEAST_SHOWN, shown_share
from rotorsim.discrepancy.outcome.files import RESULTS, save_diagnosis
from rotorsim.discrepancy.outcome.gap import reduction
from rotorsim.discrepancy.outcome.result import PLAN_NEXT
from rotorsim.discrepancy.plan.allowed import ALLOWED, check_allowed
from rotorsim.discrepancy.plan.plan import Plan

MONTH = 30 * 86400.0
"""Seconds that an interrupted diagnosis waits for the same command."""
STAGES = {
    "compile": "compiling the machine with all candidate effects, on three grids and laws: about 50 s, once",
    "check": "checking the records",
    "calibrate": "re-calibrating",
    "prove": "proving the solver",
    "screen": "screening candidates",
    "name": "re-fitting candidates",
    "show": "showing the gap",
    "plan": "planning the next experiment",
    "experiment": "waiting for the record of the experiment",
}


@example(
    "rotorsim diagnose dtu_gas_bearing puzzle/records --out diagnosis",
    "rs.diagnose('dtu_gas_bearing', 'puzzle/records')",
)
@resumable
def diagnose(
    machine: GivenMachine,
    records: Annotated[
        list[Path] | None, typer.Argument(metavar="RECORDS", help="Records to fit: files, or a folder of .nc.")
    ] = None,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", help="Record at another operating point that chooses the effect.")
    ] = None,
    untouched: Annotated[
        list[Path] | None, typer.Option("--untouched", help="Record that only shows the gap; may be repeated.")
    ] = None,
    mapping: Annotated[Path | None, typer.Option("--mapping", help="Columns of files that are not .nc.")] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            help="Only this is a candidate, e.g. runout or runout.amplitude_2x; may be repeated.",
            autocompletion=parameters,
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option("--tolerance", help="Tolerance of the model: share of a line.")] = 0.004,
    out: Annotated[
        Path | None,
        typer.Option("--out", callback=a_folder, help="Folder for the verdict; by default diagnosis, diagnosis-2, ..."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a verdict that is in the folder.")] = False,
    seed: Annotated[int, typer.Option("--seed", help="Kept with the verdict; nothing is drawn.")] = 0,
    self_test: Annotated[
        bool, typer.Option("--self-test", help="Print which effects the campaign cannot distinguish, and stop.")
    ] = False,
    plan_next: Annotated[
        bool,
        typer.Option("--plan-next", help="Rank the experiments that may come next; write the best as a plan."),
    ] = False,
    allow: Annotated[
        str | None, typer.Option("--allow", help=f"What experiments may change: {','.join(ALLOWED)}; all if not given.")
    ] = None,
    until_decided: Annotated[
        bool,
        typer.Option("--until-decided", help="Make experiments on --rig until one explanation has 95 %."),
    ] = False,
    rig: Annotated[
        str | None,
        typer.Option("--rig", help="virtual:FOLDER of 'hide', or the folder into which new records are put."),
    ] = None,
    budget: Annotated[
        str | None, typer.Option("--budget", help=f"Rig time that experiments may take; {BUDGET}.")
    ] = None,
    wait: Annotated[str | None, typer.Option("--wait", help=f"Longest time to wait for a record; {WAIT}.")] = None,
    report: WithReport = True,
    *,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Find the effect that a machine file lacks against records.

    It is written into a new machine file; the report shows the gap before and after.

    Exit code: 0 no disagreement, 10 an effect is named, 11 a tie or a partial explanation, 12 unknown, 2 bad input.
    Records of one folder may state in their attribute `role` what they are for: fit, held_out or untouched. What was
    computed is kept, so that an interrupted diagnosis resumes where it was.
    """
    if self_test:
        _self_test(machine, records, mapping, as_json)
        return
    page.check(report)
    if not records and not until_decided:
        raise DataError("diagnose: no records; name files or a folder, or give --self-test")
    if not 0 < tolerance < 1:
        raise DataError(f"--tolerance: {tolerance:g} is not a fraction; give a number between 0 and 1, e.g. 0.004")
    if allow is not None and not (plan_next or until_decided):
        raise DataError("--allow: is about a plan; give --plan-next or --until-decided too")
    allowed = check_allowed([] if allow is None else [name.strip() for name in allow.split(",")])
    if until_decided:
        asked = Asked(_rig(rig, held_out, untouched), budget, wait, allowed, tolerance, page)
        found, paths = run_loop(
            machine, records or [], mapping, effect, asked, out, force, report, Stages().show, as_json
        )
        _show(found, paths, as_json)
        raise typer.Exit(found.exit_code)
    assert records
    for option, given in (("rig", rig), ("budget", budget), ("wait", wait)):
        if given is not None:
            raise DataError(f"--{option}: is about a loop of experiments; give --until-decided too")
    with (
        results(out, "diagnosis", tuple(RESULTS.values()), force) as folder,
        _kept(machine, records, held_out, untouched, mapping, effect, tolerance) as unfinished,
    ):
        page.begin(folder / RESULTS["report"], force)
        diagnosis = find(
            machine, records, held_out, untouched, effect, seed, tolerance, mapping, progress=Stages().show,
            resume=unfinished, plan_next=allowed if plan_next else None,
        )  # fmt: skip
        files = save_diagnosis(diagnosis, folder, report)
        if report:
            files |= page.finish(files["report"])
    _show(diagnosis, files, as_json)
    raise typer.Exit(diagnosis.exit_code)


def _rig(rig: str | None, held_out: list[Path] | None, untouched: list[Path] | None) -> str:
    """The rig of a loop; raises DataError where there is none, or roles are given that new records cannot have."""
    if rig is None:
        raise DataError("--until-decided: needs --rig: virtual:FOLDER of rotorsim hide, or a folder for new records")
    if held_out or untouched:
        raise DataError("--until-decided: takes no --held-out and --untouched; state the attribute role in the records")
    return rig


def _show(diagnosis: Diagnosis, files: dict[str, str], as_json: bool) -> None:
    """The diagnosis as JSON or as text."""
    if as_json:
        typer.echo(json.dumps(diagnosis.as_dict() | {"files": files}, indent=2, default=float))
    else:
        _print(diagnosis, files)


class Stages:
    """Progress by stage on a terminal; in a pipe only that kernels are compiled."""

    def __init__(self) -> None:
        self.stage, self.steps, self.begin = "", 0, time.monotonic()

    def show(self, stage: str) -> None:
        """Note one step of a stage."""
        self.steps = self.steps + 1 if stage == self.stage else 1
        new, self.stage = stage != self.stage, stage
        if not on_terminal():
            if stage == "compile":
                print(STAGES[stage], file=sys.stderr, flush=True)
            return
        elapsed = time.monotonic() - self.begin
        if new and elapsed > 0.5:
            end_line()
        number = list(STAGES).index(stage) + 1
        bar = "#" * number + "." * (len(STAGES) - number)
        line(f"[{bar}] {STAGES[stage]}: step {self.steps}, {elapsed:.0f} s")


@contextmanager
def _kept(*asked: Any) -> Iterator[Path]:
    """Where this diagnosis keeps what it computes, in the cache: until its end, or for a month if it is interrupted."""
    root = cache_root() / "diagnoses"
    folder = root / key_of(Path.cwd(), asked)
    for old in root.iterdir() if root.exists() else ():
        if time.time() - old.stat().st_mtime > MONTH:
            shutil.rmtree(old, ignore_errors=True)
    try:
        yield folder
    except RotorsimError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)


def _print(diagnosis: Diagnosis, files: dict[str, str]) -> None:
    end_line()
    print_steps(diagnosis)
    typer.echo(diagnosis.sentence)
    for one in diagnosis.explanations[:4]:
        if one.probability >= LEAST_SHOWN:
            typer.echo(f"  probability {shown_share(one.probability)}: {one.name}")
    for found in diagnosis.effects:
        numbers = (f"{p} = {value}" + (f" +- {sd}" if sd else "") for p, value, sd in found.sizes())
        typer.echo(f"  {found.form}: {', '.join(numbers)}")
        others = [k for k in found.tie_class if k != found.form]
        if others:
            typer.echo(f"    no record distinguishes it from: {', '.join(others)}")
    for flag in diagnosis.localisation[:6]:
        typer.echo(
            f"  {flag.record} ({flag.point}), {flag.channel}, {flag.group}: {flag.rms * TO_UM:.3g} um over a floor of "
            f"{flag.floor * TO_UM:.2g} um" + (f", largest {flag.place}" if flag.place else "")
        )
    share = reduction(diagnosis.gap)
    if diagnosis.effects and share == share:
        typer.echo(f"  gap on untouched records, re-calibrated to with effect: {100 * share:.0f} % gone")
    if diagnosis.unknown:
        for line in diagnosis.unknown["lines"][:3]:
            typer.echo(
                f"  equivalent force {line['force_n']:.3g} N at {line['frequency_hz']:.4g} Hz, {line['direction']}, "
                f"{line['point']}"
            )
    if diagnosis.unplanned:
        typer.echo(PLAN_NEXT)
    if diagnosis.planned is not None:
        _print_plan(diagnosis.planned)
    for note in diagnosis.notes:
        typer.echo(f"  note: {note}")
    for kind, path in files.items():
        typer.echo(f"{kind}: {path}")


def _print_plan(plan: Plan) -> None:
    """The sentence and the best five experiments."""
    typer.echo(plan.sentence)
    for line_ in plan.unbreakable:
        typer.echo(f"  {line_}")
    for one in plan.proposals[:5]:
        typer.echo(
            f"  {one.option.name}: {one.option.minutes:.0f} min, {one.outlook.entropy:.2f} bit left, "
            f"{100 * one.outlook.decided:.0f} % chance of 95 %"
        )


def _self_test(machine: str, records: list[Path] | None, mapping: Path | None, as_json: bool) -> None:
    matrix = alias_matrix(machine, records or None, mapping, Stages().show)
    end_line()
    typer.echo(json.dumps(matrix.as_dict(), indent=2) if as_json else markdown(matrix))

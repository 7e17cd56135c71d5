"""`rotorsim diagnose MACHINE RECORDS`: finds the physical effect that is missing in a machine file."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.cache import in_cache, key_of
from rotorsim.base.display import end_line
from rotorsim.base.errors import RotorsimError
from rotorsim.commands.diagnosis.options import DataOptions, ExperimentOptions
from rotorsim.commands.diagnosis.output import Stages, StepPrinter, show
from rotorsim.commands.options import AsJson, GivenMachine, PageOptions, WithReport, a_folder, resumable
from rotorsim.commands.registry import command
from rotorsim.commands.results import results

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis

FOLDER = Path("decision")
"""Folder of a loop when none is given; one name, so that the same command resumes."""
MONTH = 30 * 86400.0
"""Time [s] for which an interrupted diagnosis waits for the same command."""


@command(
    "diagnose",
    "rotorsim diagnose dtu_gas_bearing puzzle/records --out diagnosis",
    "rs.diagnose('dtu_gas_bearing', 'puzzle/records')",
)
@resumable
def diagnose(
    machine: GivenMachine,
    data: DataOptions,
    out: Annotated[
        Path | None,
        typer.Option("--out", callback=a_folder, help="Folder for the verdict; by default diagnosis, diagnosis-2, ..."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a verdict that is in the folder.")] = False,
    seed: Annotated[int, typer.Option("--seed", help="Kept with the verdict; nothing is drawn.")] = 0,
    self_test: Annotated[
        bool, typer.Option("--self-test", help="Print which effects the campaign cannot distinguish, and stop.")
    ] = False,
    *,
    experiments: ExperimentOptions,
    report: WithReport = True,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Find the effect that a machine file lacks against records.

    It is written into a new machine file; the report shows the gap before and after.

    Exit code: 0 no disagreement, 10 an effect is named, 11 a tie or a partial explanation, 12 unknown, 2 bad input.
    Records of one folder may state in their attribute `role` what they are for: fit, held_out or untouched. What was
    computed is kept, so that an interrupted diagnosis resumes where it was.
    """
    from rotorsim.machine import load_machine

    if self_test:
        _self_test(machine, data, as_json)
        return
    page.check(report)
    data.check(records=not experiments.until_decided)
    experiments.check(roles=bool(data.held_out or data.untouched))
    load_machine(machine)  # refused here, before anything that computes is loaded
    if experiments.until_decided:
        found, files = run_loop(machine, data, experiments, out, force, report, page, Stages().show, as_json)
    else:
        allow = experiments.allowed if experiments.plan_next else None
        found, files = _diagnosed(machine, data, allow, out, force, seed, report, page)
    show(found, files, as_json)
    raise typer.Exit(found.exit_code)


def _diagnosed(
    machine: str, data: DataOptions, allow: tuple[str, ...] | None, out: Path | None, force: bool, seed: int,
    report: bool, page: PageOptions,
) -> tuple[Diagnosis, dict[str, str]]:  # fmt: skip
    """The diagnosis, with a plan of experiments that change what `allow` names, and its files."""
    from rotorsim.discrepancy import diagnose as diagnose_records, save_diagnosis
    from rotorsim.discrepancy.files import RESULTS

    given = (data.records, data.held_out, data.untouched, data.mapping, data.effect, data.tolerance)
    with results(out, "diagnosis", tuple(RESULTS.values()), force) as folder, unfinished(machine, *given) as kept:
        page.begin(folder / RESULTS["report"], force)
        found = diagnose_records(
            machine, data.records or (), data.held_out, data.untouched, data.effect, seed, data.tolerance,
            data.mapping, progress=Stages().show, resume=kept, plan_next=allow,
        )  # fmt: skip
        files = save_diagnosis(found, folder, report)
        if report:
            files |= page.finish(files["report"])
    return found, files


def _self_test(machine: str, data: DataOptions, as_json: bool) -> None:
    """Print how alike effects are under the records, or under the campaign of `hide`."""
    from rotorsim.discrepancy import alias_matrix, markdown

    matrix = alias_matrix(machine, data.records or None, data.mapping, Stages().show)
    end_line()
    typer.echo(json.dumps(matrix.as_dict(), indent=2) if as_json else markdown(matrix))


def run_loop(
    machine: str, data: DataOptions, experiments: ExperimentOptions, out: Path | None, force: bool, report: bool,
    page: PageOptions, progress: Callable[[str], None], as_json: bool,
) -> tuple[Diagnosis, dict[str, str]]:  # fmt: skip
    """The last diagnosis of a loop of experiments, and its files."""
    from rotorsim.discrepancy import decide, save_diagnosis
    from rotorsim.discrepancy.decision import FILE
    from rotorsim.discrepancy.files import RESULTS
    from rotorsim.machine import load_machine

    folder, loaded = out or FOLDER, load_machine(machine)
    budget, rig = experiments.budget_minutes, experiments.open_rig(loaded)
    with results(folder, str(FOLDER), (*RESULTS.values(), FILE), force or (folder / FILE).exists()) as place:
        page.begin(place / RESULTS["report"], True)
        found = decide(
            loaded, rig, budget, data.records or (), experiments.allowed, data.effect, out=place, mapping=data.mapping,
            progress=progress, shown=StepPrinter(place / RESULTS["plan"], as_json).show, tolerance=data.tolerance,
            anew=force,
        )  # fmt: skip
        files = save_diagnosis(found, place, report)
        if report:
            files |= page.finish(files["report"])
    return found, files | {"steps": str(place / FILE)}


@contextmanager
def unfinished(*asked: Any) -> Iterator[Path]:
    """Folder in the cache by which an interrupted diagnosis resumes: until its end, or for a month."""
    root = in_cache("diagnoses")
    folder = root / key_of(Path.cwd(), asked)
    for old in root.iterdir():
        if time.time() - old.stat().st_mtime > MONTH:
            shutil.rmtree(old, ignore_errors=True)
    try:
        yield folder
    except RotorsimError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)

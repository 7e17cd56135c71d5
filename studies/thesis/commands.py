"""Commands of the study of the thesis: the whole circle, designs on a model, experiments on single claims."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from identification import load_model
from identification.lpv_model import LpvModel
from rotorsim.base.cache import key_of
from rotorsim.base.display import line
from rotorsim.base.errors import DataError
from rotorsim.base.files import replacing_all, write_json, write_text
from rotorsim.commands.options import AsJson, Jobs, MachineName, PageOptions, StudyFolder, plant_of, resumable
from rotorsim.commands.registry import example
from rotorsim.commands.results import refuse_campaign, study as study_folder
from rotorsim.plant import Plant
from rotorsim.report.page import save_study_page
from studies.thesis.cached_cases import Progress
from studies.thesis.claims.control_numbers import control_left_out, control_numbers
from studies.thesis.claims.edited import edited, edited_block, edited_markdown
from studies.thesis.claims.judge import Judged
from studies.thesis.claims.rules import as_run
from studies.thesis.claims.verdicts import claims_blocks, lines, plain, tally, verdicts
from studies.thesis.control_study import control_study
from studies.thesis.experiments import pages as experiment_pages
from studies.thesis.experiments.run import run_experiments
from studies.thesis.experiments.table import chosen_experiments
from studies.thesis.page import control_blocks
from studies.thesis.whole_study import whole_study

RESULTS = ("experiments.md", "experiments.json", "report.html")
"""Files in the folder."""


@example(
    "python studies/thesis/designs.py model_2.json --out control",
    "control_study(plant, rs.load_model('model_2.json'), Path('control'), print)",
)
@resumable
def designs(
    model: Annotated[Path, typer.Argument(help="LPV model that 'rotorsim identify' wrote, best Model 2.")],
    machine: MachineName = "dtu_gas_bearing",
    out: StudyFolder = Path("control"),
    jobs: Jobs = 2,
    *,
    page: PageOptions,
    quick: Annotated[bool, typer.Option("--quick", help="Without LPV synthesis and full verification.")] = False,
    as_json: AsJson = False,
) -> None:
    """Design every controller on a model, verify them on the nonlinear plant and fill the claims C1 to C12."""
    page.check()
    refuse_campaign(out)
    loaded = load_model(model)
    if not isinstance(loaded, LpvModel):
        raise DataError(f"{model}: holds for one operating point; give a model of several, e.g. from a campaign")
    plant = plant_of(machine)
    identified = key_of(json.dumps(loaded.to_dict(), sort_keys=True))
    with study_folder(out, _inputs("control", plant, quick) | {"model": identified}):
        found = control_study(plant, loaded, out / "stages", stage_bar(), jobs, quick)
        claims = verdicts(control_numbers(found, loaded), "C", control_left_out(found))
        changes = edited(out)
        blocks = [*edited_block(changes), *claims_blocks(claims, "Claims on control"), *control_blocks(found)]
        numbers = {"claims": plain(claims), "count": tally(claims), "refused": found.refused, "rules_edited": changes}
        title, text = f"Control of {plant.machine.name}", "Designs on the identified model, runs of the plant."
        with replacing_all(out, ("report.html", "control.json")) as part:
            save_study_page(title, text, blocks, part / "report.html", page.units)
            write_json(part / "control.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    print_claims(claims, changes)
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results")


@example(
    "python studies/thesis/whole.py --out study",
    "whole_study(plant, Path('study'), print)",
)
@resumable
def whole(
    machine: MachineName = "dtu_gas_bearing",
    out: StudyFolder = Path("study"),
    jobs: Jobs = 2,
    *,
    page: PageOptions,
    quick: Annotated[
        bool, typer.Option("--quick", help="A grid of 3 x 3 points, no LPV synthesis, no full verification.")
    ] = False,
    as_shipped: Annotated[
        bool,
        typer.Option("--as-shipped", help="Machine files as they are, quieter and steadier than the thesis' rig was."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """The whole circle: campaign, identification, designs, verification, every claim; resumes where it stopped."""
    page.check()
    refuse_campaign(out)
    plant = plant_of(machine)
    if not as_shipped and plant.machine.actuators is not None:
        plant = Plant(as_run(plant.machine))
    with study_folder(out, _inputs("whole", plant, quick)):
        found = whole_study(plant, out, stage_bar(), jobs, quick, as_shipped)
        numbers = {"claims": plain(found.claims), "count": tally(found.claims), "rules_edited": found.edited,
                   "targets": found.targets, "refused": found.control.refused, "seconds": found.seconds,
                   "report": str(out / "report.html")}  # fmt: skip
        write_json(out / "study.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    print_claims(found.claims, found.edited)
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results; {out / 'study.json'}: numbers")


def _inputs(kind: str, plant: Plant, quick: bool) -> dict[str, str]:
    """Inputs that a study follows from."""
    return {"kind": kind, "machine": plant.machine.hash, "grid": "quick" if quick else "whole"}


@example(
    "python studies/thesis/one_number.py --only I9 --out experiments",
    "run_experiments(machine, chosen_experiments(['I9']), Path('experiments'), print)",
)
@resumable
def one_number(
    machine: MachineName = "dtu_gas_bearing",
    out: StudyFolder = Path("experiments"),
    only: Annotated[
        list[str] | None,
        typer.Option("--only", help="A claim, e.g. I9, or the name of an experiment on one; may be repeated."),
    ] = None,
    jobs: Jobs = 2,
    *,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Claims not met: change one number of the machine at a time and measure their figures again.

    Each such series is an experiment on a claim. A single virtual test is 'rotorsim experiment', a plan of many
    'rotorsim campaign'.
    """
    page.check()
    refuse_campaign(out)
    wanted, plant = chosen_experiments(only or []), plant_of(machine)
    with study_folder(out, {"kind": "experiments", "machine": plant.machine.hash}):
        found = run_experiments(plant.machine, wanted, out / "stages", stage_bar(), jobs)
        numbers = {"machine": plant.machine.name, "experiments": experiment_pages.plain(found)}
        text = "One number of the machine changed at a time; verdicts by the rules of the claims."
        with replacing_all(out, RESULTS) as part:
            write_text(part / "experiments.md", experiment_pages.markdown(found, plant.machine))
            write_json(part / "experiments.json", numbers)
            title = f"Experiments on {plant.machine.name}"
            blocks = experiment_pages.blocks(found, plant.machine)
            save_study_page(title, text, blocks, part / "report.html", page.units)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    for one in found:
        typer.echo(f"{', '.join(one.experiment.claims)}: {one.experiment.words}")
        for row in experiment_pages.rows(one):
            typer.echo(f"     {row[0]}: {row[2]} here, {row[3]}; thesis {row[1]}, at {row[5]}")
        for factor, why in one.failed.items():
            typer.echo(f"     x {factor:g}: no numbers: {why}")
    typer.echo(f"{out / 'report.html'}: report; {out / 'experiments.md'}: tables; {out / 'experiments.json'}: numbers")


def stage_bar() -> Progress:
    """One-line progress of the stages."""
    return lambda name, done, of: line(f"{done} of {of}: {name}", done == of)


def print_claims(claims: list[Judged], edited: list[str]) -> None:
    """Print which rules were edited since the first run, the verdicts, the figures behind them and their count."""
    print(edited_markdown(edited) + "\n".join(lines(claims)))

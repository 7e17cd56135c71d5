"""`rotorsim study control` and `rotorsim study whole`: designs on a model, verification, the thesis' claims."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from identification import load_model
from identification.lpv.model import LpvModel
from rotorsim.base.cache import key_of
from rotorsim.base.errors import DataError
from rotorsim.base.file_set import replacing_all
from rotorsim.base.files import write_json
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson, MachineName, a_folder, plant_of, resumable
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import refuse_campaign, study as study_folder
from rotorsim.commands.study.output import print_claims, stage_bar
from rotorsim.plant import Plant
from rotorsim.reproduction.claims.control_numbers import control_left_out, control_numbers
from rotorsim.reproduction.claims.edited import edited, edited_block
from rotorsim.reproduction.claims.verdicts import claims_blocks, plain, verdicts
from rotorsim.reproduction.control import control_study

Out = Annotated[
    Path, typer.Option("--out", callback=a_folder, help="Folder of laws, results and report; a study there is resumed.")
]
Jobs = Annotated[int, typer.Option("--jobs", min=1, help="Processes.")]


@example(
    "rotorsim study control model_2.json dtu_gas_bearing --out control",
    "rs.reproduction.control_study(plant, rs.load_model('model_2.json'), Path('control'))",
)
@resumable
def control(
    model: Annotated[Path, typer.Argument(help="LPV model that 'rotorsim identify' wrote, best Model 2.")],
    machine: MachineName = "dtu_gas_bearing",
    out: Out = Path("control"),
    jobs: Jobs = 2,
    *,
    page: PageOptions,
    quick: Annotated[bool, typer.Option("--quick", help="Without LPV synthesis and full verification.")] = False,
    as_json: AsJson = False,
) -> None:
    """Design every controller on a model, verify them on the nonlinear plant and fill the claims C1 to C12."""
    from rotorsim.report.pages.study import save_study_page
    from rotorsim.reproduction.page import control_blocks

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
        numbers = {"claims": plain(claims), "refused": found.refused, "rules_edited": changes}
        title, text = f"Control of {plant.machine.name}", "Designs on the identified model, runs of the plant."
        with replacing_all(out, ("report.html", "control.json")) as part:
            save_study_page(title, text, blocks, part / "report.html")
            write_json(part / "control.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    print_claims(claims, changes)
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results")


@example(
    "rotorsim study whole dtu_gas_bearing --out study",
    "rs.reproduction.whole_study(plant, Path('study'), progress)",
)
@resumable
def whole(
    machine: MachineName = "dtu_gas_bearing",
    out: Out = Path("study"),
    jobs: Jobs = 2,
    *,
    page: PageOptions,
    quick: Annotated[
        bool, typer.Option("--quick", help="A grid of 3 x 3 points, no LPV synthesis, no full verification.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """The whole circle: campaign, identification, designs, verification, every claim; resumes where it stopped."""
    from rotorsim.reproduction.whole import whole_study

    page.check()
    refuse_campaign(out)
    plant = plant_of(machine)
    with study_folder(out, _inputs("whole", plant, quick)):
        found = whole_study(plant, out, stage_bar(), jobs, quick)
        numbers = {"claims": plain(found.claims), "rules_edited": found.edited, "targets": found.targets,
                   "refused": found.control.refused, "seconds": found.seconds,
                   "report": str(out / "report.html")}  # fmt: skip
        write_json(out / "study.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    print_claims(found.claims, found.edited)
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results; {out / 'study.json'}: numbers")


def _inputs(kind: str, plant: Plant, quick: bool) -> dict[str, str]:
    """What a study follows from."""
    return {"kind": kind, "machine": plant.machine.hash, "grid": "quick" if quick else "whole"}

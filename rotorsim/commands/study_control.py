"""`rotorsim study control` and `rotorsim study whole`: every design on a model, verified, and the thesis' claims."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.commands.options import AsJson, MachineName, a_folder, resumable

EXAMPLE = "Example: rotorsim study control model_2.json dtu_gas_bearing --out control"
WHOLE_EXAMPLE = "Example: rotorsim study whole dtu_gas_bearing --out study"
Out = Annotated[
    Path, typer.Option("--out", callback=a_folder, help="Folder of laws, results and report; a study there goes on.")
]
Jobs = Annotated[int, typer.Option("--jobs", min=1, help="Processes.")]


@resumable
def control(
    model: Annotated[Path, typer.Argument(help="LPV model that 'rotorsim identify' wrote, best Model 2.")],
    machine: MachineName = "dtu_gas_bearing",
    out: Out = Path("control"),
    jobs: Jobs = 2,
    quick: Annotated[bool, typer.Option("--quick", help="Without LPV synthesis and full verification.")] = False,
    as_json: AsJson = False,
) -> None:
    """Design every controller on a model, verify them on the nonlinear plant and fill the claims C1 to C12."""
    from identification import ModelError, load_model
    from identification.lpv import LpvModel
    from rotorsim.commands.options import make_plant
    from rotorsim.commands.study_told import print_claims, stage_bar
    from rotorsim.errors import DataError
    from rotorsim.report.study_page import save_study_page
    from rotorsim.study.control import control_study
    from rotorsim.study.control_claims import control_claims
    from rotorsim.study.page import claims_block, control_blocks

    try:
        loaded = load_model(model)
    except ModelError as error:
        raise DataError(str(error)) from error
    if not isinstance(loaded, LpvModel):
        raise DataError(f"{model}: holds for one operating point; give a model of several, e.g. from a campaign")
    plant = make_plant(machine, None, None, [])
    found = control_study(plant, loaded, out / "stages", stage_bar(), jobs, quick)
    claims = control_claims(found, loaded)
    blocks = [claims_block(claims, "Claims on control"), *control_blocks(found)]
    save_study_page(f"Control of {plant.machine.name}", "Designs on the identified model, runs of the plant.", blocks,
                    out / "report.html")  # fmt: skip
    told = {"claims": [asdict(c) for c in claims], "refused": found.refused}
    (out / "control.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(told, indent=2))
        return
    print_claims(claims)
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results")


@resumable
def whole(
    machine: MachineName = "dtu_gas_bearing",
    out: Out = Path("study"),
    jobs: Jobs = 2,
    quick: Annotated[
        bool, typer.Option("--quick", help="A grid of 3 x 3 points, no LPV synthesis, no full verification.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """The whole circle: campaign, identification, designs, verification, every claim; goes on where it stopped."""
    from rotorsim.commands.data import sentences
    from rotorsim.commands.options import make_plant
    from rotorsim.commands.study_told import print_claims, stage_bar
    from rotorsim.study.whole import whole_study

    plant = make_plant(machine, None, None, [])
    with sentences():
        found = whole_study(plant, out, stage_bar(), jobs, quick)
    told = {"claims": [asdict(c) for c in found.claims], "targets": found.targets, "refused": found.control.refused,
            "seconds": found.seconds, "report": str(out / "report.html")}  # fmt: skip
    (out / "study.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(told, indent=2))
        return
    print_claims(found.claims)
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results; {out / 'study.json'}: numbers")

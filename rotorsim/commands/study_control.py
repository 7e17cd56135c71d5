"""`rotorsim study control` and `rotorsim study whole`: every design on a model, verified, and the thesis' claims."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.commands.options import AsJson, MachineName

EXAMPLE = "Example: rotorsim study control model.json dtu_gas_bearing --out control"
WHOLE_EXAMPLE = "Example: rotorsim study whole dtu_gas_bearing --out study"
Out = Annotated[Path, typer.Option("--out", help="Folder of laws, results and report; a study there goes on.")]


def control(
    model: Annotated[Path, typer.Argument(help="LPV model that 'rotorsim identify' wrote.")],
    machine: MachineName = "dtu_gas_bearing",
    out: Out = Path("control"),
    as_json: AsJson = False,
) -> None:
    """Design every controller on a model, verify them on the nonlinear plant and fill the claims C1 to C12."""
    from identification import ModelError, load_model
    from identification.lpv import LpvModel
    from rotorsim.commands.options import make_plant
    from rotorsim.errors import DataError
    from rotorsim.report.study_page import Block, save_study_page
    from rotorsim.study.control import control_study
    from rotorsim.study.control_claims import control_claims

    try:
        loaded = load_model(model)
    except ModelError as error:
        raise DataError(str(error)) from error
    if not isinstance(loaded, LpvModel):
        raise DataError(f"{model}: holds for one operating point; give a model of several, e.g. from a campaign")
    plant = make_plant(machine, None, None, [])
    tell = (lambda step: print(f"{step} ...", file=sys.stderr)) if sys.stderr.isatty() else None
    found = control_study(plant, loaded, out / "stages", tell)
    claims = control_claims(found, loaded)
    rows = [(c.number, c.claim, c.thesis, c.ours, c.verdict, c.why) for c in claims]
    heads = ("", "claim", "thesis", "here", "verdict", "why")
    refused = [(name, why) for name, why in found.refused.items()]
    blocks = [Block("Claims on control", "", heads, rows), Block("Hits", "Energies over those of the open loop.",
              ("law", "x", "y", "worst", "effort x, y [V/N]"), _energies(found))]  # fmt: skip
    if refused:
        blocks.append(Block("Refused designs", "", ("design", "why"), refused))
    save_study_page(f"Control of {plant.machine.name}", "Designs on the identified model, runs of the plant.", blocks,
                    out / "report.html")  # fmt: skip
    told = {"claims": [asdict(c) for c in claims], "refused": found.refused}
    (out / "control.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(told, indent=2))
        return
    for c in claims:
        typer.echo(f"{c.number:4s} {c.verdict:8s} {c.claim}: {c.ours}")
    typer.echo(f"{out / 'report.html'}: report; {out / 'stages'}: laws and results")


def whole(machine: MachineName = "dtu_gas_bearing", out: Out = Path("study"), as_json: AsJson = False) -> None:
    """The whole circle: campaign, identification, designs, verification, every claim; goes on where it stopped."""
    from typer.main import get_command

    from rotorsim.commands.study import app

    told = ["--json"] if as_json else []
    arguments = ["identification-vs-physics", machine, "--out", str(out), *told]
    get_command(app)(args=arguments, prog_name="rotorsim study", standalone_mode=False)
    control(out / "model.json", machine, out / "control", as_json)


def _energies(found: object) -> list[tuple[str, ...]]:
    from rotorsim.study.control import ControlStudy

    assert isinstance(found, ControlStudy)
    rows: list[tuple[str, ...]] = []
    for name in found.impacts:
        if name != "open loop":
            ratio, effort = found.ratio(name), found.effort(name)
            rows.append((name, f"{ratio[:, 0].mean():.3f}", f"{ratio[:, 1].mean():.3f}", f"{ratio.max():.3f}",
                         f"{effort[0]:.3f}, {effort[1]:.3f}"))  # fmt: skip
    return rows

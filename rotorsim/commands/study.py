"""`rotorsim study identification-vs-physics`: campaign, models of its records, the linearised physics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.analysis import read_axis
from rotorsim.base.file_set import replacing_all
from rotorsim.base.files import write_json
from rotorsim.base.progress import counter
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson, MachineName, a_folder, plant_of, resumable
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import refuse_campaign, study as study_folder
from rotorsim.report.page.page import save_study_page
from rotorsim.study.identification_vs_physics import study
from rotorsim.study.page import identification_blocks
from rotorsim.study.plans import COUNTED, QUICK, Layout, run
from rotorsim.study.sources import sources_of
from rotorsim.study.table import HEADS, rows, summary

RESULTS = ("model.json", "model_2.json", "report.html", "study.json")
"""Files in the folder; where the last is, the others are complete."""


@example(
    "rotorsim study identification-vs-physics dtu_gas_bearing --out study --quick",
    "rs.study.study(plant, rs.study.sources_of(['study']))",
)
@resumable
def identification_vs_physics(
    machine: MachineName = "dtu_gas_bearing",
    out: Annotated[
        Path, typer.Option("--out", callback=a_folder, help="Folder for records, tables and report.")
    ] = Path("study"),
    campaign: Annotated[
        list[Path] | None,
        typer.Option("--campaign", help="Folder of a campaign of this machine to use; may be repeated."),
    ] = None,
    speed: Annotated[str | None, typer.Option("--speed", help="Speeds, e.g. '0 rpm:6000 rpm:7'.")] = None,
    pressure: Annotated[str | None, typer.Option("--pressure", help="Gauge supply pressures, likewise.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A grid of 3 x 3 points only.")] = False,
    *,
    page: PageOptions,
    surfaces: Annotated[int, typer.Option("--surfaces", help="Degree of the surfaces.")] = 2,
    jobs: Annotated[int, typer.Option("--jobs", help="Records at a time.")] = 2,
    as_json: AsJson = False,
) -> None:
    """Simulate a campaign, identify models from its records alone and hold them against the linearised physics.

    The records are campaigns below --out; they are kept, and the same command continues with them.
    """
    page.check()
    refuse_campaign(out)
    plant, layout = plant_of(machine), _layout(quick, speed, pressure)
    records = [str(folder.absolute()) for folder in campaign or []]
    inputs = {"kind": "identification", "machine": plant.machine.hash, "records": records, "surfaces": surfaces}
    with study_folder(out, inputs | {"grid": repr(layout)}):
        sources = sources_of(campaign or run(plant.machine, layout, out, jobs))
        total = sum(source.role in COUNTED for source in sources)
        found = study(plant, sources, jobs, surfaces, counter(total, "operating points"))
        numbers = {"errors": summary(found), "heads": HEADS, "rows": rows(found), "rows_model_2": rows(found, "2"),
                   "failed": found.failed}  # fmt: skip
        with replacing_all(out, RESULTS) as part:
            found.refined.save(part / "model.json")
            found.lpv_2.save(part / "model_2.json")
            text = f"{plant.machine.name}, virtual records only. This is a simulation."
            save_study_page("Identification against physics", text, identification_blocks(found), part / "report.html")
            write_json(part / "study.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps({key: numbers[key] for key in ("errors", "failed")}, indent=2))
        return
    for model, errors in summary(found).items():
        typer.echo(f"{model} against the physics: " + ", ".join(f"{name} {v:.2g} %" for name, v in errors.items()))
    typer.echo(f"{out / 'report.html'}: report; {out / 'model.json'}: LPV model (Model 3), {out / 'model_2.json'}: "
               f"Model 2; {out / 'study.json'}: numbers")  # fmt: skip


def _layout(quick: bool, speed: str | None, pressure: str | None) -> Layout:
    """Grid of operating points, with the speeds and pressures that are given instead of the usual ones."""
    usual = QUICK if quick else Layout()
    speeds = usual.speeds if speed is None else tuple(float(v) for v in read_axis("speed", speed, "rad/s"))
    pressures = usual.pressures if pressure is None else tuple(float(v) for v in read_axis("pressure", pressure, "Pa"))
    return Layout(speeds, pressures)

"""`rotorsim study experiments`: figures of claims that are not met, as functions of one number of the machine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.file_set import replacing_all
from rotorsim.base.files import write_json, write_text
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson, MachineName, a_folder, plant_of, resumable
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import refuse_campaign, study as study_folder
from rotorsim.commands.study.output import stage_bar
from rotorsim.reproduction.experiments.pages import blocks, markdown, plain, rows
from rotorsim.reproduction.experiments.run import run_experiments
from rotorsim.reproduction.experiments.table import chosen_experiments

RESULTS = ("experiments.md", "experiments.json", "report.html")
"""Files in the folder."""


@example(
    "rotorsim study experiments dtu_gas_bearing --only I9 --out experiments",
    "rs.reproduction.run_experiments(machine, rs.reproduction.chosen_experiments(['I9']), Path('experiments'), print)",
)
@resumable
def experiments(
    machine: MachineName = "dtu_gas_bearing",
    out: Annotated[
        Path, typer.Option("--out", callback=a_folder, help="Folder of the results, which are kept.")
    ] = Path("experiments"),
    only: Annotated[
        list[str] | None,
        typer.Option("--only", help="A claim, e.g. I9, or the name of an experiment on one; may be repeated."),
    ] = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Processes.")] = 2,
    *,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Claims not met: change one number of the machine at a time and measure their figures again.

    Each such series is an experiment on a claim. A single virtual test is 'rotorsim experiment', a plan of many
    'rotorsim campaign'.
    """
    from rotorsim.report.pages.study import save_study_page

    page.check()
    refuse_campaign(out)
    wanted, plant = chosen_experiments(only or []), plant_of(machine)
    with study_folder(out, {"kind": "experiments", "machine": plant.machine.hash}):
        found = run_experiments(plant.machine, wanted, out / "stages", stage_bar(), jobs)
        numbers = {"machine": plant.machine.name, "experiments": plain(found)}
        text = "One number of the machine changed at a time; verdicts by the rules of the claims."
        with replacing_all(out, RESULTS) as part:
            write_text(part / "experiments.md", markdown(found, plant.machine))
            write_json(part / "experiments.json", numbers)
            title = f"Experiments on {plant.machine.name}"
            save_study_page(title, text, blocks(found, plant.machine), part / "report.html")
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps(numbers, indent=2))
        return
    for one in found:
        typer.echo(f"{', '.join(one.experiment.claims)}: {one.experiment.words}")
        for row in rows(one):
            typer.echo(f"     {row[0]}: {row[2]} here, {row[3]}; thesis {row[1]}, at {row[5]}")
        for factor, why in one.failed.items():
            typer.echo(f"     x {factor:g}: no numbers: {why}")
    typer.echo(f"{out / 'report.html'}: report; {out / 'experiments.md'}: tables; {out / 'experiments.json'}: numbers")

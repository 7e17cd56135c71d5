"""`rotorsim study identification-vs-physics`: campaign, identification, comparison, claims and report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.file_set import replacing_all
from rotorsim.base.files import write_json
from rotorsim.base.progress import counter
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import MachineName, a_folder, plant_of, resumable
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import refuse_campaign, study as study_folder
from rotorsim.commands.study.output import numbers_of, print_claims, write_page
from rotorsim.reproduction.claims.edited import edited
from rotorsim.reproduction.claims.identification_numbers import identification_left_out, identification_numbers
from rotorsim.reproduction.claims.judge import MET, NOT_MET
from rotorsim.reproduction.claims.targets import targets
from rotorsim.reproduction.claims.verdicts import verdicts
from rotorsim.reproduction.identification_vs_physics import study
from rotorsim.reproduction.plans import COUNTED, QUICK, Layout, run
from rotorsim.reproduction.sources import sources_of

HYSTERESIS = "I13"
"""Claim on the actuators, which only `study whole` makes."""
RESULTS = ("model.json", "model_2.json", "report.html", "study.json")
"""Files in the folder; where the last is, the others are complete."""


@example(
    "rotorsim study identification-vs-physics dtu_gas_bearing --out study --quick",
    "rs.reproduction.study(plant, rs.reproduction.sources_of(['study']))",
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
    quick: Annotated[bool, typer.Option("--quick", help="A grid of 3 x 3 points only.")] = False,
    *,
    page: PageOptions,
    surfaces: Annotated[int, typer.Option("--surfaces", help="Degree of the surfaces.")] = 2,
    jobs: Annotated[int, typer.Option("--jobs", help="Records at a time.")] = 2,
    as_json: Annotated[bool, typer.Option("--json", help="Print claims and errors as JSON.")] = False,
) -> None:
    """Simulate a campaign, identify models from its records alone and hold them against the linearised physics.

    The records are campaigns below --out; they are kept, and the same command continues with them.
    """
    page.check()
    refuse_campaign(out)
    plant = plant_of(machine)
    records = [str(folder.absolute()) for folder in campaign or []]
    inputs = {"kind": "identification", "machine": plant.machine.hash, "records": records, "surfaces": surfaces}
    with study_folder(out, inputs | {"grid": "quick" if quick else "whole"}):
        folders = campaign or run(plant.machine, QUICK if quick else Layout(), out, jobs)
        sources = sources_of(folders)
        total = sum(source.role in COUNTED for source in sources)
        found = study(plant, sources, jobs, surfaces, counter(total, "operating points"))
        left_out = {HYSTERESIS, *identification_left_out(found)}
        claims, reached = verdicts(identification_numbers(found), "I", left_out), targets(found)
        changes = edited(out)
        numbers = numbers_of(found, claims, reached) | {"rules_edited": changes}
        with replacing_all(out, RESULTS) as part:
            found.refined.save(part / "model.json")
            found.lpv_2.save(part / "model_2.json")
            write_page(found, claims, reached, part / "report.html", plant.machine.name, changes)
            write_json(part / "study.json", numbers)
        page.finish(out / "report.html")
    if as_json:
        typer.echo(json.dumps({key: numbers[key] for key in ("errors", "claims", "rules_edited", "targets")}, indent=2))
        return
    print_claims(claims, changes)
    for target in reached:
        typer.echo(f"{MET if target.met else NOT_MET:8s} {target.figure}: {target.value:.3g} {target.unit} "
                   f"({target.bound:g}); {target.remark}")  # fmt: skip
    typer.echo(f"{out / 'report.html'}: report; {out / 'model.json'}: LPV model (Model 3), {out / 'model_2.json'}: "
               f"Model 2; {out / 'study.json'}: numbers")  # fmt: skip

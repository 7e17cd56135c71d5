"""`rotorsim sweep`: quantities for design over values of the machine file, over speed and supply pressure."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from rotorsim.commands.campaign import RunOptions
from rotorsim.commands.options import (
    FED,
    Console,
    GivenMachine,
    GridOptions,
    PageOptions,
    WithReport,
    a_folder,
    note_compiling,
    print_json,
    quantity,
)
from rotorsim.commands.registry import command
from rotorsim.commands.results import results

if TYPE_CHECKING:
    from rotorsim.analysis import SweepResult
    from rotorsim.campaign.run import CampaignOutcome

REPORT, CAMPAIGN, SUPPLY = "report.html", "campaign", "0.5 MPa"


@command(
    "sweep",
    "rotorsim sweep dtu_gas_bearing --over 'bearings.1.clearance=20 um:30 um:5' --over 'pressure=0.3 MPa:0.7 MPa:5' "
    "--what lift_off,onset,flow --out my_sweep",
    "rs.analysis.sweep(machine, {'bearings.1.clearance': '20 um:30 um:5'}, ('lift_off', 'onset', 'flow'))",
)
def sweep(
    machine: GivenMachine,
    over: Annotated[
        list[str] | None,
        typer.Option(help="Axis PATH=FROM:TO:COUNT, PATH=A,B or PATH=-10%:+10%:5; PATH may be speed or pressure."),
    ] = None,
    what: Annotated[
        str, typer.Option(help="Quantities: lift_off, onset, load, flow, damping, frequency, peak.")
    ] = "lift_off,onset,flow",
    speed: Annotated[str, typer.Option(help="Shaft speed, where it is not an axis.")] = "0 rpm",
    pressure: Annotated[
        str | None,
        typer.Option(help="Gauge supply pressure, where it is not an axis.", show_default=f"{SUPPLY}, {FED}"),
    ] = None,
    highest_speed: Annotated[
        str | None, typer.Option(help="Speed up to which onset and peak are searched; default by the machine.")
    ] = None,
    *,
    settings: GridOptions,
    run: RunOptions,
    page: PageOptions,
    out: Annotated[Path, typer.Option(callback=a_folder, help="Folder; the same sweep in it is continued.")] = Path(
        "sweep"
    ),
    report: WithReport = True,
) -> None:
    """Sweep machine, speed or pressure and find the best points.

    Lift-off, whirl onset, load, flow, damping and response at every point.
    """
    page.check(report)
    plant = settings.plant(machine)
    from rotorsim.analysis.sweep import NETCDF, TABLE
    from rotorsim.analysis.sweep_definition import make_sweep
    from rotorsim.campaign.run import plan_of, run_sweep
    from rotorsim.campaign.store import MANIFEST

    chosen = run.settings()
    point = quantity("speed", speed, "rad/s"), quantity("pressure", pressure or SUPPLY, "Pa")
    top = None if highest_speed is None else quantity("highest-speed", highest_speed, "rad/s")
    defined = make_sweep(plant, over or (), what, *point, top)
    plan_of(defined)
    names = (NETCDF, TABLE, REPORT) if report else (NETCDF, TABLE)
    again = (out / CAMPAIGN / MANIFEST).is_file()
    with results(out, "sweep", names, again) as folder:
        page.begin(folder / REPORT, again or None)
        if chosen.scheduler is None:
            note_compiling(plant.assembly, "settle")
        found, outcome = run_sweep(defined, folder / CAMPAIGN, chosen)
        files = found.write(folder) | {"campaign": str(folder / CAMPAIGN)}
        if report:
            from rotorsim.report.sweep import write_sweep

            files["report"] = str(write_sweep(found, folder / REPORT))
            files |= page.finish(files["report"])
    _print(found, outcome, files, run.as_json)


def _print(found: SweepResult, outcome: CampaignOutcome, files: dict[str, str], as_json: bool) -> None:
    """Print best points, reasons and files; exit with 130 or 143 where it was stopped."""
    if as_json:
        print_json(found.numbers() | {"seconds": outcome.seconds, "files": files})
    else:
        from rotorsim.report.sweep import best_rows, reason_rows

        console = Console()
        console.print(_table(("quantity", "best is the", "value", "at"), best_rows(found)))
        if found.reasons:
            console.print(_table(("without a result", "reason", "cells"), reason_rows(found)))
        for kind, path in files.items():
            console.print(f"{kind}: {path}", soft_wrap=True)
    if outcome.stopped:
        print(f"stopped: {outcome.pending} cases are left; the same command continues", file=sys.stderr)
        raise typer.Exit(128 + outcome.stopped)


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Table:
    table = Table(*head)
    for row in rows:
        table.add_row(*row)
    return table

"""`rotorsim runup`: a virtual run-up from rest, with table, record and report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import (
    AsJson,
    Force,
    MachineName,
    PlantOptions,
    WithReport,
    a_folder,
    leave_if_cut,
    leave_if_empty,
    note_compiling,
    print_table,
    quantity,
    reporting_kept_samples,
)
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import results
from rotorsim.experiments import Outcome, Runup, record
from rotorsim.experiments.parameters import ask_speeds
from rotorsim.signals.record_blocks import open_record

RECORD, REPORT = "runup.nc", "report.html"


@example(
    "rotorsim runup dtu_gas_bearing --pressure '0.5 MPa' --stop '7000 rpm' "
    "--set effects.unbalance.me='12 g*mm' --out my_run",
    "rs.experiments.runup(plant, 0.0, 628.3, 10.5, 0.3e6)",
)
def runup(
    machine: MachineName = "dtu_gas_bearing",
    start: Annotated[str, typer.Option(help="Speed at the beginning.")] = "0 rpm",
    stop: Annotated[str, typer.Option(help="Speed at the end; below the start it is a coast-down.")] = "6000 rpm",
    rate: Annotated[str, typer.Option(help="Acceleration of the shaft.")] = "0.1 krpm/s",
    pressure: Annotated[
        str | None, typer.Option(help="Injection pressure, gauge.  [default: 0.3 MPa]", show_default=False)
    ] = None,
    *,
    settings: PlantOptions,
    page: PageOptions,
    out: Annotated[
        Path | None, typer.Option(callback=a_folder, help="Folder for record and report; default a new folder 'runup'.")
    ] = None,
    force: Force = False,
    report: WithReport = True,
    as_json: AsJson = False,
) -> None:
    """Run a machine up: amplitude and phase, orbits, film, contacts."""
    page.check(report)
    ramp = {name: quantity(name, text, "rad/s") for name, text in (("start", start), ("stop", stop))}
    ramp["rate"] = quantity("rate", rate, "rad/s^2")
    ramp["pressure"] = quantity("pressure", pressure or "0.3 MPa", "Pa")
    if ramp["pressure"] < 0:
        raise DataError(f"--pressure: '{pressure}' is negative; give the gauge pressure of the supply, e.g. '0.3 MPa'")
    plant = settings.plant(machine)
    for option, given in (("pressure", pressure), ("grid", settings.grid)):
        if given is not None and plant.machine.film is None:
            raise DataError(f"--{option}: {plant.machine.name} has no gas film; leave the option out")
    experiment = Runup(**ramp)
    ask_speeds(plant.machine, experiment)
    names = (RECORD, REPORT) if report else (RECORD,)
    with results(out, "runup", names, force) as folder:
        page.begin(folder / REPORT, force)
        path = folder / RECORD
        note_compiling(plant.assembly, "settle", "run")
        outcome = record(plant, experiment, path, progress=not as_json)
        leave_if_empty(outcome, path)
        with reporting_kept_samples(path):
            summary, rows = _analyse(path, folder / REPORT if report else None, outcome)
            if report:
                summary["files"] |= page.finish(folder / REPORT)
    if as_json:
        typer.echo(json.dumps(summary, indent=2))
    else:
        print_table(rows, summary["files"])
    leave_if_cut(outcome, path)


def _analyse(record: Path, page: Path | None, outcome: Outcome) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Summary of the run as numbers and as rows of text; writes the report next to the record."""
    from rotorsim.report.page.page import write_page
    from rotorsim.report.page.units import unit_system
    from rotorsim.report.record import results, run_page
    from rotorsim.report.run import analyse

    with open_record(record) as data:
        run = analyse(data)
        with unit_system("metric"):  # the page may be in others, the terminal is not
            rows = results(run)
        if page is not None:
            write_page(lambda: run_page(run), page)
    files = {"record": str(record)} | ({"report": str(page)} if page else {})
    return {**run.summary, "ended": outcome.ended, "solver": outcome.counters, "files": files}, rows

"""`rotorsim runup`: a virtual run-up from rest, with table, record and report."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rotorsim.experiments.runup import Outcome
    from rotorsim.plant import Plant

EXAMPLE = (
    "Example: rotorsim runup dtu_gas_bearing --pressure '0.5 MPa' --stop '7000 rpm' "
    "--set effects.unbalance.me='12 g*mm' --out my_run"
)


def runup(
    machine: Annotated[
        str, typer.Argument(metavar="[MACHINE]", help="Shipped machine or machine file.")
    ] = "dtu_gas_bearing",
    start: Annotated[str, typer.Option(help="Speed at the beginning.")] = "0 rpm",
    stop: Annotated[str, typer.Option(help="Speed at the end; below the start it is a coast-down.")] = "6000 rpm",
    rate: Annotated[str, typer.Option(help="Acceleration of the shaft.")] = "0.1 krpm/s",
    pressure: Annotated[str, typer.Option(help="Injection pressure, gauge.")] = "0.3 MPa",
    grid: Annotated[str | None, typer.Option(help="Film grid n_theta x n_z, e.g. 64x16.")] = None,
    time_step: Annotated[str | None, typer.Option(help="Step of the solver, e.g. '0.2 ms'.")] = None,
    changes: Annotated[
        list[str] | None, typer.Option("--set", help="Change the machine: PATH=VALUE; may be repeated.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for record and report; default a new folder 'runup'.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a run that is in the folder.")] = False,
    report: Annotated[bool, typer.Option(help="Write the HTML report.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Spin a machine up and report amplitude and phase, orbits, film and contacts."""
    from rotorsim.errors import DataError
    from rotorsim.experiments.runup import record_runup
    from rotorsim.machine.numerics import SAMPLE
    from rotorsim.machine.units import parse

    ramp: dict[str, Any] = {
        name: _quantity(name, text, "rad/s", parse) for name, text in (("start", start), ("stop", stop))
    }
    ramp["rate"] = _quantity("rate", rate, "rad/s^2", parse)
    ramp["pressure"] = _quantity("pressure", pressure, "Pa", parse)
    if ramp["pressure"] < 0:
        raise DataError(f"--pressure: '{pressure}' is negative; give the gauge pressure of the supply, e.g. '0.3 MPa'")
    plant = make_plant(machine, grid, time_step, changes or [])
    folder = out or _fresh_folder(Path("runup"))
    _say_if_compiling(plant)
    record = folder / "runup.nc"
    if record.exists() and not force:
        raise DataError(f"{record}: is there already; choose another --out or add --force")
    outcome = record_runup(plant, record, progress=not as_json, **ramp)
    if not outcome.samples:
        print(f"{outcome.ended} before the first second was simulated; nothing to keep", file=sys.stderr)
        raise typer.Exit(130 if outcome.ended == "interrupted" else 2)
    page = folder / "report.html" if report else None
    summary, rows = _analyse(record, page, outcome)
    if as_json:
        typer.echo(json.dumps(summary, indent=2))
    else:
        _print(rows, summary["files"])
    if outcome.ended == "interrupted":
        print(
            f"interrupted: {outcome.samples * SAMPLE:.1f} s of {outcome.asked * SAMPLE:.1f} s are in {record}",
            file=sys.stderr,
        )
        raise typer.Exit(130)
    if not outcome.complete:
        print(f"{outcome.ended}; what was simulated is in {record}", file=sys.stderr)
        raise typer.Exit(2)


def make_plant(machine: str, grid: str | None, time_step: str | None, changes: list[str]) -> Plant:
    """The plant of a machine with the changes of the command line."""
    from rotorsim.errors import MachineFileError
    from rotorsim.machine import load_machine
    from rotorsim.plant import Plant

    loaded = load_machine(machine)
    if grid is not None:
        sizes = grid.lower().split("x")
        if len(sizes) != 2 or not all(size.isdecimal() for size in sizes):
            raise MachineFileError(f"--grid: '{grid}' is not n_theta x n_z; write e.g. --grid 64x16")
        changes = [f"grid.n_theta={sizes[0]}", f"grid.n_z={sizes[1]}", *changes]
    if time_step is not None:
        changes = [f"solver.time_step={time_step}", *changes]
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise MachineFileError(
                f"--set: '{change}' is not PATH=VALUE; write e.g. --set effects.unbalance.me='12 g*mm'"
            )
        loaded = loaded.replace(path.strip(), _value(value.strip()))
    return Plant(loaded)


def _value(text: str) -> Any:
    """A value of --set: a number where it is one (counts and pure numbers), else text."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _quantity(option: str, text: str, unit: str, parse: Any) -> float:
    from rotorsim.errors import MachineFileError

    try:
        return float(parse(text, unit))
    except ValueError as error:
        raise MachineFileError(f"--{option}: {error}") from error


def _fresh_folder(base: Path) -> Path:
    """`base`, or the first of base-2, base-3 ... that does not exist yet."""
    folder, n = base, 1
    while folder.exists():
        n += 1
        folder = base.with_name(f"{base.name}-{n}")
    return folder


def _say_if_compiling(plant: Plant) -> None:
    from rotorsim.plant.compose import is_compiled

    if not is_compiled(plant.assembly.module):
        print("compiling the kernels for this kind of machine: half a minute, once", file=sys.stderr)


def _analyse(record: Path, page: Path | None, outcome: Outcome) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Summary of the run as numbers and as rows of text; writes the report beside the record."""
    from rotorsim.experiments.tracking import open_record
    from rotorsim.report.page import save_page
    from rotorsim.report.run import analyse
    from rotorsim.report.tables import results

    with open_record(record) as data:
        run = analyse(data)
        rows = results(run)
        if page is not None:
            save_page(run, page)
    files = {"record": str(record)} | ({"report": str(page)} if page else {})
    return {**run.summary, "ended": outcome.ended, "solver": outcome.counters, "files": files}, rows


def _print(rows: list[tuple[str, str]], files: dict[str, str]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    for label, value in rows:
        table.add_row(label, value)
    console = Console()
    console.print(table)
    for kind, path in files.items():
        console.print(f"{kind}: {path}", soft_wrap=True, highlight=False)

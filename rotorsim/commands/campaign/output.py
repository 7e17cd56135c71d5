"""Options and printed output of the commands of `rotorsim campaign`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import typer

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.progress import on_terminal
from rotorsim.base.units import show
from rotorsim.campaign import load_plan
from rotorsim.campaign.collection import collect, write_table
from rotorsim.campaign.index import DONE, FAILED, PENDING
from rotorsim.campaign.plan import Plan
from rotorsim.campaign.run import Outcome, spell
from rotorsim.campaign.store import open_store, status
from rotorsim.commands.options import note_compiling
from rotorsim.commands.results import files
from rotorsim.machine import Machine
from rotorsim.plant import Plant

SOME_FAILED = 3
BYTES_PER_SAMPLE = 21 * 8
"""Of a whole record of a machine with a gas film."""


def note_compiling_of_plan(plan: Plan) -> None:
    """Print one line in a pipe, which shows no progress bar, if the first case compiles its machine."""
    if on_terminal():
        return
    machine = Machine.from_text(next(iter(plan.machines.values())))
    for path, value in plan.set:
        machine = machine.replace(path, value)
    note_compiling(Plant(machine).assembly, "settle", "run")


def print_outcome(outcome: Outcome, folder: Path, as_json: bool) -> None:
    """Print the outcome of a run and exit with its code."""
    numbers = {"done": outcome.done, "failed": outcome.failed, "pending": outcome.pending, "run": outcome.run}
    if as_json:
        typer.echo(json.dumps(numbers | {"seconds": outcome.seconds, "folder": str(folder)}, indent=2))
    else:
        typer.echo(
            f"{folder}: {outcome.done} done, {outcome.failed} failed, {outcome.pending} left; "
            f"{outcome.run} run now in {outcome.seconds:.1f} s"
        )
    if outcome.stopped:
        print(f"stopped: {outcome.pending} cases are left; the same command continues", file=sys.stderr)
        raise typer.Exit(128 + outcome.stopped)
    if outcome.failed:
        print(
            f"{outcome.failed} cases failed: 'rotorsim campaign status {folder}' gives the reason, "
            f"'rotorsim campaign retry {folder}' runs them again",
            file=sys.stderr,
        )
        raise typer.Exit(SOME_FAILED)


def print_status(folder: Path, most: int, as_json: bool) -> None:
    """Print the state of a campaign."""
    found, plan = status(folder, most), open_store(folder).plan
    if as_json:
        typer.echo(json.dumps(found, indent=2))
        return
    typer.echo(f"{plan.name}: {found[DONE]} done, {found[FAILED]} failed, {found[PENDING]} left")
    typer.echo(f"computing time {spell(found['computing_s'])}, records {found['bytes'] / 1e6:.4g} MB")
    for one in found["failures"]:
        typer.echo(f"case {one['number']}, {one['experiment']}, {_values(plan, one['parameters'])}: {one['error']}")
    if found[FAILED] > len(found["failures"]):
        typer.echo(f"and {found[FAILED] - len(found['failures'])} more; --failed {found[FAILED]} names them all")


def _values(plan: Plan, values: dict[str, Any]) -> str:
    units = {axis.name: axis.target.unit for axis in plan.axes}
    texts = {n: v if isinstance(v, str) or units[n] is None else show(v, units[n] or "1") for n, v in values.items()}
    return ", ".join(f"{name} = {value}" for name, value in texts.items()) or "no axes"


def collect_into(
    folder: Path, out: Path | None, experiment: str | None, variables: list[str] | None, force: bool
) -> None:
    """Write the table or the records of a campaign into a file."""
    if out is not None and out.suffix not in (".csv", ".nc"):
        raise DataError(f"{out}: is neither .csv nor .nc; give a name with one of these endings")
    if out is None:
        typer.echo(repr(collect(folder, experiment, variables)))
        return
    with files(out, force=force, another="name"):
        if out.suffix == ".csv":
            typer.echo(f"{out}: {write_table(folder, out)} cases")
            return
        data = collect(folder, experiment, variables)
        write_netcdf(out, data)
    size = " x ".join(f"{n} {dim}" for dim, n in data.sizes.items())
    typer.echo(f"{out}: {size}, {out.stat().st_size / 1e6:.4g} MB")


def print_plan(name: str) -> None:
    """Print the cases that a plan would run."""
    plan = load_plan(name)
    typer.echo(f"{plan.name}: {len(plan)} cases, {spell(plan.seconds())} simulated")
    for axis in plan.axes:
        ends = [
            v if isinstance(v, str) else show(v, axis.target.unit or "1") for v in (axis.values[0], axis.values[-1])
        ]
        drawn = "Latin hypercube" if axis.latin else f"{ends[0]} to {ends[1]}"
        typer.echo(f"  {axis.name}: {len(axis.values)} values, {drawn}")
    for entry in plan.entries:
        typer.echo(f"  {entry.name}: {entry.kind}, " + ", ".join(f"{k} = {v}" for k, v in entry.parameters.items()))
    if plan.keep is None:
        typer.echo(f"  records: about {plan.seconds() / RIG_SAMPLE * BYTES_PER_SAMPLE / 1e6:.3g} MB")

"""`rotorsim machine new | check | show`: write, check and read machine files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rotorsim.machine import Machine

app = typer.Typer(help="Write, check and show machine files.", no_args_is_help=True)


@app.command(epilog="Example: rotorsim machine new my_rotor.toml --from plain_rotor")
def new(
    path: Annotated[Path, typer.Argument(help="File to write.")],
    source: Annotated[
        str, typer.Option("--from", help="Shipped machine or machine file to start from.")
    ] = "dtu_gas_bearing",
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it is there.")] = False,
) -> None:
    """Write a commented machine file to start from."""
    from rotorsim.errors import MachineFileError
    from rotorsim.machine import machine_text
    from rotorsim.machine.toml import write_text

    if path.exists() and not force:
        raise MachineFileError(f"{path}: is there already; choose another name or add --force")
    write_text(path, machine_text(source))
    typer.echo(f"{path}: written; edit it, then try 'rotorsim machine check {path}'")


@app.command(epilog="Example: rotorsim machine check my_rotor.toml")
def check(
    path: Annotated[str, typer.Argument(metavar="PATH", help="Machine file, or name of a shipped machine.")],
) -> None:
    """Check a machine file: one line if it is good, else one sentence per problem and exit code 2."""
    from rotorsim.machine import load_machine

    typer.echo(f"{path}: ok, {summary(load_machine(path))}")


@app.command(epilog="Example: rotorsim machine show dtu_gas_bearing")
def show(
    machine: Annotated[str, typer.Argument(metavar="NAME|PATH", help="Shipped machine or machine file.")],
    as_json: Annotated[bool, typer.Option("--json", help="SI numbers as JSON.")] = False,
) -> None:
    """Show what a machine is made of."""
    from rotorsim.machine import load_machine

    loaded = load_machine(machine)
    if as_json:
        typer.echo(json.dumps(si_numbers(loaded), indent=2))
    else:
        _print_table(loaded)


def summary(machine: Machine) -> str:
    """A machine in half a line."""
    from rotorsim.machine.units import show as text

    film = machine.film
    parts = [f"{machine.name}: {machine.mass:.3g} kg on {len(machine.bearings)} bearings"]
    if film:
        parts.append(f"gas film with {text(film.clearance, 'm')} clearance and {len(machine.injectors)} injectors")
    parts.append(f"effects: {', '.join(machine.effects) or 'none'}")
    return "; ".join(parts)


def si_numbers(machine: Machine) -> dict[str, Any]:
    """All values as SI numbers, with mass [kg] and content hash."""
    from dataclasses import asdict

    effects = {name: [asdict(effect) for effect in effects] for name, effects in machine.effects.items()}
    return {
        **machine.model_dump(exclude={"effects"}),
        "effects": effects,
        "mass": machine.mass,
        "hash": machine.hash,
    }


def rows(part: Any, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Dotted path, value in people's units and sentence of every field."""
    from rotorsim.machine.part import Part
    from rotorsim.machine.toml import entries
    from rotorsim.machine.units import show as text

    for name, value, spec, doc in entries(part):
        here = f"{path}.{name}".lstrip(".")
        if isinstance(value, Part):
            yield from rows(value, here)
        elif isinstance(value, dict):
            for key, parts in value.items():
                yield from _list_rows(parts, f"{here}.{key}")
        elif isinstance(value, tuple):
            yield from _list_rows(value, here)
        else:
            yield here, text(value, spec.unit) if spec else str(value), doc


def _list_rows(parts: tuple[Any, ...], path: str) -> Iterator[tuple[str, str, str]]:
    single = len(parts) == 1 and path.startswith("effects.")
    for i, part in enumerate(parts):
        yield from rows(part, path if single else f"{path}.{i}")


def _print_table(machine: Machine) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    console.print(escape(summary(machine)))
    table = Table("field", "value", "meaning", box=None, pad_edge=False)
    group = ""
    for path, value, doc in rows(machine):
        above, _, name = path.rpartition(".")
        if above != group:
            group = above
            table.add_row()
            table.add_row(f"[bold]{escape(group)}[/bold]")
        table.add_row(*map(escape, ("  " * bool(group) + name, value, doc)))
    console.print(table)

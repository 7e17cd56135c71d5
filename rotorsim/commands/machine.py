"""`rotorsim machine new | check | show | effects | calibrate`: machine files and the catalogue of effects."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.commands import calibrate as calibration
from rotorsim.commands.results import files

if TYPE_CHECKING:
    from rotorsim.machine import Machine

app = typer.Typer(help="Write, check, show and calibrate machine files.", no_args_is_help=True)
app.command(name="calibrate", epilog=calibration.EXAMPLE)(calibration.calibrate_command)


@app.command(epilog="Example: rotorsim machine new my_rotor.toml --from plain_rotor")
def new(
    path: Annotated[Path, typer.Argument(help="File to write.")],
    source: Annotated[
        str, typer.Option("--from", help="Shipped machine or machine file to start from.")
    ] = "dtu_gas_bearing",
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it is there.")] = False,
) -> None:
    """Write a commented machine file to start from."""
    from rotorsim.base.files import write_text
    from rotorsim.machine import machine_text

    with files(path, force=force, another="name"):
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


@app.command(epilog="Example: rotorsim machine effects unbalance")
def effects(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="An effect; all are listed without.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
) -> None:
    """List the physical effects a machine file may have, or show one: equation, source, parameters."""
    from rotorsim.machine.catalogue import catalogue

    entries = catalogue() if name is None else [_entry(name)]
    if as_json:
        typer.echo(json.dumps(entries if name is None else entries[0], indent=2))
    elif name is None:
        _print_effects(entries)
    else:
        _print_effect(entries[0])


def _entry(name: str) -> dict[str, Any]:
    """An effect of the catalogue by its name."""
    from difflib import get_close_matches

    from rotorsim.effects import REGISTRY
    from rotorsim.errors import MachineFileError
    from rotorsim.machine.catalogue import describe

    if name in REGISTRY:
        return describe(REGISTRY[name])
    close = get_close_matches(name, REGISTRY, n=1)
    hint = f"did you mean '{close[0]}'? " if close else ""
    raise MachineFileError(f"'{name}' is no effect; {hint}known effects: {', '.join(sorted(REGISTRY))}")


def _print_effects(entries: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table("effect", "port", "what", box=None, pad_edge=False)
    for e in entries:
        table.add_row(e["name"], e["port"], escape(e["summary"]))
    Console(highlight=False).print(table)


def _print_effect(entry: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(highlight=False)
    console.print(f"[bold]\\[effects.{entry['name']}][/bold]  {escape(entry['title'])}\n")
    for text in (entry["equation"], entry["about"], f"Source: {entry['source']}"):
        console.print(escape(text) + "\n")
    several = "several tables add up" if entry["several"] else "one table only"
    console.print(escape(f"Acts {entry['acts']} (port {entry['port']}); {several}.\n"))
    table = Table("parameter", "neutral", "limits", "meaning", box=None, pad_edge=False)
    for p in entry["parameters"]:
        limits = f"{p['low']} to {p['high']}" if p["low"] or p["high"] else ""
        table.add_row(*map(escape, (p["name"], p["neutral"], limits, p["doc"])))
    console.print(table)


def summary(machine: Machine) -> str:
    """Machine summary in half a line."""
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
    """Dotted path, value in engineering units and description of every field."""
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
        elif isinstance(value, tuple) and name != "unusual":
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

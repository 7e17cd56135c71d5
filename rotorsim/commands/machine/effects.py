"""`rotorsim machine effects`: the catalogue of effects."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from rotorsim.base.errors import MachineFileError
from rotorsim.commands.completion import effects as names
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.effects import REGISTRY
from rotorsim.machine.catalogue import catalogue, describe
from rotorsim.machine.effect_tables import unknown_effect


@example(
    "rotorsim machine effects unbalance",
    "rs.machine.catalogue()",
)
def effects(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="An effect; all are listed without.", autocompletion=names)
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
) -> None:
    """List the physical effects a machine file may have, or show one: equation, source, parameters."""
    entries = catalogue() if name is None else [_entry(name)]
    if as_json:
        typer.echo(json.dumps(entries if name is None else entries[0], indent=2))
    elif name is None:
        _print_effects(entries)
    else:
        _print_effect(entries[0])


def _entry(name: str) -> dict[str, Any]:
    """An effect of the catalogue by its name."""
    if name in REGISTRY:
        return describe(REGISTRY[name])
    raise MachineFileError(f"{name}: {unknown_effect(name)}")


def _print_effects(entries: list[dict[str, Any]]) -> None:
    table = Table("effect", "port", "what", box=None, pad_edge=False)
    for e in entries:
        table.add_row(e["name"], e["port"], escape(e["summary"]))
    Console().print(table)


def _print_effect(entry: dict[str, Any]) -> None:
    console = Console()
    console.print(f"[bold]\\[effects.{entry['name']}][/bold]  {escape(entry['title'] or entry['summary'])}\n")
    source = entry["source"] and f"Source: {entry['source']}"
    for text in filter(None, (entry["equation"], entry["about"], source)):
        console.print(escape(text) + "\n")
    if entry["references"]:
        console.print(escape("\n".join(f"- {one}" for one in entry["references"])) + "\n")
    several = "several tables add up" if entry["several"] else "one table only"
    console.print(escape(f"Acts {entry['acts']} (port {entry['port']}); {several}.\n"))
    table = Table("parameter", "neutral", "limits", "meaning", box=None, pad_edge=False)
    for p in entry["parameters"]:
        limits = f"{p['low']} to {p['high']}" if p["low"] or p["high"] else ""
        table.add_row(*map(escape, (p["name"], p["neutral"], limits, p["doc"])))
    console.print(table)

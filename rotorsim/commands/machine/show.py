"""`rotorsim machine show`: the content of a machine file, as a table or as numbers."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from rotorsim.commands.completion import machines
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.machine import Machine, load_machine
from rotorsim.machine.overview import rows, si_numbers, summary


@example(
    "rotorsim machine show dtu_gas_bearing",
    "rs.machine.si_numbers(rs.load_machine('dtu_gas_bearing'))",
)
def show(
    machine: Annotated[
        str, typer.Argument(metavar="NAME|PATH", help="Shipped machine or machine file.", autocompletion=machines)
    ],
    as_json: Annotated[bool, typer.Option("--json", help="SI numbers as JSON.")] = False,
) -> None:
    """Show what a machine is made of."""
    loaded = load_machine(machine)
    if as_json:
        typer.echo(json.dumps(si_numbers(loaded), indent=2))
    else:
        _print_table(loaded)


def _print_table(machine: Machine) -> None:
    console = Console()
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

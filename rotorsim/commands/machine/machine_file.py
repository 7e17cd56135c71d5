"""`rotorsim machine new | check`: write and check machine files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.files import write_text
from rotorsim.commands.completion import machines
from rotorsim.commands.lazy_group import example
from rotorsim.commands.results import files
from rotorsim.machine import load_machine, machine_text, summary


@example(
    "rotorsim machine new my_rotor.toml --from plain_rotor",
    "rs.machine_text('plain_rotor')",
)
def new(
    path: Annotated[Path, typer.Argument(help="File to write.")],
    source: Annotated[
        str, typer.Option("--from", help="Shipped machine or machine file to start from.", autocompletion=machines)
    ] = "dtu_gas_bearing",
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it is there.")] = False,
) -> None:
    """Write a commented machine file to start from."""
    with files(path, force=force, another="name"):
        write_text(path, machine_text(source))
    typer.echo(f"{path}: written; edit it, then try 'rotorsim machine check {path}'")


@example(
    "rotorsim machine check my_rotor.toml",
    "rs.load_machine('my_rotor.toml')",
)
def check(
    path: Annotated[
        str, typer.Argument(metavar="PATH", help="Machine file, or name of a shipped machine.", autocompletion=machines)
    ],
) -> None:
    """Check a machine file: one line if it is good, else one sentence per problem and exit code 2."""
    typer.echo(f"{path}: ok, {summary(load_machine(path))}")

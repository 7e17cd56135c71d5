"""`rotorsim warm`: compile the kernels of machines before they are needed."""

from __future__ import annotations

import json
import time
from typing import Annotated

import typer

from rotorsim.commands.completion import machines as shipped_or_files
from rotorsim.commands.options import AsJson, PlantOptions
from rotorsim.commands.registry import command


@command(
    "warm",
    "rotorsim warm dtu_gas_bearing --grid 64x16",
    "rs.compile_kernels(plant)",
)
def warm(
    machines: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MACHINE]...",
            help="Shipped machines or files; default all shipped.",
            autocompletion=shipped_or_files,
        ),
    ] = None,
    *,
    settings: PlantOptions,
    as_json: AsJson = False,
) -> None:
    """Compile machines now, so that their first run starts at once."""
    from rotorsim.machine import shipped_machines

    plants = {name: settings.plant(name) for name in machines or shipped_machines()}
    from rotorsim.plant import compile_kernels

    took = {}
    for name, plant in plants.items():
        note = plant.assembly.compile_note("settle", "run")
        if not note:
            typer.echo(f"{name}: compiled already", err=True)
            took[name] = 0.0
            continue
        typer.echo(note, err=True)
        start = time.monotonic()
        compile_kernels(plant)
        took[name] = round(time.monotonic() - start, 1)
        typer.echo(f"{name}: compiled in {took[name]:.0f} s", err=True)
    if as_json:
        typer.echo(json.dumps({"seconds": took}, indent=2))

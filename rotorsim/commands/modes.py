"""`rotorsim modes`: mode shapes of the coupled machine at an operating point, as pictures or to turn in a window."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.commands.options import Changes, GridSize, MachineName, a_folder, fresh_folder, make_plant, quantity

EXAMPLE = "Example: rotorsim modes dtu_gas_bearing --speed '6000 rpm' --pressure '0.5 MPa' --out my_modes"


def modes(
    machine: MachineName = "dtu_gas_bearing",
    speed: Annotated[str, typer.Option(help="Speed of the shaft.")] = "6000 rpm",
    pressure: Annotated[str, typer.Option(help="Gauge supply pressure.")] = "0.5 MPa",
    count: Annotated[int, typer.Option(help="Modes to draw, the lowest first.", min=1)] = 4,
    grid: GridSize = None,
    changes: Changes = None,
    show: Annotated[bool, typer.Option("--show", help="Open a window to turn the modes in.")] = False,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw each mode as PNG.")] = True,
    out: Annotated[Path | None, typer.Option(callback=a_folder, help="Folder; default a new folder 'modes'.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the modes as JSON.")] = False,
) -> None:
    """Draw the modes of rotor and film together at one operating point."""
    from math import pi

    from rotorsim.analysis import mode_shapes
    from rotorsim.commands.options import print_table

    at = quantity("speed", speed, "rad/s"), quantity("pressure", pressure, "Pa")
    plant = make_plant(machine, grid, None, changes or [])
    found = mode_shapes(plant, *at)
    found = found.isel(mode=slice(count))
    folder = out or fresh_folder(Path("modes"))
    folder.mkdir(parents=True, exist_ok=True)
    found.to_netcdf(folder / "modes.nc", engine="h5netcdf")
    files = {"modes": str(folder / "modes.nc")}
    if pictures or show:
        from rotorsim.report.mode_pictures import draw_modes, show_modes

        if pictures:
            files |= {f"mode {k + 1}": str(p) for k, p in enumerate(draw_modes(found, folder))}
        if show:
            show_modes(found)
    rows = [
        {"mode": k + 1, "frequency_hz": float(found["wn"][k]) / (2 * pi), "damping_ratio": float(found["zeta"][k]),
         "whirl": str(found["whirl"].values[k])}
        for k in range(found.sizes["mode"])
    ]  # fmt: skip
    if as_json:
        typer.echo(json.dumps({"modes": rows, "files": files}, indent=2))
        return
    print_table(
        [(f"mode {r['mode']}", f"{r['frequency_hz']:.2f} Hz, damping {r['damping_ratio']:.4f}, {r['whirl']}")
         for r in rows],
        files,
    )  # fmt: skip

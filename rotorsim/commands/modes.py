"""`rotorsim modes`: mode shapes of the coupled machine at an operating point: pictures, films or a 3D window."""

from __future__ import annotations

import json
import sys
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from rotorsim.analysis import mode_shapes
from rotorsim.base.constants import TO_HZ
from rotorsim.base.errors import DataError
from rotorsim.base.netcdf import write_netcdf
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import GridOptions, MachineName, a_folder, note_compiling, print_table, quantity, warn_of
from rotorsim.commands.results import results
from rotorsim.machine.rim_speed import ask_rim_speed
from rotorsim.plant.validity import linear_warnings

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant import Plant


@example(
    "rotorsim modes dtu_gas_bearing --speed '6000 rpm' --pressure '0.5 MPa' --out my_modes",
    "rs.analysis.mode_shapes(plant, 628.3, 0.5e6)",
)
def modes(
    machine: MachineName = "dtu_gas_bearing",
    speed: Annotated[str, typer.Option(help="Speed of the shaft.")] = "6000 rpm",
    pressure: Annotated[str, typer.Option(help="Gauge supply pressure.")] = "0.5 MPa",
    count: Annotated[int, typer.Option(help="Modes to draw, the lowest first.", min=1)] = 4,
    *,
    settings: GridOptions,
    show: Annotated[bool, typer.Option("--show", help="Open a window to turn the modes in.")] = False,
    pictures: Annotated[
        bool | None, typer.Option("--pictures/--no-pictures", help="Draw each mode as PNG; if pyvista is there.")
    ] = None,
    film: Annotated[
        str, typer.Option("--film", help="Film each mode as well: gif, or mp4, which needs the program ffmpeg.")
    ] = "",
    out: Annotated[Path | None, typer.Option(callback=a_folder, help="Folder; default a new folder 'modes'.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace modes that are in the folder.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the modes as JSON.")] = False,
) -> None:
    """Draw the modes of rotor and film at one operating point."""
    from rotorsim.report.scenes.film import lacking

    at = quantity("speed", speed, "rad/s"), quantity("pressure", pressure, "Pa")
    plant = settings.plant(machine)
    ask_rim_speed(plant.machine, at[0], "--speed")
    wanted = pictures is not False or show or bool(film)
    _check_film(film)
    missing = lacking() if wanted else ""
    if missing and (pictures or show or film):
        raise DataError(missing)
    endings = ["png"] * (pictures is not False) + [film] * bool(film)
    names = [f"mode_{k + 1}.{ending}" for ending in endings for k in range(count)]
    with results(out, "modes", ["modes.nc", *names], force) as folder:
        note_compiling(plant.assembly, "settle")
        found = mode_shapes(plant, *at)
        found = found.isel(mode=slice(count))
        found = found.assign_attrs(_warnings(found, plant, at[0]))
        write_netcdf(folder / "modes.nc", found)
        files = {"modes": str(folder / "modes.nc")}
        if wanted and not missing:
            drawn, missing = _drawn(found, folder, endings, show)
            files |= drawn
    _print(found, files, as_json)
    if missing:
        print(missing, file=sys.stderr)
        if pictures or show or film:
            raise typer.Exit(2)


def _warnings(found: xr.Dataset, plant: Plant, speed: float) -> dict[str, str]:
    """Attribute `warnings` at a speed [rad/s], with the modes below the highest one shown that are not listed."""
    said = linear_warnings(plant, speed, found.attrs["zeta_least"], found.attrs["pressure"])
    left = np.sort(found.attrs["not_listed"])
    left = left[left < found["wn"].values.max(initial=0.0)]
    sentences = [said["warnings"]] if said else []
    if left.size:
        sentences.append(
            f"not listed: {left.size} modes with a damping ratio below 0.5, from {left[0] * TO_HZ:.4g} to "
            f"{left[-1] * TO_HZ:.4g} Hz; `rotorsim campbell` has them"
        )
    if np.isnan(found.attrs["zeta_least"]):
        sentences.append("whether every mode is damped is not known: their number is not proven")
    return {"warnings": "\n".join(sentences)} if sentences else {}


def _drawn(found: xr.Dataset, folder: Path, endings: list[str], show: bool) -> tuple[dict[str, str], str]:
    """Files of pictures and films, and why there are none."""
    from rotorsim.report.scenes.shaft import draw_modes, show_modes

    files: dict[str, str] = {}
    try:
        for ending in endings:
            word = "mode" if ending == "png" else "film"
            files |= {f"{word} {k + 1}": str(path) for k, path in enumerate(draw_modes(found, folder, ending))}
        if show:
            show_modes(found)
    except DataError as error:
        return files, str(error)
    return files, ""


def _check_film(film: str) -> None:
    """Refuse another kind of film, or one that cannot be written here, before anything is computed."""
    from rotorsim.report.scenes.film import ENDINGS, check_program

    known = [ending[1:] for ending in ENDINGS[1:]]
    if film and film not in known:
        raise DataError(f"--film: '{film}' is not known; choose one of {', '.join(known)}")
    if film:
        check_program(Path(f"mode.{film}"))


def _print(found: xr.Dataset, files: dict[str, str], as_json: bool) -> None:
    warnings = warn_of(found)
    rows = [
        {"mode": k + 1, "frequency_hz": float(found["wn"][k]) / (2 * pi), "damping_ratio": float(found["zeta"][k]),
         "whirl": str(found["whirl"].values[k])}
        for k in range(found.sizes["mode"])
    ]  # fmt: skip
    if as_json:
        typer.echo(json.dumps({"modes": rows, "warnings": warnings, "files": files}, indent=2))
        return
    print_table(
        [(f"mode {r['mode']}", f"{r['frequency_hz']:.2f} Hz, damping {r['damping_ratio']:.4f}, {r['whirl']}")
         for r in rows],
        files,
    )  # fmt: skip

"""`rotorsim map`: equilibrium, modes, gains, delays and film coefficients over a grid of operating points."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rotorsim.analysis.axes import read_axis, read_field
from rotorsim.analysis.machine_map import check_quantities, machines_at_ends, map_machine
from rotorsim.analysis.supply import felt
from rotorsim.base.constants import TO_UM
from rotorsim.base.netcdf import write_netcdf
from rotorsim.base.progress import Update, bar
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.commands.map.tables import LISTED, LOOKED, tables
from rotorsim.commands.options import GridOptions, MachineName, a_folder, note_compiling, print_table, quantity
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import results
from rotorsim.machine.rim_speed import ask_rim_speed
from rotorsim.machine.usual import ask_machine

if TYPE_CHECKING:
    import xarray as xr

MAP, REPORT = "map.nc", "report.html"
SPEEDS, PRESSURES = "0 rpm:6000 rpm:7", "0.3 MPa:0.7 MPa:5"
RANGES: dict[str, tuple[str, float]] = {
    "natural_frequency_hz": ("wn", 1 / (2 * pi)),
    "damping_ratio": ("zeta", 1.0),
    "eccentricity_ratio": ("eccentricity_ratio", 1.0),
    "smallest_film_um": ("h_min", TO_UM),
}
"""Smallest and largest value over the map: name, variable, factor."""


@example(
    "rotorsim map dtu_gas_bearing --speed '0 rpm:6000 rpm:7' --pressure '0.3 MPa:0.7 MPa:5' "
    "--over 'bearings.1.clearance=23 um, 25 um, 27 um' --lift-off --whirl-onset --campbell --out my_map",
    "rs.analysis.map_machine(plant, speeds, pressures)",
)
def map_command(
    machine: MachineName = "dtu_gas_bearing",
    speed: Annotated[str, typer.Option(help="Speeds: FROM:TO:COUNT, or values with commas.")] = SPEEDS,
    pressure: Annotated[
        str | None,
        typer.Option(help=f"Gauge supply pressures, likewise.  [default: {PRESSURES}; 0 for a machine without feed]"),
    ] = None,
    over: Annotated[
        list[str] | None, typer.Option(help="Another axis: PATH=FROM:TO:COUNT of a field of the machine file.")
    ] = None,
    frequency: Annotated[
        list[str] | None, typer.Option(help="Whirl frequency of K and C, e.g. '120 Hz'; default 0 and the modes'.")
    ] = None,
    with_lift_off: Annotated[bool, typer.Option("--lift-off", help="Find the lift-off pressure by speed.")] = False,
    least_film: Annotated[str, typer.Option(help="Film that counts as lift-off; 0: what the plant runs on.")] = "0 um",
    with_onset: Annotated[bool, typer.Option("--whirl-onset", help="Find the onset of whirl by pressure.")] = False,
    campbell: Annotated[bool, typer.Option("--campbell", help="Find the critical speeds of orders 1, 2, 3.")] = False,
    *,
    settings: GridOptions,
    page: PageOptions,
    jobs: Annotated[int | None, typer.Option(help="Processes; default as many as pay.")] = None,
    out: Annotated[
        Path | None, typer.Option(callback=a_folder, help="Folder for map and report; default a new folder 'map'.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a map that is in the folder.")] = False,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the map's summary as JSON.")] = False,
) -> None:
    """Map the operating points of a machine and shade what is safe.

    Equilibria and linear models; no time simulation.
    """
    page.check(report)
    speeds, pressures = (
        read_axis("speed", speed, "rad/s"),
        read_axis("pressure", PRESSURES if pressure is None else pressure, "Pa"),
    )
    fields = [read_field(text) for text in over or []]
    whirl = [2 * pi * quantity("frequency", text, "Hz") for text in frequency or []] or None
    plant = settings.plant(machine)
    check_quantities(plant, with_lift_off, with_onset)
    ask_rim_speed(plant.machine, max(speeds, key=abs), "--speed")
    machines = machines_at_ends(plant, fields)
    for one in machines:
        ask_machine(one)
    if pressure is not None and not np.array_equal(felt(machines, pressures), pressures):
        print("map: gas is supplied to no film of the machine, so no pressure changes it; 0 is mapped", file=sys.stderr)
    film = quantity("least-film", least_film, "m")
    with results(out, "map", (MAP, REPORT) if report else (MAP,), force) as folder:
        page.begin(folder / REPORT, force)
        note_compiling(plant.assembly, "settle")
        with bar(text="operating points", show=not as_json) as update:
            shown, least = update and _count(update), film if with_lift_off else None
            found = map_machine(plant, speeds, pressures, fields, whirl, least, with_onset, campbell, jobs, shown)
        files = _write(found, folder, report)
        if "report" in files:
            files |= page.finish(files["report"])
    _print_map(found, files, as_json)
    if found.attrs["ended"] != "complete":
        print(f"interrupted: the points that were done are in {files['map']}", file=sys.stderr)
        raise typer.Exit(130)
    if not float(found["lifted"].max()):
        way = "raise the pressures" if any(one.fed for one in machines) else "ask for higher speeds"
        print(f"map: the film carries the rotor at no point of the grid; {way}", file=sys.stderr)
        raise typer.Exit(2)


def _count(update: Update) -> Callable[[int, int], None]:
    """Show (done, total) on a bar."""
    return lambda done, total: update(completed=done, total=total)


def _write(found: xr.Dataset, folder: Path, report: bool) -> dict[str, str]:
    files = {"map": str(folder / MAP)}
    write_netcdf(folder / MAP, found)
    if report and "wn" in found:
        from rotorsim.report.operating_map import save_map_page

        page = folder / REPORT
        save_map_page(found, page)
        files["report"] = str(page)
    return files


def summary(found: xr.Dataset) -> dict[str, Any]:
    """Summary of a map in a few numbers."""
    numbers: dict[str, Any] = {
        "points": int(found["lifted"].size),
        "lifted": int(found["lifted"].sum()),
        "safe": int((found["safe"] == 1).sum()),
        "not_safe": int((found["safe"] == 0).sum()),
        "not_known": int(found["safe"].isnull().sum()),
        "ended": found.attrs["ended"],
    }
    for key, (name, scale) in RANGES.items():
        if name in found:
            values = found[name].values[..., :2] if "mode" in found[name].dims else found[name].values
            numbers[key] = _ends(values * scale)
    for name, (key, _, scale) in LISTED.items():
        if name in found:
            numbers[key] = _plain(found[name].values * scale)
        if name in found and name in LOOKED:
            flag, looked = LOOKED[name]
            numbers[looked] = _plain(found[flag].values)
    return numbers


def _ends(values: Any) -> list[float | None]:
    good = values[np.isfinite(values)]
    return [float(good.min()), float(good.max())] if good.size else [None, None]


def _plain(values: Any) -> Any:
    """Nested lists with None for NaN: JSON has no NaN."""
    if getattr(values, "ndim", 0):
        return [_plain(v) for v in values]
    return None if values != values else float(values)


def _print_map(found: xr.Dataset, files: dict[str, str], as_json: bool) -> None:
    numbers = summary(found)
    if as_json:
        typer.echo(json.dumps(numbers | {"files": files}, indent=2))
        return
    listed = {key for key, _, _ in LISTED.values()} | {key for _, key in LOOKED.values()}
    rows = [(key.replace("_", " "), _short(value)) for key, value in numbers.items() if key not in listed]
    for table in tables(found):
        Console().print(table)
    print_table(rows, files)


def _short(value: Any) -> str:
    """A number, or the ends of a range."""
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list):
        return " to ".join(map(_short, value))
    return "none" if value is None else str(value)

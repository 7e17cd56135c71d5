"""`rotorsim map`: equilibrium, modes, gains, delays and film coefficients over a grid of operating points."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.commands.options import Changes, GridSize, MachineName, a_folder, fresh_folder, make_plant, quantity

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant import Plant

EXAMPLE = (
    "Example: rotorsim map dtu_gas_bearing --speed '0 rpm:6000 rpm:7' --pressure '0.3 MPa:0.7 MPa:5' "
    "--over 'bearings.1.clearance=23 um, 25 um, 27 um' --lift-off --whirl-onset --campbell --out my_map"
)
SPEEDS, PRESSURES = "0 rpm:6000 rpm:7", "0.3 MPa:0.7 MPa:5"


def map_command(
    machine: MachineName = "dtu_gas_bearing",
    speed: Annotated[str, typer.Option(help="Speeds: FROM:TO:COUNT, or values with commas.")] = SPEEDS,
    pressure: Annotated[str, typer.Option(help="Gauge supply pressures, likewise.")] = PRESSURES,
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
    grid: GridSize = None,
    changes: Changes = None,
    jobs: Annotated[int | None, typer.Option(help="Processes; default as many as pay.")] = None,
    out: Annotated[
        Path | None, typer.Option(callback=a_folder, help="Folder for map and report; default a new folder 'map'.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a map that is in the folder.")] = False,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the map's summary as JSON.")] = False,
) -> None:
    """Map a machine over its operating points, without time simulation, and shade what is safe."""
    from math import pi

    from rotorsim.analysis import operating_map, safe_region
    from rotorsim.analysis.axes import read_axis, read_field
    from rotorsim.commands.options import free_record

    speeds, pressures = read_axis("speed", speed, "rad/s"), read_axis("pressure", pressure, "Pa")
    fields = [read_field(text) for text in over or []]
    whirl = [2 * pi * quantity("frequency", text, "Hz") for text in frequency or []] or None
    plant = make_plant(machine, grid, None, changes or [])
    _check(plant, with_lift_off, with_onset)
    film = quantity("least-film", least_film, "m")
    path = free_record((out or fresh_folder(Path("map"))) / "map.nc", force)
    with _bar(as_json) as told:
        found = operating_map(plant, speeds, pressures, fields, whirl, jobs, told)
    found = safe_region(found)
    if found.attrs["ended"] == "complete":
        found = _more(plant, found, film if with_lift_off else None, with_onset, campbell)
    files = _write(found, path, report)
    _tell(found, files, as_json)
    if found.attrs["ended"] != "complete":
        print(f"interrupted: the points that were done are in {path}", file=sys.stderr)
        raise typer.Exit(130)
    if not float(found["lifted"].max()):
        print("map: the film carries the rotor at no point of the grid; raise the pressures", file=sys.stderr)
        raise typer.Exit(2)


def _check(plant: Plant, with_lift_off: bool, with_onset: bool) -> None:
    """Say before the work what the machine cannot answer."""
    from rotorsim.errors import DataError

    if with_onset and plant.machine.film is None:
        raise DataError("--whirl-onset: the machine has no gas film; leave the option out")
    if with_lift_off and not plant.machine.injectors:
        raise DataError("--lift-off: the machine has no injectors, so no pressure lifts it; leave the option out")


def _more(plant: Plant, found: xr.Dataset, film: float | None, with_onset: bool, campbell: bool) -> xr.Dataset:
    """The extra analyses of the machine as its file says, without the further axes; an interrupt keeps those before."""
    from rotorsim.analysis import critical_speeds, lift_off, whirl_onset

    pressures, speeds = found["pressure"].values, found["speed"].values

    def lifted() -> dict[str, Any]:
        unit = {"units": "Pa", "long_name": f"pressure that leaves {(film or 0.0) * 1e6:.3g} um of film, gauge"}
        return {"lift_off_pressure": ("speed", lift_off(plant, speeds, least_film=film or 0.0), unit)}

    def crossings() -> xr.Dataset:
        extra = critical_speeds(plant, pressures).rename(mode="mode_crossing", critical_speed="crossing_speed")
        return extra.rename(critical_zeta="crossing_zeta")

    asked: list[tuple[bool, Callable[[], Any]]] = [
        (film is not None, lambda: found.assign(lifted())),
        (with_onset, lambda: found.merge(whirl_onset(plant, pressures))),
        (campbell, lambda: found.merge(crossings())),
    ]
    try:
        for wanted, extended in asked:
            if wanted:
                found = extended()
    except KeyboardInterrupt:
        found = found.assign_attrs(ended="interrupted")
    return found


def _bar(silent: bool) -> Any:
    """Context that gives a function (done, total) to tell of progress on a terminal, else None."""
    from contextlib import contextmanager

    @contextmanager
    def shown() -> Any:
        if silent or not sys.stderr.isatty():
            yield None
            return
        from rich.console import Console
        from rich.progress import Progress

        with Progress(console=Console(stderr=True)) as bar:
            task = bar.add_task("operating points", total=None)

            def told(done: int, total: int) -> None:
                bar.update(task, completed=done, total=total)

            yield told

    return shown()


def _write(found: xr.Dataset, path: Path, report: bool) -> dict[str, str]:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    found.to_netcdf(part, engine="h5netcdf")
    part.replace(path)
    files = {"map": str(path)}
    if report and "wn" in found:
        from rotorsim.report.map_page import save_map_page

        page = path.with_name("report.html")
        save_map_page(found, page)
        files["report"] = str(page)
    return files


def summary(found: xr.Dataset) -> dict[str, Any]:
    """What the map says in a few numbers."""
    from math import pi

    told: dict[str, Any] = {
        "points": int(found["lifted"].size),
        "lifted": int(found["lifted"].sum()),
        "safe": int(found["safe"].sum()),
        "ended": found.attrs["ended"],
    }
    scales: dict[str, tuple[str, float]] = {
        "wn": ("natural_frequency_hz", 1 / (2 * pi)), "zeta": ("damping_ratio", 1.0),
        "eccentricity_ratio": ("eccentricity_ratio", 1.0), "h_min": ("smallest_film_um", 1e6),
    }  # fmt: skip
    for name, (key, scale) in scales.items():
        if name in found:
            values = found[name].values[..., :2] if "mode" in found[name].dims else found[name].values
            told[key] = _ends(values * scale)
    listed: dict[str, tuple[str, float]] = {
        "lift_off_pressure": ("lift_off_mpa", 1e-6), "onset_speed": ("whirl_onset_rpm", 30 / pi),
        "onset_ratio": ("whirl_ratio", 1.0), "crossing_speed": ("crossings_rpm", 30 / pi),
    }  # fmt: skip
    for name, (key, scale) in listed.items():
        if name in found:
            told[key] = _plain(found[name].values * scale)
    return told


def _ends(values: Any) -> list[float | None]:
    import numpy as np

    good = values[np.isfinite(values)]
    return [float(good.min()), float(good.max())] if good.size else [None, None]


def _plain(values: Any) -> Any:
    """Nested lists with None for NaN: JSON has no NaN."""
    if getattr(values, "ndim", 0):
        return [_plain(v) for v in values]
    return None if values != values else float(values)


def _tell(found: xr.Dataset, files: dict[str, str], as_json: bool) -> None:
    from rotorsim.commands.options import print_table

    told = summary(found)
    if as_json:
        typer.echo(json.dumps(told | {"files": files}, indent=2))
        return
    print_table([(key.replace("_", " "), _short(value)) for key, value in told.items()], files)


def _short(value: Any) -> str:
    if isinstance(value, list):
        return "; ".join(_short(v) for v in value) if value and isinstance(value[0], list) else _listed(value)
    return str(value)


def _listed(values: list[Any]) -> str:
    write: Callable[[Any], str] = lambda v: "none" if v is None else f"{v:.5g}"  # noqa: E731
    return (" to " if len(values) == 2 else ", ").join(map(write, values))

"""`rotorsim response`, `campbell` and `modes`: linear analyses of a machine at speeds that are given."""

from __future__ import annotations

import sys
from itertools import pairwise
from math import isnan, pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_csv
from rotorsim.base.units import TO_HZ, TO_RPM, TO_UM
from rotorsim.commands import options
from rotorsim.commands.registry import command
from rotorsim.commands.results import results

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from rotorsim.effects.rotor.unbalance import RotorUnbalance
    from rotorsim.machine import Machine
    from rotorsim.plant import Plant

Speeds = Annotated[
    str | None, typer.Option("--speeds", help="Speeds: FROM:TO:COUNT, or values with commas.", show_default=options.TOP)
]
MOST = 100
"""Modes of a Campbell diagram."""
STEPS = {"response": 80, "campbell": 40}
"""Steps of the default speeds."""


@command(
    "response",
    "rotorsim response dtu_gas_bearing --pressure '0.5 MPa' --speeds '500 rpm:12000 rpm:80' --unbalance '10 g*mm'",
    "rs.analysis.unbalance_response(plant, speeds, 0.5e6)",
)
def response(
    machine: options.GivenMachine,
    speeds: Speeds = None,
    pressure: options.Pressure = None,
    unbalance: Annotated[
        str | None, typer.Option(help="Mass times eccentricity, e.g. '10 g*mm'; default that of the machine.")
    ] = None,
    disc: Annotated[
        str | None, typer.Option(help="Disc that carries it, by name or counted from 0; default the first.")
    ] = None,
    *,
    settings: options.GridOptions,
    result: options.ResultOptions,
) -> None:
    """Unbalance response over speed: amplitude and phase.

    At the measuring plane, discs, bearings and probes.
    """
    result.check()
    plant, grid, supply = _operating_line(machine, settings, speeds, pressure, "response")
    import numpy as np

    from rotorsim.analysis.shaft_motion import peak_of, unbalance_response
    from rotorsim.analysis.whirl_onset import onset_beyond

    given = _unbalance(plant.machine, unbalance, disc)
    with result.folder("response", "response.nc", "response.csv") as folder:
        options.note_compiling(plant.assembly, "settle")
        found = unbalance_response(plant, grid, supply, given)
        above = onset_beyond(plant, max(grid, key=abs), [supply])
        _write(found, folder, "response", _response_rows(found))
        if result.report:
            folder.write_page_of(found)
    peaks = {place: peak_of(found, place) for place in map(str, found["place"].values)}
    numbers = {"unbalance": found.attrs["unbalance"], "peaks": peaks, "above_asked": above,
               "warnings": options.warn_of(found)}  # fmt: skip
    step = max((float(b - a) * TO_RPM for a, b in pairwise(sorted(grid))), default=0.0)
    rows = [("unbalance", found.attrs["unbalance"]), *((f"peak at {p}", _text(one, step)) for p, one in peaks.items())]
    result.show(numbers, [*rows, *([(options.ABOVE, above)] if above else ())], folder.files)
    if not np.isfinite(found["major"].values).any():
        way = "raise the pressure" if plant.machine.fed else "ask for higher speeds"
        print(f"response: the film carries the rotor at no speed; {way}", file=sys.stderr)
        raise typer.Exit(2)


@command(
    "campbell",
    "rotorsim campbell plain_rotor --speeds '0 rpm:12000 rpm:40' --modes 6 --critical-map",
    "rs.analysis.campbell(plant, speeds, modes=6)",
)
def campbell(
    machine: options.GivenMachine,
    speeds: Speeds = None,
    pressure: options.Pressure = None,
    modes: Annotated[int, typer.Option(help="Modes that are shown, the lowest of the region.", min=1, max=MOST)] = 8,
    critical_map: Annotated[
        bool, typer.Option("--critical-map", help="Undamped critical speeds over the bearings' stiffness too.")
    ] = False,
    stiffness: Annotated[str, typer.Option(help="Range of that stiffness, FROM:TO.")] = "0.1 MN/m:1000 MN/m",
    *,
    settings: options.GridOptions,
    result: options.ResultOptions,
) -> None:
    """Campbell diagram with critical speeds of the orders 1, 2, 3.

    All modes of a region of frequency and damping are followed; the lowest ones are shown.
    """
    result.check()
    ends = None
    if critical_map:
        from rotorsim.analysis.axes import read_axis

        ends = read_axis("stiffness", f"{stiffness}:2", "N/m")
    plant, grid, supply = _operating_line(machine, settings, speeds, pressure, "campbell")
    from rotorsim.analysis.campbell import campbell as find_modes, critical_speed_map
    from rotorsim.analysis.whirl_onset import onset_beyond

    with result.folder("campbell", "campbell.nc", "campbell.csv") as folder:
        options.note_compiling(plant.assembly, "settle")
        found, above = find_modes(plant, grid, supply, modes), onset_beyond(plant, max(grid, key=abs), [supply])
        lines = None if ends is None else critical_speed_map(plant, (float(ends[0]), float(ends[1])))
        kept = found if lines is None else found.assign(undamped_critical_speed=lines["wn"])
        _write(kept, folder, "campbell", _mode_rows(found))
        if result.report:
            folder.write_page_of(kept)
    numbers, rows = _criticals(found)
    result.show(numbers | {"above_asked": above}, [*rows, *([(options.ABOVE, above)] if above else ())], folder.files)


def _operating_line(
    machine: str, settings: options.GridOptions, speeds: str | None, pressure: str | None, analysis: str
) -> tuple[Plant, np.ndarray, float]:
    """Plant, speeds (n,) [rad/s] that its discs stand, and gauge supply pressure [Pa] of an analysis over the speed.

    The default speeds of a response leave rest out, where no unbalance acts.
    """
    from rotorsim.analysis.axes import read_axis

    given = None if speeds is None else read_axis("speeds", speeds, "rad/s")
    supply = options.quantity("pressure", pressure or options.SUPPLY, "Pa")
    plant = settings.plant(machine)
    from rotorsim.analysis.campbell import default_speeds

    grid = default_speeds(plant, STEPS[analysis])[analysis == "response" :] if given is None else given
    options.note_unfed(plant.machine, bool(pressure and supply))
    from rotorsim.machine.limits import ask_rim_speed

    ask_rim_speed(plant.machine, max(grid, key=abs), "--speeds")
    return plant, grid, supply


def _criticals(found: xr.Dataset) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Critical speeds of a Campbell diagram for a program, and as rows of text."""
    from rotorsim.analysis.campbell import critical_rows, modes_line, searched_line

    names = ("order", "rpm", "direction", "zeta", "whirl", "mode")
    criticals = [dict(zip(names, row, strict=True)) for row in critical_rows(found)]
    numbers = {"criticals": criticals, "modes": _finite(found["modes"].values),
               "missing": _finite(found["missing"].values), "warnings": options.warn_of(found)}  # fmt: skip
    rows = [
        (f"{c['order']}X critical speed",
         f"{c['rpm']:.0f} rpm, where mode {c['mode']} {c['direction']} it, damping {c['zeta']:.3g}, {c['whirl']}")
        for c in criticals
    ]  # fmt: skip
    return numbers, [("modes", modes_line(found)), *rows, ("searched", searched_line(found))]


def _finite(values: np.ndarray) -> list[int | None]:
    return [None if v != v else int(v) for v in values]


def _unbalance(machine: Machine, me: str | None, disc: str | None) -> tuple[RotorUnbalance, ...] | None:
    if me is None:
        if disc is not None:
            raise DataError("--disc: places the unbalance of --unbalance; give both, e.g. --unbalance '10 g*mm'")
        return None
    from rotorsim.effects.rotor.unbalance import RotorUnbalance

    size = options.quantity("unbalance", me, "kg*m")
    if not 0 < size <= 1e-2:
        raise DataError(f"--unbalance: '{me}' is not above 0 and at most 10 kg*mm; write e.g. '10 g*mm'")
    if disc is None:
        return (RotorUnbalance(me=size),)
    found = {str(i): one for i, one in enumerate(machine.discs)} | dict(
        zip(machine.disc_names, machine.discs, strict=True)
    )
    if disc not in found:
        known = ", ".join(found) or "none"
        raise DataError(f"--disc: there is no disc {disc} in {machine.name}; its discs are {known}")
    return (RotorUnbalance(me=size, position=found[disc].position),)


def _write(found: xr.Dataset, folder: options.ResultFolder, name: str, rows: list[tuple[object, ...]]) -> None:
    """Write a result as NetCDF, and its rows as CSV."""
    from rotorsim.base.hdf5 import write_netcdf

    write_netcdf(folder.add(name, f"{name}.nc"), found)
    write_csv(folder.add("table", f"{name}.csv"), [str(head) for head in rows[0]], rows[1:])


def _response_rows(found: xr.Dataset) -> list[tuple[object, ...]]:
    """Amplitude and phase of x and y at every place, by speed, and the least damping ratio: below 0 a mode grows."""
    import numpy as np

    response = found["response_re"].values + 1j * found["response_im"].values
    at = [(str(p), k, axis, j) for k, p in enumerate(found["place"].values) for j, axis in enumerate("xy")]
    head = ["speed [rpm]"]
    for place, _, axis, _ in at:
        head += [f"{place} {axis} [um 0-pk]", f"{place} {axis} phase lag [deg]"]
    rows: list[tuple[object, ...]] = [(*head, "zeta_least [1]")]
    for speed, row, zeta in zip(found["speed"].values * TO_RPM, response, found["zeta_least"].values, strict=True):
        values = [v for _, k, _, j in at for v in (abs(row[k, j]) * TO_UM, -np.degrees(np.angle(row[k, j])))]
        rows.append((speed, *("" if np.isnan(v) else v for v in (*values, zeta))))
    return rows


def _mode_rows(found: xr.Dataset) -> list[tuple[object, ...]]:
    """Frequency, damping ratio and sense of every mode, by speed."""
    branches = range(found.sizes["branch"])
    head = ["speed [rpm]"]
    for k in branches:
        head += [f"mode {k + 1} [Hz]", f"mode {k + 1} damping ratio [1]", f"mode {k + 1} whirl"]
    rows: list[tuple[object, ...]] = [tuple(head)]
    for k, speed in enumerate(found["speed"].values * TO_RPM):
        one = found.isel(speed=k)
        values = [
            v
            for b in branches
            for v in (float(one["wn"][b]) * TO_HZ, float(one["zeta"][b]), str(one["whirl"].values[b]))
        ]
        rows.append((speed, *("" if v != v else v for v in values)))
    return rows


def _text(peak: dict[str, Any] | None, step: float) -> str:
    """A peak among speeds that are at most a step [rpm] apart."""
    if peak is None:
        return "none"
    from rotorsim.analysis.shaft_motion import ENDS

    end = f", {ENDS[peak['at_end']]}" if peak["at_end"] else ""
    return f"{peak['um']:.3g} um 0-pk at {peak['rpm']:.0f} rpm{f' on steps of {step:.3g} rpm' if step else ''}{end}"


@command(
    "modes",
    "rotorsim modes dtu_gas_bearing --speed '6000 rpm' --pressure '0.5 MPa' --out my_modes",
    "rs.analysis.mode_shapes(plant, 628.3, 0.5e6)",
)
def modes(
    machine: options.MachineName = "dtu_gas_bearing",
    speed: Annotated[str, typer.Option(help="Speed of the shaft.")] = "6000 rpm",
    pressure: options.Pressure = None,
    count: Annotated[int, typer.Option(help="Modes to draw, the lowest first.", min=1)] = 4,
    *,
    settings: options.GridOptions,
    show: Annotated[bool, typer.Option("--show", help="Open a window to turn the modes in.")] = False,
    pictures: Annotated[
        bool | None, typer.Option("--pictures/--no-pictures", help="Draw each mode as PNG; if pyvista is there.")
    ] = None,
    film: Annotated[
        str, typer.Option(help="Film each mode as well: gif, or mp4, which needs the program ffmpeg.")
    ] = "",
    out: Annotated[
        Path | None, typer.Option(callback=options.a_folder, help="Folder; default a new folder 'modes'.")
    ] = None,
    force: options.Force = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the modes as JSON.")] = False,
) -> None:
    """Draw the modes of rotor and film at one operating point."""
    at = options.quantity("speed", speed, "rad/s"), options.quantity("pressure", pressure or options.SUPPLY, "Pa")
    plant = settings.plant(machine)
    options.note_unfed(plant.machine, bool(pressure and at[1]))
    from rotorsim.analysis.shaft_motion import mode_shapes
    from rotorsim.base.hdf5 import write_netcdf
    from rotorsim.machine.limits import ask_rim_speed
    from rotorsim.report.scenes import lacking

    ask_rim_speed(plant.machine, at[0], "--speed")
    wanted = pictures is not False or show or bool(film)
    _check_film(film)
    missing = lacking() if wanted else ""
    if missing and (pictures or show or film):
        raise DataError(missing)
    endings = ["png"] * (pictures is not False) + [film] * bool(film)
    names = [f"mode_{k + 1}.{ending}" for ending in endings for k in range(count)]
    with results(out, "modes", ["modes.nc", *names], force) as folder:
        options.note_compiling(plant.assembly, "settle")
        found = mode_shapes(plant, *at)
        found = found.isel(mode=slice(count))
        found = found.assign_attrs(_mode_warnings(found, plant, at[0]))
        write_netcdf(folder / "modes.nc", found)
        files = {"modes": str(folder / "modes.nc")}
        if wanted and not missing:
            drawn, missing = _draw_modes(found, folder, endings, show)
            files |= drawn
    _print_modes(found, files, as_json)
    if missing:
        print(missing, file=sys.stderr)
        if pictures or show or film:
            raise typer.Exit(2)


def _mode_warnings(found: xr.Dataset, plant: Plant, speed: float) -> dict[str, str]:
    """Attribute `warnings` at a speed [rad/s], with the modes below the highest one shown that are not listed."""
    from rotorsim.plant.validity import linear_warnings

    stated = linear_warnings(plant, speed, found.attrs["zeta_least"], found.attrs["pressure"])
    top = found["wn"].values.max(initial=0.0)
    left = sorted(f * TO_HZ for f in found.attrs["not_listed"].tolist() if f < top)
    sentences = [stated["warnings"]] if stated else []
    if left:
        sentences.append(
            f"not listed: {len(left)} modes with a damping ratio below 0.5, from {left[0]:.4g} to {left[-1]:.4g} Hz; "
            "`rotorsim campbell` has them"
        )
    if isnan(found.attrs["zeta_least"]):
        sentences.append("whether every mode is damped is not known: their number is not proven")
    return {"warnings": "\n".join(sentences)} if sentences else {}


def _draw_modes(found: xr.Dataset, folder: Path, endings: list[str], show: bool) -> tuple[dict[str, str], str]:
    """Files of pictures and films, and why there are none."""
    from rotorsim.report.scenes import draw_modes, show_modes

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
    from rotorsim.report.scenes import ENDINGS, check_program

    known = [ending[1:] for ending in ENDINGS[1:]]
    if film and film not in known:
        raise DataError(f"--film: '{film}' is not known; choose one of {', '.join(known)}")
    if film:
        check_program(Path(f"mode.{film}"))


def _print_modes(found: xr.Dataset, files: dict[str, str], as_json: bool) -> None:
    warnings = options.warn_of(found)
    rows = [
        {"mode": k + 1, "frequency_hz": float(found["wn"][k]) / (2 * pi), "damping_ratio": float(found["zeta"][k]),
         "whirl": str(found["whirl"].values[k])}
        for k in range(found.sizes["mode"])
    ]  # fmt: skip
    if as_json:
        options.print_json({"modes": rows, "warnings": warnings, "files": files})
        return
    options.print_table(
        [(f"mode {r['mode']}", f"{r['frequency_hz']:.2f} Hz, damping {r['damping_ratio']:.4f}, {r['whirl']}")
         for r in rows],
        files,
    )  # fmt: skip

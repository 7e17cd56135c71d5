"""`rotorsim map` and `rotorsim sweep`: an analysis over a grid of operating points or values of the machine file.

A map has equilibrium, modes, gains, delays and film coefficients; a sweep quantities for design.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite, pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from rotorsim.base.display import bar
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_RPM, TO_UM, show
from rotorsim.commands import options
from rotorsim.commands.campaign import RunOptions
from rotorsim.commands.registry import command
from rotorsim.commands.results import results

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from rotorsim.analysis import SweepResult
    from rotorsim.analysis.axes import Field
    from rotorsim.campaign.run import CampaignOutcome
    from rotorsim.plant import Plant

STEPS, PRESSURES = 10, "0.3 MPa:0.7 MPa:5"
RANGES: dict[str, tuple[str, float]] = {
    "natural_frequency_hz": ("wn", 1 / (2 * pi)),
    "damping_ratio": ("zeta", 1.0),
    "eccentricity_ratio": ("eccentricity_ratio", 1.0),
    "smallest_film_um": ("h_min", TO_UM),
}
"""Smallest and largest value over the map: name, variable, factor."""
LISTED: dict[str, tuple[str, str, float]] = {
    "lift_off_pressure": ("lift_off_mpa", "Lift-off pressure [MPa]", 1e-6),
    "onset_speed": ("whirl_onset_rpm", "Whirl onset [rpm]", TO_RPM),
    "onset_ratio": ("whirl_ratio", "Whirl frequency ratio at the onset", 1.0),
    "crossing_speed": ("crossings_rpm", "Critical speeds [rpm]", TO_RPM),
}
"""Key of the summary, title of the table and factor of each variable that has a table of its own."""
LOOKED: dict[str, tuple[str, str]] = {
    "onset_speed": ("onset_looked", "whirl_onset_looked"),
    "onset_ratio": ("onset_looked", "whirl_onset_looked"),
    "crossing_speed": ("crossing_searched", "crossings_searched"),
}
"""Flag of each such variable, 1 where all of it was searched, and the flag's key of the summary."""


@dataclass(frozen=True)
class MapOptions:
    """Options about the grid of operating points and what is searched on it."""

    speed: Annotated[
        str | None, typer.Option(help="Speeds: FROM:TO:COUNT, or values with commas.", show_default=options.TOP)
    ] = None
    pressure: Annotated[
        str | None, typer.Option(help="Gauge supply pressures, likewise.", show_default=f"{PRESSURES}, {options.FED}")
    ] = None
    over: Annotated[
        list[str] | None, typer.Option(help="Another axis: PATH=FROM:TO:COUNT of a field of the machine file.")
    ] = None
    frequency: Annotated[
        list[str] | None, typer.Option(help="Whirl frequency of K and C, e.g. '120 Hz'; default 0 and the modes'.")
    ] = None
    with_lift_off: Annotated[bool, typer.Option("--lift-off", help="Find the lift-off pressure by speed.")] = False
    least_film: Annotated[str, typer.Option(help="Film that counts as lift-off; 0: what the plant runs on.")] = "0 um"
    with_onset: Annotated[bool, typer.Option("--whirl-onset", help="Find the onset of whirl by pressure.")] = False
    campbell: Annotated[bool, typer.Option("--campbell", help="Find the critical speeds of orders 1, 2, 3.")] = False

    def read(self, plant: Plant) -> MapGrid:
        """The grid in SI; raises MachineFileError for an option that cannot be read."""
        from rotorsim.analysis.axes import read_axis, read_field
        from rotorsim.analysis.campbell import default_speeds

        whirl = [2 * pi * options.quantity("frequency", text, "Hz") for text in self.frequency or []]
        return MapGrid(
            default_speeds(plant, STEPS) if self.speed is None else read_axis("speed", self.speed, "rad/s"),
            read_axis("pressure", PRESSURES if self.pressure is None else self.pressure, "Pa"),
            [read_field(text) for text in self.over or []],
            whirl or None,
            options.quantity("least-film", self.least_film, "m"),
        )


@dataclass(frozen=True)
class MapGrid:
    """Speeds [rad/s], gauge pressures [Pa], further axes, whirl frequencies [rad/s] and least film [m] of a map."""

    speeds: np.ndarray
    pressures: np.ndarray
    fields: list[Field]
    whirl: list[float] | None
    film: float


@command(
    "map",
    "rotorsim map dtu_gas_bearing --speed '0 rpm:6000 rpm:7' --pressure '0.3 MPa:0.7 MPa:5' "
    "--over 'bearings.1.clearance=23 um, 25 um, 27 um' --lift-off --whirl-onset --campbell --out my_map",
    "rs.analysis.map_machine(plant, speeds, pressures)",
)
def map_command(
    machine: options.MachineName = "dtu_gas_bearing",
    *,
    wanted: MapOptions,
    settings: options.GridOptions,
    jobs: Annotated[int | None, typer.Option(help="Processes; default as many as pay.")] = None,
    result: options.ResultOptions,
) -> None:
    """Map the operating points of a machine and shade what is safe.

    Equilibria and linear models; no time simulation.
    """
    result.check()
    plant = settings.plant(machine)
    grid = wanted.read(plant)
    fed = _check(plant, grid, wanted)
    from rotorsim.analysis.operating_map import map_machine, unsafe_lines
    from rotorsim.analysis.whirl_onset import onset_beyond

    with result.folder("map", "map.nc") as folder:
        options.note_compiling(plant.assembly, "settle")
        with bar(text="operating points", show=not result.as_json) as update:
            found = map_machine(
                plant, grid.speeds, grid.pressures, grid.fields, grid.whirl,
                grid.film if wanted.with_lift_off else None, wanted.with_onset, wanted.campbell, jobs,
                update and (lambda done, total: update(completed=done, total=total)),
            )  # fmt: skip
        from rotorsim.base.hdf5 import write_netcdf

        write_netcdf(folder.add("map", "map.nc"), found)
        if result.report and "wn" in found:
            folder.write_page_of(found)
    if not result.as_json:
        for table in tables(found):
            options.Console().print(table)
    numbers, listed = summary(found), {key for key, *_ in LISTED.values()} | {key for _, key in LOOKED.values()}
    rows = [(key.replace("_", " "), _short(value)) for key, value in numbers.items() if key not in listed]
    reasons = unsafe_lines(found)
    rows += [("why not safe", line) for line in reasons]
    looked = wanted.with_onset or grid.fields or found.attrs["ended"] != "complete"
    above = "" if looked else onset_beyond(plant, max(grid.speeds, key=abs), found["pressure"].values[[0, -1]])
    rows += [(options.ABOVE, above)] if above else []
    result.show(numbers | {"why_not_safe": reasons, "above_asked": above}, rows, folder.files)
    _leave_if_incomplete(found, folder.files["map"], fed)


def _check(plant: Plant, grid: MapGrid, wanted: MapOptions) -> bool:
    """Refuse or question what the machines of a map cannot do; whether one of them is fed."""
    import numpy as np

    from rotorsim.analysis.operating_map import check_quantities, machines_at_ends
    from rotorsim.analysis.supply import felt
    from rotorsim.machine.limits import ask_rim_speed
    from rotorsim.machine.plausibility import ask_machine

    check_quantities(plant, wanted.with_lift_off, wanted.with_onset)
    ask_rim_speed(plant.machine, max(grid.speeds, key=abs), "--speed")
    machines = machines_at_ends(plant, grid.fields)
    for one in machines:
        ask_machine(one)
    if wanted.pressure is not None and not np.array_equal(felt(machines, grid.pressures), grid.pressures):
        options.note_unfed(plant.machine, given=True)
    return any(one.fed for one in machines)


def _leave_if_incomplete(found: xr.Dataset, path: str, fed: bool) -> None:
    """Exit with one sentence where the map was interrupted or the film carries the rotor nowhere."""
    if found.attrs["ended"] != "complete":
        print(f"interrupted: the points that were done are in {path}", file=sys.stderr)
        raise typer.Exit(130)
    if not float(found["lifted"].max()):
        way = "raise the pressures" if fed else "ask for higher speeds"
        print(f"map: the film carries the rotor at no point of the grid; {way}", file=sys.stderr)
        raise typer.Exit(2)


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
    import numpy as np

    good = values[np.isfinite(values)]
    return [float(good.min()), float(good.max())] if good.size else [None, None]


def _plain(values: Any) -> Any:
    """Nested lists with None for NaN: JSON has no NaN."""
    if getattr(values, "ndim", 0):
        return [_plain(v) for v in values]
    return None if values != values else float(values)


def _short(value: Any) -> str:
    """A number, or the ends of a range."""
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, list):
        return " to ".join(map(_short, value))
    return "none" if value is None else str(value)


def tables(found: xr.Dataset) -> Iterator[Table]:
    """One table per variable, with the last dimension along the columns and one column for each other one."""
    for name, (_, title, scale) in LISTED.items():
        if name not in found:
            continue
        values = found[name]
        *rows, across = map(str, values.dims)
        made = Table(title=title, title_justify="left")
        for head in (*(_title(found, row) for row in rows), *(_label(found, across, k, True) for k in values[across])):
            made.add_column(head)
        known = found[LOOKED[name][0]].broadcast_like(values).transpose(*values.dims).values if name in LOOKED else None
        for at in product(*(range(values.sizes[row]) for row in rows)):
            cells = [_label(found, row, found[row][k], False) for row, k in zip(rows, at, strict=True)]
            shown = [_number(float(v) * scale, known is None or known[at][k]) for k, v in enumerate(values.values[at])]
            made.add_row(*cells, *shown)
        yield made


def _title(found: xr.Dataset, dimension: str) -> str:
    """Path of a field, or the dimension's own name."""
    path = str(found[dimension].attrs.get("long_name", dimension))
    return path if path.replace(".", "_") == dimension else dimension.removeprefix("mode_")


def _label(found: xr.Dataset, dimension: str, value: Any, named: bool) -> str:
    """A coordinate's value with its unit, after the dimension's name if `named`."""
    unit = str(found[dimension].attrs.get("units", "1"))
    number = value.item()
    if unit == "rad/s":
        text = f"{number * TO_RPM:.5g} rpm"
    else:
        text = show(float(f"{number:.9g}"), unit) if isinstance(number, float) else str(number)
    return f"{_title(found, dimension)} {text}" if named else text


def _number(value: float, looked: Any) -> str:
    """A value; without one, whether there is none or not all was looked at."""
    if isfinite(value):
        return f"{value:.5g}"
    return "none" if looked else "not known"


REPORT, CAMPAIGN, WHAT = "report.html", "campaign", "lift_off,onset,flow"


@dataclass(frozen=True)
class RandomOptions:
    """Options about machines that are random within their tolerances."""

    random: Annotated[int | None, typer.Option(help="Random machines, instead of the axes of --over.")] = None
    vary: Annotated[
        list[str] | None, typer.Option(help="Values with tolerances: 'PATH=18 um +- 2 um, PATH=+- 10 % normal'.")
    ] = None
    require: Annotated[
        list[str] | None, typer.Option(help="Limit whose misses are counted: 'onset > 30000 rpm'; may be repeated.")
    ] = None
    seed: Annotated[int, typer.Option(min=0, help="Seed of the Latin hypercube.")] = 0

    def check(self, over: bool) -> None:
        """Raise DataError for options that do not go together."""
        if self.random is None and (self.vary or self.require):
            raise DataError("--vary: is for random machines; add --random 500")
        if self.random is not None and self.random < 2:
            raise DataError(f"--random: {self.random} machines have no distribution; give 2 or more, e.g. 500")
        if self.random is not None and (over or not self.vary):
            raise DataError("--random: takes --vary and no --over; write e.g. --vary 'bearings.*.clearance=+- 10 %'")


def random_sweep(
    plant: Plant, given: RandomOptions, what: str | None, at: tuple[float, float, float | None], run: RunOptions,
    result: options.ResultOptions,
) -> None:  # fmt: skip
    """Run random machines; write and print their distributions."""
    from rotorsim.analysis.tolerances import DEFAULT, NETCDF, TABLE, random_machines
    from rotorsim.campaign.scheduler import spread_on

    chosen = run.settings()
    names = what or ",".join(name for name in DEFAULT if name != "flow" or plant.machine.fed)
    workers = spread_on(chosen.scheduler, chosen.tls, chosen.workers)
    with result.folder("sweep", NETCDF, TABLE) as folder, workers as each:
        options.note_compiling(plant.assembly, "settle")
        with bar(text="machines", show=not run.as_json) as update:
            found = random_machines(
                plant, given.vary or (), given.random or 0, names, given.require or (), *at, given.seed, each=each,
                progress=update and (lambda done, total: update(completed=done, total=total)),
            )  # fmt: skip
        for kind, path in found.write(folder.path).items():
            folder.files[kind] = path
        if result.report:
            folder.write_page_of(found)
    if run.as_json:
        options.print_json(found.numbers() | {"files": folder.files})
        return
    from rotorsim.report.random import random_rows

    options.print_table(random_rows(found), folder.files)


@command(
    "sweep",
    "rotorsim sweep dtu_gas_bearing --over 'bearings.1.clearance=20 um:30 um:5' --over 'pressure=0.3 MPa:0.7 MPa:5' "
    "--what lift_off,onset,flow --out my_sweep",
    "rs.analysis.sweep(machine, {'bearings.1.clearance': '20 um:30 um:5'}, ('lift_off', 'onset', 'flow'))",
)
def sweep(
    machine: options.GivenMachine,
    over: Annotated[
        list[str] | None,
        typer.Option(help="Axis PATH=FROM:TO:COUNT, PATH=A,B or PATH=-10%:+10%:5; PATH may be speed or pressure."),
    ] = None,
    what: Annotated[
        str,
        typer.Option(
            help="Quantities: lift_off, onset, load, flow, damping, frequency, peak, thrust_gap, axial_damping, ..."
        ),
    ] = WHAT,
    speed: Annotated[str, typer.Option(help="Shaft speed, where it is not an axis.")] = "0 rpm",
    pressure: Annotated[
        str | None,
        typer.Option(help="Gauge supply pressure, where it is not an axis.", show_default=options.SUPPLIED),
    ] = None,
    highest_speed: Annotated[
        str | None, typer.Option(help="Speed up to which onset and peak are searched; default by the machine.")
    ] = None,
    *,
    tolerances: RandomOptions,
    settings: options.GridOptions,
    run: RunOptions,
    page: options.PageOptions,
    out: Annotated[
        Path, typer.Option(callback=options.a_folder, help="Folder; the same sweep in it is continued.")
    ] = Path("sweep"),
    report: options.WithReport = True,
) -> None:
    """Sweep machine, speed or pressure and find the best points.

    Lift-off, whirl onset, load, flow, damping and response at every point, or over random machines with --random.
    """
    page.check(report)
    plant = settings.plant(machine)
    tolerances.check(bool(over))
    from rotorsim.analysis.sweep import NETCDF, TABLE
    from rotorsim.analysis.sweep_definition import make_sweep
    from rotorsim.campaign.run import plan_of, run_sweep
    from rotorsim.campaign.store import MANIFEST
    from rotorsim.report.page import write

    chosen = run.settings()
    point = options.quantity("speed", speed, "rad/s"), options.quantity("pressure", pressure or options.SUPPLY, "Pa")
    top = None if highest_speed is None else options.quantity("highest-speed", highest_speed, "rad/s")
    if tolerances.random is not None:
        asked = None if what == WHAT else what
        random_sweep(plant, tolerances, asked, (*point, top), run, options.ResultOptions(out, False, report, page))
        return
    defined = make_sweep(plant, over or (), what, *point, top)
    plan_of(defined)
    names = (NETCDF, TABLE, REPORT) if report else (NETCDF, TABLE)
    again = (out / CAMPAIGN / MANIFEST).is_file()
    with results(out, "sweep", names, again) as folder:
        page.begin(folder / REPORT, again or None)
        if chosen.scheduler is None:
            options.note_compiling(plant.assembly, "settle")
        found, outcome = run_sweep(defined, folder / CAMPAIGN, chosen)
        files = found.write(folder) | {"campaign": str(folder / CAMPAIGN)}
        if report:
            files["report"] = str(write(found, folder / REPORT))
            files |= page.finish(files["report"])
    _print(found, outcome, files, run.as_json)


@command(
    "optimise",
    "rotorsim optimise aerostatic_spindle --over 'bearings.*.clearance=15 um, 25 um' --objective onset "
    "--require 'flow < 400 mg/s' --speed '30000 rpm'",
    "rs.analysis.optimise(machine, {'bearings.*.clearance': '15 um, 25 um'}, 'onset', ['flow < 400 mg/s'])",
)
def optimise(
    machine: options.GivenMachine,
    over: Annotated[list[str], typer.Option(help="Bounds of a value: 'PATH=15 um, 25 um'; may be repeated.")],
    objective: Annotated[
        str,
        typer.Option(
            help="Quantity that is to be best: of a sweep, or critical_1, ...; '+' or '-' in front states it."
        ),
    ],
    require: Annotated[
        list[str] | None, typer.Option(help="Limit that is to be kept: 'flow < 400 mg/s'; may be repeated.")
    ] = None,
    speed: Annotated[str, typer.Option(help="Shaft speed.")] = "0 rpm",
    pressure: options.Pressure = None,
    highest_speed: Annotated[
        str | None,
        typer.Option(help="Speed up to which onset and critical speeds are searched; default by the machine."),
    ] = None,
    *,
    settings: options.GridOptions,
    result: options.ResultOptions,
) -> None:
    """Search values of a machine for which a quantity is best.

    Limits are kept; the path of the search is shown.
    """
    result.check()
    plant = settings.plant(machine)
    point = options.quantity("speed", speed, "rad/s"), options.quantity("pressure", pressure or options.SUPPLY, "Pa")
    top = None if highest_speed is None else options.quantity("highest-speed", highest_speed, "rad/s")
    options.note_unfed(plant.machine, bool(pressure and point[1]))
    from rotorsim.analysis.optimise import optimise as search
    from rotorsim.base.files import write_csv

    with result.folder("optimise", "path.csv") as folder:
        options.note_compiling(plant.assembly, "settle")
        with bar(text="machines", show=not result.as_json) as update:
            found = search(plant, over, objective, require or (), *point, top,
                           update and (lambda done, total: update(completed=done, total=total)))  # fmt: skip
        heads, steps = found.table()
        write_csv(folder.add("path", "path.csv"), heads, steps)
        if result.report:
            folder.write_page_of(found)
    rows = [
        ("best", ", ".join(f"{path} = {value}" for path, value in found.machine.items()) or "no step keeps the limits")
    ]
    if found.best is not None:
        rows += [(head, f"{value:.5g}") for head, value in zip(heads[:-1], steps[found.best], strict=False)]
    result.show(found.numbers(), rows, folder.files)
    if found.best is None:
        print(
            "optimise: no machine of the search keeps every limit; widen the bounds or relax a limit", file=sys.stderr
        )
        raise typer.Exit(2)


def _print(found: SweepResult, outcome: CampaignOutcome, files: dict[str, str], as_json: bool) -> None:
    """Print best points, reasons and files; exit with 130 or 143 where it was stopped."""
    if as_json:
        options.print_json(found.numbers() | {"seconds": outcome.seconds, "files": files})
    else:
        from rotorsim.report.sweep import best_rows, reason_rows

        console = options.Console()
        console.print(_table(("quantity", "best is the", "value", "at"), best_rows(found)))
        if found.reasons:
            console.print(_table(("without a result", "reason", "cells"), reason_rows(found)))
        for kind, path in files.items():
            console.print(f"{kind}: {path}", soft_wrap=True)
    if outcome.stopped:
        print(f"stopped: {outcome.pending} cases are left; the same command continues", file=sys.stderr)
        raise typer.Exit(128 + outcome.stopped)


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Table:
    table = Table(*head)
    for row in rows:
        table.add_row(*row)
    return table

"""`rotorsim fmu`: export of plant, identified model or law as an FMU, checks of a unit, and system export."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorsim.analysis.axes import read_field
from rotorsim.base.errors import DataError
from rotorsim.commands.options import AsJson, MachineName, PlantOptions, print_json, quantity
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files

if TYPE_CHECKING:
    from fmu.linear_units import LawUnit, LinearUnit
    from fmu.model import PlantUnit
    from fmu.turned import Over
    from rotorsim.plant import Plant

VERDICTS = {True: "pass", False: "FAIL", None: "info"}
"""Words for a check that passed, one that failed and a remark."""
Force = Annotated[bool, typer.Option("--force", help="Replace the files if they are there.")]
UnitFile = Annotated[Path, typer.Argument(metavar="FILE", help="A .fmu file.")]


@group("fmu")
class Fmu(CommandGroup):
    """Export, check and show the plant as a functional mock-up unit."""


@dataclass(frozen=True)
class UnitOptions:
    """Options about the machine code of units and about where they start."""

    targets: Annotated[
        str, typer.Option(help="Platforms, with commas: host, x86_64-linux, x86_64-windows, aarch64-linux, ...")
    ] = "host"
    cpu: Annotated[str, typer.Option(help="'portable', or 'native' for this computer's processor alone.")] = "portable"
    speed: Annotated[
        str | None,
        typer.Option(
            help="Speed at which it starts.", show_default="0 rpm; of an identified model the middle of its range"
        ),
    ] = None
    pressure: Annotated[
        str | None,
        typer.Option(
            help="Gauge injection pressure at which it starts.",
            show_default="0.3 MPa; of an identified model the middle of its range",
        ),
    ] = None

    @property
    def start(self) -> tuple[float | None, float | None]:
        """Speed [rad/s] and gauge pressure [Pa], as far as they are given; raises MachineFileError."""
        return (
            None if self.speed is None else quantity("speed", self.speed, "rad/s"),
            None if self.pressure is None else quantity("pressure", self.pressure, "Pa"),
        )


@command(
    "fmu export",
    "rotorsim fmu export dtu_gas_bearing --fmi 2,3 --targets host --out rotor.fmu",
    "rs.fmu.export(plant, 'rotor.fmu')",
)
def export(
    machine: MachineName = "dtu_gas_bearing",
    model: Annotated[str, typer.Option(help="'plant', or a JSON file of an identified LPV model.")] = "plant",
    law: Annotated[Path | None, typer.Option(help="A control law that 'rotorsim design' wrote.")] = None,
    fmi: Annotated[str, typer.Option(help="FMI versions: 2, 3, or 2,3 for a file of each.")] = "3",
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="rotor.fmu; with --c-only the unit's name")
    ] = None,
    *,
    c_only: Annotated[
        bool, typer.Option("--c-only", help="Write the law as C99 for a microcontroller, one .c and one .h, no unit.")
    ] = False,
    precision: Annotated[str, typer.Option(help="Numbers of --c-only: float64 or float32.")] = "float64",
    unit: UnitOptions,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Bound the work of a step: 50 corrections, or solver.corrections.")
    ] = False,
    name: Annotated[
        str | None,
        typer.Option(help="Name of the model and its libraries.", show_default="that of the subject and of its kind"),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(help="Values of the machine that it offers: 'discs.0.mass=1.2 kg, 1.8 kg'; may be repeated."),
    ] = None,
    clocked: Annotated[
        bool, typer.Option("--clocked", help="A law that answers at the ticks of a periodic clock (FMI 3.0).")
    ] = False,
    source: Annotated[bool, typer.Option("--source", help="Put the unit's sources next to its binaries.")] = False,
    settings: PlantOptions,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write the plant, an identified model or a control law as .fmu files that run without Python."""
    if law is not None and model != "plant":
        raise DataError("--law and --model: a unit holds one of them; give one")
    of_plant = law is None and model == "plant"
    if not of_plant:
        _refuse_for_plants(settings != PlantOptions() or bool(over), real_time)
    plant = settings.plant(machine) if of_plant else None
    _refuse_for_code(c_only, clocked or source or fmi != "3" or unit != UnitOptions(), precision)
    if c_only:
        _write_code(law, name, out, precision, force, as_json)
        return
    from fmu.export import bounded, choose, clocked as ticking, export as write, file_names, named, versions
    from fmu.importer import info as facts

    out = out or Path("rotor.fmu")
    chosen, platforms, start = versions(fmi), choose(unit.targets), unit.start
    with files(*file_names(out, chosen).values(), force=force):
        made = _unit_of(bounded(plant) if plant and real_time else plant, law, Path(model), start, _offered(over or ()))
        announce = partial(typer.echo, err=True)
        made = ticking(made) if clocked else made
        paths = write(named(made, name), out, chosen, platforms, unit.cpu, announce, source)
    if as_json:
        print_json({f"fmi{v}": str(p) for v, p in paths.items()})
        return
    for path in paths.values():
        needs = f", needs {facts(path)['needs']}" if "needs" in facts(path) else ""
        typer.echo(f"{path}: written, {path.stat().st_size / 1000:.0f} kB{needs}; try 'rotorsim fmu check {path}'")


def _refuse_for_plants(changed: bool, real_time: bool) -> None:
    """Raise DataError for options of a plant that are given with a law or an identified model."""
    if changed:
        raise DataError(
            "--grid, --time-step, --set and --over: change the plant, not a law or an identified model; leave them out"
        )
    if real_time:
        raise DataError("--real-time: bounds the steps of a plant; a law and an identified model have none to bound")


def _refuse_for_code(c_only: bool, of_units: bool, precision: str) -> None:
    """Raise DataError for options of units where C without FMI is written, and for those of C where a unit is."""
    if c_only and of_units:
        raise DataError("--c-only: writes C without FMI; leave out options of units, as --clocked, --fmi and --source")
    if not c_only and precision != "float64":
        raise DataError(
            "--precision: is for --c-only; add it, or leave --precision out", argument="precision", value=precision
        )


def _offered(over: Sequence[str]) -> Over:
    """Values by paths, of all options together; a number without a unit stays text, which is judged by its field."""
    found: dict[str, tuple[str, ...]] = {}
    for field in map(read_field, over):
        found[field.path] = (*found.get(field.path, ()), *map(str, field.values))
    return found


def _write_code(
    law: Path | None, name: str | None, out: Path | None, precision: str, force: bool, as_json: bool
) -> None:
    """Write a law as C99 without FMI; raises DataError without one."""
    if law is None:
        raise DataError("--c-only: writes a control law; give one with --law")
    from fmu.export import code_names, export_code, law_unit, named
    from fmu.model import identifier

    made = named(law_unit(law), name)
    out = out or Path(identifier(made))
    with files(*code_names(out), force=force):
        paths = export_code(made, out, precision)
    if as_json:
        print_json({path.suffix[1:]: str(path) for path in paths})
        return
    for path in paths:
        typer.echo(f"{path}: written, {path.stat().st_size / 1000:.0f} kB")


def _unit_of(
    plant: Plant | None,
    law: Path | None,
    model: Path,
    start: tuple[float | None, float | None],
    over: Over,
) -> PlantUnit | LinearUnit | LawUnit:
    """Unit of a law, else of a plant, else of an identified model; whether it extrapolates is printed."""
    from fmu.export import law_unit, linear_unit, plant_unit

    if law is not None:
        return law_unit(law, *start)
    if plant is not None:
        return plant_unit(plant, *start, over)
    unit = linear_unit(model, *start)
    if unit.extrapolates:
        typer.echo(f"{model}: starts outside the speeds and pressures it was identified at; it extrapolates", err=True)
    return unit


@command(
    "fmu system",
    "rotorsim fmu system lpv.json dtu_gas_bearing --out loop.ssp",
    "rs.fmu.system('lpv.json', plant, 'loop.ssp')",
)
def system(
    law: Annotated[Path, typer.Argument(help="Control law that 'rotorsim design' wrote.")],
    machine: MachineName = "dtu_gas_bearing",
    fmi: Annotated[str, typer.Option(help="FMI version of the units: 2 or 3.")] = "2",
    out: Annotated[Path, typer.Option(help="File to write.")] = Path("loop.ssp"),
    *,
    ssp: Annotated[
        int, typer.Option(min=1, max=2, help="SSP version; 2: connectors of the system, values and mapping as files.")
    ] = 1,
    unit: UnitOptions,
    settings: PlantOptions,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write plant and control law, wired, as one .ssp file."""
    from fmu.export import choose, law_unit, plant_unit, versions
    from fmu.ssp import export_system

    if len(versions(fmi)) > 1:
        raise DataError(f"--fmi: '{fmi}': a system has units of one version; choose 2 or 3")
    chosen, (speed, pressure) = versions(fmi)[0], unit.start
    with files(out, force=force):
        held = law_unit(law, speed or 0.0, pressure)
        plant = plant_unit(settings.plant(machine), speed or 0.0, pressure)
        path = export_system(
            plant, held, out, chosen, choose(unit.targets), unit.cpu, partial(typer.echo, err=True), ssp
        )
    if as_json:
        print_json({"ssp": str(path)})
        return
    typer.echo(f"{path}: written, {path.stat().st_size / 1000:.0f} kB")


@command("fmu check", "rotorsim fmu check rotor.fmu --duration '10 s'", "rs.fmu.check('rotor.fmu')")
def check(
    file: UnitFile,
    duration: Annotated[str, typer.Option(help="Length of the comparison with the Python plant.")] = "1 s",
    as_json: AsJson = False,
) -> None:
    """Hold a unit against the standard and against the plant in Python, which runs the unit's own machine code with
    your rights; exit code 1 if a check fails; times are remarks."""
    from fmu.check import check as checks
    from fmu.importer import info as facts

    facts(file)
    found, length = [], quantity("duration", duration, "s")
    if not length > 0:
        raise DataError(f"--duration: {duration} is not a length of time; give e.g. '1 s'")
    typer.echo(f"{file}: its machine code will run as you; check units only of people you trust", err=True)
    for one in checks(file, length):
        found.append(one)
        if not as_json:
            typer.echo(f"{VERDICTS[one.passed]:<4}  {one.name:<46} {one.value}")
    if as_json:
        print_json([asdict(one) for one in found])
    if any(one.passed is False for one in found):
        raise typer.Exit(1)


@command("fmu info", "rotorsim fmu info rotor.fmu", "rs.fmu.info('rotor.fmu')")
def info(file: UnitFile, as_json: AsJson = False) -> None:
    """Show what a unit is."""
    from fmu.importer import info as facts

    found = facts(file)
    if as_json:
        print_json(found)
        return
    for name, value in found.items():
        typer.echo(f"{name:<14} {value}")

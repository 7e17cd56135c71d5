"""`rotorsim machine new | check | show | effects | calibrate`, `cite` and `warm`: machine files, sources, kernels."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from rotorsim.base.display import end_line, line
from rotorsim.base.errors import MachineFileError
from rotorsim.base.files import write_text
from rotorsim.base.units import TO_MPA, TO_UM
from rotorsim.commands import options
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files

if TYPE_CHECKING:
    from rotorsim.analysis import Calibration
    from rotorsim.machine import Machine

SCALES = {"rad/s": (1.0, "rad/s"), "s": (1e3, "ms"), "m/V": (TO_UM, "um/V"), "m": (TO_UM, "um"), "Pa": (TO_MPA, "MPa")}
"""Factor and name of the unit in which a quantity [SI] is printed."""


@group("machine")
class MachineFiles(CommandGroup):
    """Write, check, show and calibrate machine files."""


@command(
    "machine new",
    "rotorsim machine new my_rotor.toml --from aerostatic_spindle",
    "rs.machine_text('aerostatic_spindle')",
)
def new(
    path: Annotated[Path, typer.Argument(help="File to write.")],
    source: Annotated[
        str,
        typer.Option(
            "--from",
            help="Shipped machine, machine file or file of ROSS to start from.",
            autocompletion=options.machines,
        ),
    ] = "plain_rotor",
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it is there.")] = False,
) -> None:
    """Write a commented machine file to start from: a disc on two bearings, or that of a model which ROSS saved."""
    from fe_shaft.rotor import is_saved_rotor
    from rotorsim.machine import from_ross, machine_text

    with files(path, force=force, another="name"):
        write_text(path, from_ross(source).text if is_saved_rotor(Path(source)) else machine_text(source))
    typer.echo(f"{path}: written; edit it, then try 'rotorsim machine check {path}'")


@command(
    "machine table",
    "rotorsim machine table bearing.csv --into my.toml --bearing 1",
    "rs.machine.bearing_points('bearing.csv')",
)
def bearing_table(
    path: Annotated[Path, typer.Argument(help="CSV file: speed and coefficients, a unit in each heading.")],
    into: Annotated[Path, typer.Option(help="Machine file whose bearing gets the table.")],
    bearing: Annotated[int, typer.Option(help="Index of that bearing, from 0; of kind 'table' or 'linear'.")] = 0,
) -> None:
    """Put a table of stiffness and damping over the speed into a bearing of a machine file."""
    from rotorsim.machine import bearing_points, load_machine
    from rotorsim.machine.rotor_import import with_points

    points = bearing_points(path)
    machine = with_points(load_machine(into), bearing, points)
    with files(into, force=True, another="name"):
        machine.save(into)
    typer.echo(f"{into}: bearings.{bearing} has the {len(points)} speeds of {path}")


@command("machine check", "rotorsim machine check my_rotor.toml", "rs.load_machine('my_rotor.toml')")
def check(
    path: Annotated[
        str,
        typer.Argument(
            metavar="PATH", help="Machine file, or name of a shipped machine.", autocompletion=options.machines
        ),
    ],
) -> None:
    """Check a machine file: one line if it is good, else one sentence per problem and exit code 2."""
    from rotorsim.machine import load_machine, summary

    typer.echo(f"{path}: ok, {summary(load_machine(path))}")


@command(
    "machine show", "rotorsim machine show dtu_gas_bearing", "rs.machine.si_numbers(rs.load_machine('dtu_gas_bearing'))"
)
def show(
    machine: Annotated[
        str,
        typer.Argument(metavar="NAME|PATH", help="Shipped machine or machine file.", autocompletion=options.machines),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="SI numbers as JSON.")] = False,
) -> None:
    """Show what a machine is made of."""
    from rotorsim.machine import load_machine, si_numbers

    loaded = load_machine(machine)
    if as_json:
        options.print_json(si_numbers(loaded))
    else:
        _print_machine(loaded)


def _print_machine(machine: Machine) -> None:
    from rotorsim.machine import rows, summary

    options.Console().print(summary(machine))
    shown: list[tuple[str | Text, ...]] = []
    group = ""
    for path, value, doc in rows(machine):
        above, _, name = path.rpartition(".")
        if above != group:
            group = above
            shown += [(), (Text(group, style="bold"),)]
        shown.append(("  " * bool(group) + name, value, doc))
    options.print_rows(("field", "value", "meaning"), shown)


@command("machine effects", "rotorsim machine effects unbalance", "rs.machine.catalogue()")
def effects(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="An effect; all are listed without.", autocompletion=options.effects),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
) -> None:
    """List the physical effects a machine file may have, or show one: equation, source, parameters."""
    from rotorsim.machine import catalogue

    entries = catalogue() if name is None else [_entry(name)]
    if as_json:
        options.print_json(entries if name is None else entries[0])
    elif name is None:
        options.print_rows(("effect", "port", "what"), [(e["name"], e["port"], e["summary"]) for e in entries])
    else:
        _print_effect(entries[0])


def _entry(name: str) -> dict[str, Any]:
    """An effect of the catalogue by its name."""
    from rotorsim.effects import REGISTRY
    from rotorsim.machine.catalogue import describe
    from rotorsim.machine.tables import unknown_effect

    if name in REGISTRY:
        return describe(REGISTRY[name])
    raise MachineFileError(f"{name}: {unknown_effect(name)}")


def _print_effect(entry: dict[str, Any]) -> None:
    console = options.Console()
    console.print(Text.assemble((f"[effects.{entry['name']}]", "bold"), f"  {entry['title'] or entry['summary']}\n"))
    source = entry["source"] and f"Source: {entry['source']}"
    for text in filter(None, (entry["equation"], entry["about"], source)):
        console.print(text + "\n")
    if entry["references"]:
        console.print("\n".join(f"- {one}" for one in entry["references"]) + "\n")
    several = "several tables add up" if entry["several"] else "one table only"
    console.print(f"Acts {entry['acts']} (port {entry['port']}); {several}.\n")
    limits = (f"{p['low']} to {p['high']}" if p["low"] or p["high"] else "" for p in entry["parameters"])
    rows = [(p["name"], p["neutral"], ends, p["doc"]) for p, ends in zip(entry["parameters"], limits, strict=True)]
    options.print_rows(("parameter", "neutral", "limits", "meaning"), rows)


@command(
    "machine calibrate",
    "rotorsim machine calibrate dtu_gas_bearing --targets dtu_orifice --out my_rig.toml",
    "rs.analysis.calibrate(rs.load_machine('dtu_gas_bearing'), rs.analysis.read_targets('dtu_orifice'))",
)
def calibrate_command(
    machine: options.GivenMachine,
    targets: Annotated[
        str,
        typer.Option(help="Targets file, or a shipped one: dtu_orifice, dtu_pins, ...", autocompletion=options.targets),
    ],
    grid: Annotated[str | None, typer.Option(help="Film grid n_theta x n_z, e.g. 32x16.")] = None,
    passes: Annotated[int, typer.Option(help="Most steps of the fit.", min=1)] = 20,
    out: Annotated[Path | None, typer.Option(help="Machine file to write; default MACHINE-calibrated.toml.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it is there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Fit named parameters within bounds to measured or published figures and write a new machine file.

    Every target is shown before and after; rows with the role 'predict' take no part in the fit. Correlations and
    directions that the targets do not determine are named: numbers along them are not to be believed one by one.
    """
    loaded = options.plant_of(machine).machine
    from rotorsim.analysis import calibrate, calibration_numbers, read_targets, save_calibrated

    asked = read_targets(targets)
    path = out or Path(f"{Path(machine).stem}-calibrated.toml")
    with files(path, force=force):
        coarse = loaded if grid is None else options.GridOptions(grid).plant(machine).machine
        shown = None if as_json else lambda n, cost: line(f"{n} evaluations{f', cost {cost:.4g}' * (n > 0)} ")
        found = calibrate(coarse, asked, passes, shown)
        if not as_json:
            end_line()
        save_calibrated(found, asked.name, path, loaded)
    if as_json:
        options.print_json(calibration_numbers(found) | {"file": str(path)})
    else:
        _print_calibration(found)
        typer.echo(f"{path}: written")
    if found.ended == "passes":
        print(f"the {passes} passes ended before the fit did: values and their +- are not final; give more --passes",
              file=sys.stderr)  # fmt: skip
    if found.ended == "interrupted":
        print("interrupted: the best values so far are written", file=sys.stderr)
        raise typer.Exit(130)


def _print_calibration(found: Calibration) -> None:
    rows = [
        (t.name, t.role + ("ted" if t.role == "fit" else "ed"), _range(t.low, t.high, t.quantity),
         _range(*row.before, t.quantity), row.verdicts[0], _range(*row.after, t.quantity), row.verdicts[1])
        for row in found.rows for t in (row.target,)
    ]  # fmt: skip
    options.print_rows(("target", "role", "asked", "before", "", "after", ""), rows)
    values = [
        (p.name, f"{p.start:.5g} {p.unit}", f"{v:.5g} {p.unit}", f"{s:.2g}", "at its bound" if b else "")
        for p, v, s, b in zip(found.parameters, found.values, found.sd, found.at_bound, strict=True)
    ]
    options.print_rows(("parameter", "start", "value", "+-", ""), values)
    console = options.Console()
    console.print("correlations above 0.8: " + (", ".join(strong(found)) or "none"))
    for text in found.unidentifiable:
        console.print(f"not identifiable from these targets: {text}")
    for one in found.reach:
        asked, here, alone = (_range(v, v, one.quantity) for v in (one.asked, one.reached, one.alone))
        text = f"not reached: {one.name}, asked {asked}, here {here}; weighing most it comes to {alone}"
        if one.other:
            numbers = (one.other_asked, one.other_reached, one.other_then)
            asked, here, then = (_range(v, v, one.other_quantity) for v in numbers if v is not None)
            text += f", and then {one.other}, asked {asked}, goes from {here} to {then}"
        console.print(text)
    for role in ("fit", "predict"):
        before, after, total = found.met(role)
        console.print(f"{role}: {before} of {total} met before, {after} after")


def strong(found: Calibration) -> list[str]:
    """Strongly correlated pairs of parameters."""
    names = [p.name for p in found.parameters]
    return [
        f"{names[i]} and {names[j]} {found.correlation[i, j]:+.2f}"
        for i in range(len(names))
        for j in range(i)
        if abs(found.correlation[i, j]) > 0.8
    ]


def _range(low: float, high: float, quantity: str) -> str:
    from rotorsim.analysis.targets import UNITS

    scale, unit = SCALES.get(UNITS[quantity], (1.0, UNITS[quantity].replace("1", "")))
    low, high = (0.0 if abs(v * scale) < 1e-9 else v * scale for v in (low, high))
    text = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
    return f"{text} {unit}".strip()


@command("cite", "rotorsim cite dtu_gas_bearing --bibtex", "rs.analysis.cite('dtu_gas_bearing')")
def cite(
    what: Annotated[
        str,
        typer.Argument(
            metavar="MACHINE|RUN",
            help="Machine, or a record .nc, model or law .json or .mat, or their folder.",
            autocompletion=options.machines,
        ),
    ],
    as_bibtex: Annotated[bool, typer.Option("--bibtex", help="As BibTeX entries.")] = False,
    as_json: options.AsJson = False,
) -> None:
    """Print the sources that a machine or a result stands on."""
    from rotorsim.analysis import cite as cited
    from rotorsim.base.references import bibtex, references, sorted_keys

    parts = cited(what)
    keys = sorted_keys(key for part in parts.values() for key in part)
    if as_json:
        options.print_json({"parts": parts, "references": {k: references().get(k, k) for k in keys}})
    elif as_bibtex:
        typer.echo("\n\n".join(bibtex().get(key, f"% {key}") for key in keys))
    else:
        for part, own in parts.items():
            typer.echo(f"{part}: {', '.join(own)}")
        typer.echo("\n" + "\n".join(f"[{key}] {references().get(key, key)}" for key in keys))


@command("warm", "rotorsim warm dtu_gas_bearing --grid 64x16", "rs.compile_kernels(plant)")
def warm(
    machines: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MACHINE]...",
            help="Shipped machines or files; default all shipped.",
            autocompletion=options.machines,
        ),
    ] = None,
    *,
    settings: options.PlantOptions,
    as_json: options.AsJson = False,
) -> None:
    """Compile machines now, so that their first run starts at once."""
    from rotorsim.machine import shipped_machines

    plants = {name: settings.plant(name) for name in machines or shipped_machines()}
    from rotorsim.base.processes import cores, spread
    from rotorsim.plant.plant import compile_text

    took, left = {}, set[str]()
    for name, plant in plants.items():
        note = plant.assembly.compile_note("settle", "run")
        typer.echo(note or f"{name}: compiled already", err=True)
        took[name] = 0.0
        left |= {name} if note else set()
    for kernel in ("refresh", "run", ""):  # no two processes compile the same film or rotor
        first: dict[str, str] = {}
        for name in sorted(left):
            module = plants[name].assembly.module
            first.setdefault(getattr(module, kernel).__module__ if kernel else name, name)
        names = sorted(first.values())
        left -= set(names)
        texts = [(plants[name].machine.text,) for name in names]
        for number, seconds in spread(compile_text, texts, min(cores(), len(names))):
            took[names[number]] = round(seconds, 1)
            typer.echo(f"{names[number]}: compiled in {seconds:.0f} s", err=True)
    if as_json:
        options.print_json({"seconds": took})

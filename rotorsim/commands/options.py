"""What the commands that run a machine share: its options, values with units, folders."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rotorsim.machine import Machine
    from rotorsim.plant import Plant

MachineName = Annotated[str, typer.Argument(metavar="[MACHINE]", help="Shipped machine or machine file.")]
GridSize = Annotated[str | None, typer.Option("--grid", help="Film grid n_theta x n_z, e.g. 64x16.")]
TimeStep = Annotated[str | None, typer.Option("--time-step", help="Step of the solver, e.g. '0.2 ms'.")]
Changes = Annotated[list[str] | None, typer.Option("--set", help="Change the machine: PATH=VALUE; may be repeated.")]
Force = Annotated[bool, typer.Option("--force", help="Replace a run that is in the folder.")]
WithReport = Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]

ANGULAR = ("rpm", "rad", "deg", "turn", "rev")
"""What tells a speed from a frequency: by way of radians 60 rpm would be 6.28 Hz."""


def make_plant(machine: str | Machine, grid: str | None, time_step: str | None, changes: list[str]) -> Plant:
    """The plant of a machine (or of a machine's name or path) with the changes of the command line."""
    from rotorsim.errors import MachineFileError
    from rotorsim.machine import load_machine
    from rotorsim.plant import Plant

    loaded = load_machine(machine) if isinstance(machine, str) else machine
    if grid is not None:
        sizes = grid.lower().split("x")
        if len(sizes) != 2 or not all(size.isdecimal() for size in sizes):
            raise MachineFileError(f"--grid: '{grid}' is not n_theta x n_z; write e.g. --grid 64x16")
        changes = [f"grid.n_theta={sizes[0]}", f"grid.n_z={sizes[1]}", *changes]
    if time_step is not None:
        changes = [f"solver.time_step={time_step}", *changes]
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise MachineFileError(
                f"--set: '{change}' is not PATH=VALUE; write e.g. --set effects.unbalance.me='12 g*mm'"
            )
        loaded = loaded.replace(path.strip(), _value(value.strip()))
    return Plant(loaded)


def _value(text: str) -> Any:
    """A value of --set: a number where it is one (counts and pure numbers), else text."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def quantity(option: str, text: str, unit: str) -> float:
    """SI value of an option's text; raises MachineFileError. A frequency [Hz] may also be written as a speed."""
    from math import pi

    from rotorsim.errors import MachineFileError
    from rotorsim.machine.units import parse

    try:
        if unit == "Hz" and any(word in text for word in ANGULAR):
            return float(f"{parse(text, 'rad/s') / (2 * pi):.12g}")
        return float(parse(text, unit))
    except ValueError as error:
        raise MachineFileError(f"--{option}: {error}") from error


def a_folder(path: Path | None) -> Path | None:
    """What --out names, if it can be a folder; a callback of that option. Raises DataError for a file."""
    from rotorsim.errors import DataError

    if path is not None and path.exists() and not path.is_dir():
        raise DataError(f"--out: {path} is a file; name a folder")
    return path


def results_folder(out: Path | None, default: str, result: str, force: bool) -> Path:
    """Folder of new results, `out` or a fresh one; raises DataError if `result` is in it and `force` is not given."""
    if out is None:
        return Path(default) if force else fresh_folder(Path(default))
    return free_record(out / result, force).parent


def fresh_folder(base: Path) -> Path:
    """`base`, or the first of base-2, base-3 ... that does not exist yet."""
    folder, n = base, 1
    while folder.exists():
        n += 1
        folder = base.with_name(f"{base.name}-{n}")
    return folder


def free_record(path: Path, force: bool) -> Path:
    """The path of a record to write; raises DataError if one is there and `force` is not given."""
    from rotorsim.errors import DataError

    if path.exists() and not force:
        raise DataError(f"{path}: is there already; choose another --out or add --force")
    return path


def say_if_compiling(plant: Plant) -> None:
    """Tell on a terminal that the first run of a kind of machine takes longer."""
    from rotorsim.plant.compose import is_compiled

    if sys.stderr.isatty() and not is_compiled(plant.assembly.module):
        print("compiling the kernels for this kind of machine: half a minute, once", file=sys.stderr)


@contextmanager
def told_as_kept(record: Path) -> Iterator[None]:
    """Ctrl-C while results are made from a record: say that the record is there."""
    try:
        yield
    except KeyboardInterrupt:
        print(f"interrupted: the record is kept, without its results: {record}", file=sys.stderr)
        raise typer.Exit(130) from None


def leave_if_empty(ended: str, samples: int) -> None:
    """Exit with one sentence if nothing was simulated."""
    from rotorsim.experiments.recording import FEWEST

    if samples < FEWEST:
        print(f"{ended}; too little was simulated to keep", file=sys.stderr)
        raise typer.Exit(130 if ended == "interrupted" else 2)


def leave_if_cut(ended: str, samples: int, asked: int, record: Path) -> None:
    """Exit with one sentence if the run did not reach its end."""
    from rotorsim.machine.numerics import SAMPLE

    if ended == "interrupted":
        print(f"interrupted: {samples * SAMPLE:.1f} s of {asked * SAMPLE:.1f} s are in {record}", file=sys.stderr)
        raise typer.Exit(130)
    if ended != "complete":
        print(f"{ended}; what was simulated is in {record}", file=sys.stderr)
        raise typer.Exit(2)


def resumable(command: Callable[..., None]) -> Callable[..., None]:
    """A command that says on Ctrl-C that what it has computed is not lost."""

    @wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        try:
            command(*arguments, **options)
        except KeyboardInterrupt:
            print("\ninterrupted: what was computed is kept, and the same command goes on", file=sys.stderr)
            raise typer.Exit(130) from None

    return run


def print_table(rows: list[tuple[str, str]], files: dict[str, str]) -> None:
    """Results as a table, then the files' paths."""
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    for label, value in rows:
        table.add_row(label, value)
    console = Console()
    console.print(table)
    for kind, path in files.items():
        console.print(f"{kind}: {path}", soft_wrap=True, highlight=False)

"""Options that several commands share: machine, grid, folder, page; values with units, messages, printed tables.

The shell completes machines, effects, designs, shipped targets and plans, with files where they may be, after
`rotorsim --install-completion`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, fields
from functools import wraps
from glob import escape
from importlib.resources import files
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich import console
from rich.table import Column, Table
from rich.text import Text

from rotorsim.base.display import visible
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.files import WriteError
from rotorsim.base.interrupt import CODE, KEPT, keeping
from rotorsim.base.units import Suggest, parse
from rotorsim.commands.results import refuse_replacing, results
from rotorsim.report.browser import open_page
from rotorsim.report.units import check_units, use_units

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.experiments import Outcome
    from rotorsim.machine import Machine
    from rotorsim.plant import Plant
    from rotorsim.plant.assemble import Assembly


def laws() -> list[str]:
    """Names of the designs that write a law, from the simplest on."""
    from rotorsim.control import designs as found

    names = sorted(name for name in dir(found) if name not in found.IN_PYTHON)
    return sorted(names, key=lambda name: [*found.IN_ORDER, name].index(name))


def _matching(names: Iterable[str], incomplete: str) -> list[str]:
    return sorted(name for name in names if name.startswith(incomplete))


def _shipped(package: str, folder: str, ending: str = ".toml") -> list[str]:
    """Names of the files of a folder of a package, unimported where it is not yet."""
    place = files("rotorsim").joinpath(*package.split("/"), folder)
    return [one.name.removesuffix(ending) for one in place.iterdir() if one.name.endswith(ending)]


def _near(incomplete: str, *endings: str) -> list[str]:
    """Files with these endings, and folders, that begin so."""
    given = Path(incomplete)
    folder = given if incomplete.endswith("/") else given.parent
    if not folder.is_dir():
        return []
    found = (one for one in folder.iterdir() if one.suffix in endings or (one.is_dir() and one.name[0] != "."))
    return _matching((f"{one}/" if one.is_dir() else str(one) for one in found), incomplete)


def machines(incomplete: str) -> list[str]:
    """Shipped machines and machine files."""
    return _matching(_shipped("machine", "rigs"), incomplete) + _near(incomplete, ".toml")


def plans(incomplete: str) -> list[str]:
    """Shipped plans of campaigns and plan files."""
    return _matching(_shipped("campaign", "plans"), incomplete) + _near(incomplete, ".toml")


def targets(incomplete: str) -> list[str]:
    """Shipped targets of a calibration and files of them."""
    return _matching(_shipped("analysis", "shipped"), incomplete) + _near(incomplete, ".toml")


def effects(incomplete: str) -> list[str]:
    """Names of effects, of installed packages too."""
    from rotorsim.effects import REGISTRY

    return _matching(REGISTRY, incomplete)


def parameters(incomplete: str) -> list[str]:
    """Names of effects, and their parameters after a dot."""
    from rotorsim.effects import REGISTRY

    name, dot, _ = incomplete.partition(".")
    if not dot or name not in REGISTRY:
        return effects(incomplete)
    return _matching((f"{name}.{entry.name}" for entry in fields(REGISTRY[name])), incomplete)


def designs(incomplete: str) -> list[str]:
    """Names of controller designs."""
    return _matching(laws(), incomplete)


FILES = (".html", ".htm", ".pdf", ".csv", ".json", ".nc", ".xlsx", ".toml")
"""Endings of files, which a folder's name does not have."""


def a_folder(path: Path | None) -> Path | None:
    """Callback of --out: folder path; raises DataError for a file, and for a new folder with a file's ending."""
    if path is None or path.is_dir():
        return path
    if path.exists():
        raise DataError(f"--out: {path} is a file; name a folder", argument="out", value=path)
    if path.suffix in FILES:
        raise DataError(
            f"--out: several files are written, and '{path.name}' is the name of one; name a folder, e.g. {path.stem}",
            argument="out",
            value=path,
        )
    return path


MachineName = Annotated[
    str, typer.Argument(metavar="[MACHINE]", help="Shipped machine or machine file.", autocompletion=machines)
]
GivenMachine = Annotated[
    str, typer.Argument(metavar="MACHINE", help="Shipped machine or machine file.", autocompletion=machines)
]
Force = Annotated[bool, typer.Option("--force", help="Replace results that are in the folder.")]
WithReport = Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML report.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]
StudyFolder = Annotated[
    Path,
    typer.Option("--out", callback=a_folder, help="Folder of records, results and report; a study there is resumed."),
]
Jobs = Annotated[int, typer.Option("--jobs", min=1, help="Processes.")]

ANGULAR = ("rpm", "rad", "deg", "turn", "rev")
"""Units of speeds, which are no frequencies: converted through radians, 60 rpm would be 6.28 Hz."""


@dataclass(frozen=True)
class GridOptions:
    """Options that change a machine: its grid and any of its values."""

    grid: Annotated[str | None, typer.Option(help="Film grid n_theta x n_z, e.g. 64x16.")] = None
    changes: Annotated[
        list[str] | None, typer.Option("--set", help="Change the machine: PATH=VALUE; may be repeated.")
    ] = None

    def plant(self, machine: str | Machine) -> Plant:
        """Plant of a machine, machine name or path, with the changes given on the command line."""
        return plant_of(machine, *self.settings(), *(self.changes or ()))

    def settings(self) -> Iterator[str]:
        """Changes PATH=VALUE of the options that have a name of their own; raises MachineFileError."""
        if self.grid is not None:
            sizes = self.grid.lower().split("x")
            if len(sizes) != 2 or not all(size.isdecimal() for size in sizes):
                raise MachineFileError(f"--grid: '{self.grid}' is not n_theta x n_z; write e.g. --grid 64x16")
            yield from (f"grid.n_theta={sizes[0]}", f"grid.n_z={sizes[1]}")


@dataclass(frozen=True)
class PlantOptions(GridOptions):
    """Options that change a machine for a simulation: those of the grid and the solver's step."""

    time_step: Annotated[str | None, typer.Option(help="Step of the solver, e.g. '0.2 ms'.")] = None

    def settings(self) -> Iterator[str]:
        """Changes of the solver's step and of the grid."""
        if self.time_step is not None:
            yield f"solver.time_step={self.time_step}"
        yield from super().settings()


@dataclass(frozen=True)
class PageOptions:
    """Options about the page that a command writes: units, figures as files, display in the browser."""

    units: Annotated[str, typer.Option(help="Units of the page: metric or imperial.")] = "metric"
    figures: Annotated[str | None, typer.Option(help="Every figure of the page as a file too: png, svg or csv.")] = None
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the default browser.")] = False

    def check(self, report: bool = True) -> None:
        """Before anything is computed: raise DataError for figures that cannot be made, or where no page is written."""
        for option, given in (("figures", self.figures is not None), ("open", self.open_page)):
            if given and not report:
                raise DataError(f"--{option}: no page is written; leave --no-report out, or add --report")
        check_units(self.units)
        use_units("metric")
        if self.figures is not None:
            from rotorsim.report.figure_files import check_kind

            check_kind(self.figures)

    def begin(self, page: Path, force: bool | None = False) -> None:
        """In the locked folder: refuse figures that would replace files; with `force` remove those of the older page.

        `force` is None for a command without that option. From here on pages are made in the units that are asked for.
        Raises DataError.
        """
        use_units(self.units)
        if self.figures is None:
            return
        from rotorsim.report.figure_files import figure_paths

        refuse_replacing(sorted(page.parent.glob(f"{escape(page.stem)}_*.{self.figures}")), force)
        if page.is_file():
            with suppress(DataError):  # a page without figures
                for path in figure_paths(page, self.figures):
                    path.unlink(missing_ok=True)

    def finish(self, page: str | Path) -> dict[str, str]:
        """Write the figures of a complete page and open it; pages after it are metric again.

        Returns the pattern of the paths of figures for the summary.

        What fails here is a sentence on stderr: the page is complete.
        """
        files: dict[str, str] = {}
        page = Path(page)
        use_units("metric")
        if self.figures is not None:
            from rotorsim.report.figure_files import save_figures

            try:
                save_figures(page, self.figures)
                files["figures"] = str(page.with_name(f"{page.stem}_*.{self.figures}"))
            except DataError as error:
                print(f"--figures: {error}", file=sys.stderr)
        if self.open_page and not open_page(page):
            print(f"--open: there is no browser with a display here; the page is {page.resolve()}", file=sys.stderr)
        return files


@dataclass(frozen=True)
class ResultOptions:
    """Options about the results of a command: their folder, the page about them, and what is printed."""

    out: Annotated[
        Path | None, typer.Option(callback=a_folder, help="Folder; default a new folder of the command's name.")
    ] = None
    force: Force = False
    report: WithReport = True
    page: PageOptions = PageOptions()
    as_json: AsJson = False

    def check(self) -> None:
        """Before anything is computed: raise DataError for a page that cannot be made as it is asked for."""
        self.page.check(self.report)

    @contextmanager
    def folder(self, name: str, *files: str, page: str = "report.html") -> Iterator[ResultFolder]:
        """Folder `name` or that of --out, locked for these files and the page until the block ends; see `results`."""
        with results(self.out, name, (*files, *([page] if self.report else ())), self.force) as folder:
            self.page.begin(folder / page, self.force)
            yield ResultFolder(folder, self, page)

    def show(self, numbers: Mapping[str, Any], rows: Sequence[tuple[str, str]], files: Mapping[str, str]) -> None:
        """Print the results: numbers and files as JSON, or rows as a table and then the files."""
        if self.as_json:
            print_json({**numbers, "files": files})
        else:
            print_table(rows, files)


@dataclass(frozen=True)
class ResultFolder:
    """Folder in which a command writes, with the paths of what is written by kind."""

    path: Path
    options: ResultOptions
    page: str
    files: dict[str, str] = field(default_factory=dict)

    def add(self, kind: str, name: str) -> Path:
        """Path of a file, which is listed under its kind."""
        self.files[kind] = str(self.path / name)
        return self.path / name

    def write_page(self, write: Callable[[Path], object]) -> None:
        """Have the page written, then its figures as files, and open it, as far as that is asked for."""
        path = self.path / self.page
        write(path)
        self.files.update({"report": str(path)} | self.options.page.finish(path))

    def write_page_of(self, result: Any) -> None:
        """Have the page of a result written, its figures and its display too."""
        from rotorsim.report.page import write

        self.write_page(lambda path: write(result, path))


def plant_of(machine: str | Machine, *changes: str) -> Plant:
    """Plant of a machine, machine name or path, with changes PATH=VALUE; raises MachineFileError."""
    from rotorsim.machine import load_machine
    from rotorsim.machine.plausibility import ask_machine

    loaded = load_machine(machine) if isinstance(machine, str) else machine
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise MachineFileError(
                f"--set: '{change}' is not PATH=VALUE; write e.g. --set effects.unbalance.me='12 g*mm'"
            )
        loaded = loaded.replace(path.strip(), _value(value.strip()))
    ask_machine(loaded)
    from rotorsim.plant import Plant  # only now: it loads the compiler of the kernels

    return Plant(loaded)


def _value(text: str) -> Any:
    """A value of --set: a number where it is one (counts and pure numbers), else text."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def quantity(option: str, text: str, unit: str, suggest: Suggest | None = None) -> float:
    """SI value of an option's text, with a question if it is unusual; raises MachineFileError.

    A frequency [Hz] may also be written as a speed. `suggest` makes the examples of messages.
    """
    from rotorsim.machine.plausibility import ask

    try:
        if unit == "Hz" and any(word in text for word in ANGULAR):
            return float(f"{parse(text, 'rad/s') / (2 * pi):.12g}")
        value = float(parse(text, unit, suggest))
    except ValueError as error:
        raise MachineFileError(f"--{option}: {error}") from error
    ask(option, value, unit, text, "--")
    return value


SUPPLY = "0.5 MPa"
"""Default of a supply pressure."""
FED = "none without feed"
"""Default of a supply pressure of a machine without feed, as the help states it."""
SUPPLIED = f"{SUPPLY}, {FED}"
"""That default as the help states it."""
Pressure = Annotated[str | None, typer.Option(help="Gauge supply pressure.", show_default=SUPPLIED)]
"""Option that is None where it is not given: a pressure given for a machine without feed is noted."""
TOP = (
    "from rest to drive.highest_speed, else to the last speed of the bearing tables, else to three times the rotor's "
    "first natural frequency"
)
"""Default of the speeds of an analysis, as the help states it."""
ABOVE = "above the speeds asked"
"""Label of the row about an onset of whirl beyond the speeds of an analysis."""


def note_unfed(machine: Machine, given: bool, name: str = "") -> None:
    """Print on stderr that no supply pressure acts on a machine without feed, where one was given."""
    if given and not machine.supplied:
        film = "gas is supplied to no film of" if machine.films else "there is no gas film in"
        print(f"--pressure: {film} {name or machine.name}, so no pressure changes it", file=sys.stderr)


def note_compiling(assembly: Assembly, *kernels: str) -> None:
    """Print one line on stderr if a kernel of a machine ('settle', 'run') is to be compiled first."""
    if note := assembly.compile_note(*kernels):
        print(note, file=sys.stderr, flush=True)


@contextmanager
def reporting_kept_samples(record: Path) -> Iterator[None]:
    """On Ctrl-C or a full disk during post-processing, print that the record is kept."""
    try:
        yield
    except WriteError as error:
        print(f"{error}; the record is kept: {record}", file=sys.stderr)
        raise typer.Exit(2) from None
    except KeyboardInterrupt:
        print(f"interrupted: the record is kept, without its results: {record}", file=sys.stderr)
        raise typer.Exit(130) from None


def leave_if_empty(outcome: Outcome, record: Path) -> None:
    """Exit with one sentence if nothing was simulated or a full disk ended the record."""
    from rotorsim.experiments.recording import FEWEST

    ended, samples = outcome.ended, outcome.samples
    if outcome.error is not None:
        leave_if_cut(outcome, record)
    if samples < FEWEST:
        early = f"interrupted before the {'second' if samples else 'first'} sample; the same command starts again"
        print(early if ended == "interrupted" else f"{ended}; too little was simulated to keep", file=sys.stderr)
        raise typer.Exit(130 if ended == "interrupted" else 2)


def leave_if_cut(outcome: Outcome, record: Path) -> None:
    """Exit with one sentence if the run ended early."""
    length = f"{outcome.samples * outcome.Ts:.1f} s of {outcome.asked * outcome.Ts:.1f} s"
    if outcome.ended == "interrupted":
        print(f"interrupted: {length} are in {record}", file=sys.stderr)
        raise typer.Exit(130)
    if (error := outcome.error) is not None:
        print(f"{record}: {error.reason}; {length} are in it; {error.way_out}", file=sys.stderr)
        raise typer.Exit(2)
    if outcome.ended != "complete":
        print(f"{outcome.ended}; what was simulated is in {record}", file=sys.stderr)
        raise typer.Exit(2)


def resumable(command: Callable[..., None]) -> Callable[..., None]:
    """Decorator: on Ctrl-C or SIGTERM the command prints that its computed results are kept."""

    @wraps(command)
    def run(*arguments: Any, **options: Any) -> None:
        with keeping():
            try:
                command(*arguments, **options)
            except KeyboardInterrupt:
                print(f"\n{KEPT}", file=sys.stderr)
                raise typer.Exit(CODE) from None

    return run


def warn_of(found: xr.Dataset) -> list[str]:
    """Sentences about where a result does not hold, after they are printed on stderr."""
    sentences = str(found.attrs.get("warnings", "")).splitlines()
    for sentence in sentences:
        print(f"warning: {sentence}", file=sys.stderr)
    return sentences


UNBROKEN = 1000
"""Width [characters] of a table that goes to a file or another program."""


class Console(console.Console):
    """Rich's console without markup and highlighting of numbers, for text that may hold anything.

    Text is shown as it is, neither obeyed by the terminal nor taken for markup: brackets are brackets.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"highlight": False, "markup": False} | options)

    def render_str(self, text: str, **options: Any) -> Text:
        """A text as it is shown."""
        return super().render_str(visible(text), **options)


def print_table(rows: Sequence[tuple[str, str]], files: Mapping[str, str]) -> None:
    """Print the results as a table, then the paths of the files."""
    table = Table(show_header=False)
    for label, value in rows:
        table.add_row(label, value)
    console = Console(highlight=True)
    console.print(table)
    for kind, path in files.items():
        console.print(f"{kind}: {path}", soft_wrap=True, highlight=False)


def print_rows(heads: Sequence[str | Column], rows: Iterable[Sequence[str | Text]]) -> None:
    """Print rows of plain texts below heads, without a frame; each on one line where no terminal has a width."""
    table = Table(*heads, box=None, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    console = Console()
    if not console.is_terminal:
        console.width = UNBROKEN
    console.print(table)


def print_files(files: Mapping[str, str]) -> None:
    """Print the paths of the files by kind."""
    for kind, path in files.items():
        typer.echo(f"{kind}: {path}")


def print_json(numbers: Any) -> None:
    """Print results as JSON: numbers of numpy are numbers, NaN and infinity are null."""
    plain = json.loads(json.dumps(numbers, default=float), parse_constant=lambda _: None)
    typer.echo(json.dumps(plain, indent=2, allow_nan=False))

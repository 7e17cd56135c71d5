"""`rotorsim report design | diagnosis | record | tables`: a design review; pages and tables of results and records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.commands import options
from rotorsim.commands.options import AsJson, PageOptions, print_files, print_json, quantity
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant import Plant


@group("report", "Example: rotorsim report record run.csv --mapping rig.toml")
class Report(CommandGroup):
    """Review a design, or write the page of a result or record."""


@command(
    "report design",
    "rotorsim report design aerostatic_spindle --speed '20000 rpm:30000 rpm' --pressure '0.5 MPa'",
    "rs.analysis.design_review(plant, (2094.4, 3141.6), 0.5e6)",
)
def design(
    machine: options.GivenMachine,
    speed: Annotated[
        str | None, typer.Option(help="Operating speed, or LOWEST:HIGHEST; default drive.highest_speed.")
    ] = None,
    pressure: options.Pressure = None,
    law: Annotated[Path | None, typer.Option(help="Control law, for the sensitivity of its loop.")] = None,
    author: Annotated[str, typer.Option(help="Name on the page.")] = "not stated",
    *,
    settings: options.GridOptions,
    result: options.ResultOptions,
) -> None:
    """Review a design by API 617/684 and ISO rules on one page.

    Critical speeds, margins, mode shapes, unbalance response, clearances, stability, balance, films.
    """
    result.check()
    at = options.quantity("pressure", pressure or options.SUPPLY, "Pa")
    speeds = None if speed is None else _operating_speeds(speed)
    plant = settings.plant(machine)
    options.note_unfed(plant.machine, bool(pressure and at))
    from rotorsim.analysis.design_review import design_review
    from rotorsim.base.display import progress_line
    from rotorsim.base.files import write_csv
    from rotorsim.report.design import answered, asked, counts, design_page, numbers, tables
    from rotorsim.report.page import write_page

    names = (
        "requirements",
        "criticals",
        "cases",
        "unbalances",
        "clearances",
        "grades",
        "zones",
        "films",
        "thrust",
        "rules",
    )
    with result.folder("design", *(f"{name}.csv" for name in names)) as folder:
        options.note_compiling(plant.assembly, "settle")
        sensitivity = None if law is None else _sensitivity(plant, law, speeds, at)
        with progress_line("design review") as progress:
            found = design_review(plant, speeds, at, sensitivity, progress)
            for name, table in tables(found).items():
                write_csv(folder.add(name, f"{name}.csv"), table.heads, table.rows)
            if result.report:
                folder.write_page(lambda path: write_page(lambda: design_page(found, author), path))
    rows = [(f"{check.name}: {asked(check)}", f"{check.verdict} ({answered(check)})") for check in found.checks]
    rows = [(name.replace("µ", "u"), text.replace("µ", "u")) for name, text in rows]
    rows += [(verdict, str(number)) for verdict, number in counts(found).items()]
    result.show(numbers(found), rows, folder.files)


def _operating_speeds(text: str) -> tuple[float, float]:
    """Lowest and highest operating speed [rad/s] of one speed or of LOWEST:HIGHEST."""
    low, _, high = text.partition(":")
    first = quantity("speed", low, "rad/s")
    last = quantity("speed", high, "rad/s") if high else first
    if not 0 < first <= last:
        raise DataError(f"--speed: '{text}' does not ascend from above 0; write e.g. '20000 rpm:30000 rpm'",
                        argument="speed", value=text)  # fmt: skip
    return first, last


def _sensitivity(plant: Plant, path: Path, speeds: tuple[float, float] | None, pressure: float) -> float:
    """Largest sensitivity of the loop of a law at the highest operating speed, infinite where the loop is unstable."""
    from rotorsim.analysis.campbell import top_speed
    from rotorsim.base.rounding import DECAYS
    from rotorsim.control.law import load_law
    from rotorsim.verify.closed_loop import full_order

    if plant.machine.injection is None:
        raise DataError(f"--law: {plant.machine.name} has no actuators; leave it out", argument="law", value=path)
    at = speeds[1] if speeds else top_speed(plant)
    loop = full_order(plant, load_law(path), [(at, pressure)])[0]
    return loop.peak if loop.radius < DECAYS else float("inf")


@command(
    "report diagnosis",
    "rotorsim report diagnosis diagnosis --out again.html --units imperial",
    "rs.discrepancy.load_diagnosis('diagnosis').report('again.html')",
)
def diagnosis(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder that 'rotorsim diagnose' wrote.")],
    out: Annotated[
        Path | None, typer.Option(help="Page to write; by default that in the folder, in place of the older.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the page that --out names.")] = False,
    *,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Write the page of a diagnosis again.

    Nothing is computed: the numbers are those in the folder.
    """
    from rotorsim.discrepancy import load_diagnosis
    from rotorsim.discrepancy.files import RESULTS

    page.check()
    found = load_diagnosis(folder)
    target = out or folder / RESULTS["report"]
    replace = force or out is None
    with files(target, force=replace):
        page.begin(target, replace)
        written = {"report": str(found.report(target))} | page.finish(target)
    if as_json:
        print_json({"verdict": found.sentence, "files": written})
        return
    typer.echo(found.sentence)
    print_files(written)


@command(
    "report record",
    "rotorsim report record run.csv --mapping rig.toml --slow-roll '400 rpm' --out run.html",
    "rs.write_report(rs.read('run.csv', 'rig.toml'), 'run.html')",
)
def record(
    file: Annotated[Path, typer.Argument(metavar="RECORD", help="Record .nc, or measured data of any format.")],
    mapping: Annotated[
        Path | None, typer.Option("--mapping", help="TOML file that states which column is which channel.")
    ] = None,
    slow_roll: Annotated[
        str, typer.Option(help="Motion to subtract: a record of a slow roll, or that of this record below '400 rpm'.")
    ] = "",
    out: Annotated[Path | None, typer.Option(help="Page to write; by default RECORD.html in this folder.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the page if it is there.")] = False,
    *,
    page: PageOptions,
    as_json: AsJson = False,
) -> None:
    """Write the page of a measured or simulated record.

    Orbits, polar and Bode diagrams, spectra, waterfall, cascade, centreline: each is shown, or left out with the
    reason.
    """
    page.check()
    below = quantity("slow-roll", slow_roll, "rad/s") if slow_roll and not _is_file(slow_roll) else None
    from rotorsim.report.record import made_sections, write_report
    from rotorsim.report.run import analyse

    held = _compensated(file, mapping, below if below is not None else Path(slow_roll) if slow_roll else None)
    target = out or Path(f"{file.stem}.html")
    with files(target, force=force):
        page.begin(target, force)
        write_report(held, target, page.units)
        written = {"report": str(target)} | page.finish(target)
    made = list(made_sections(analyse(held)))
    left_out = {one.section.title: one.why for one in made if one.why}
    if as_json:
        shown = [one.section.title for one in made if one.why is None]
        print_json({"shown": shown, "not_shown": left_out, "files": written})
        return
    for title, why in left_out.items():
        typer.echo(f"not shown: {title}: {why}")
    print_files(written)


@command(
    "report tables",
    "rotorsim report tables response --out response.xlsx",
    "rs.report.write_workbook(rs.open_record('response/response.nc'), 'response.xlsx')",
)
def report_tables(
    result: Annotated[
        Path, typer.Argument(metavar="RESULT", help="Result or record .nc, or the folder that holds it.")
    ],
    out: Annotated[Path | None, typer.Option(help="Workbook to write; by default RESULT.xlsx in this folder.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the workbook if it is there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write the tables of a result or record as a workbook (.xlsx), a sheet for each set of axes."""
    from identification.readers import in_folder
    from rotorsim.report import write_workbook
    from rotorsim.signals import open_record

    target = out or Path(f"{result.stem}.xlsx")
    with files(target, force=force):
        sheets = write_workbook(open_record(in_folder(result)).load(), target)
    if as_json:
        print_json({"rows": sheets, "files": {"tables": str(target)}})
        return
    for name, size in sheets.items():
        typer.echo(f"{name}: {size} rows")
    print_files({"tables": str(target)})


def _is_file(text: str) -> bool:
    return Path(text).exists() or Path(text).suffix.lower() in (".nc", ".csv", ".mat", ".txt", ".uff", ".tdms", ".h5")


def _compensated(file: Path, mapping: Path | None, slow: Path | float | None) -> xr.Dataset:
    """A record less its slow roll: that of a file, or its own below a speed [rad/s]."""
    from identification import read
    from identification.records.sensors import SlowRollSource, without_slow_roll
    from rotorsim.base.errors import RotorsimError

    found = read(file, mapping)
    if slow is None:
        return found
    how = SlowRollSource(file=slow) if isinstance(slow, Path) else SlowRollSource(below=slow)
    try:
        return without_slow_roll(found, how, read(slow, mapping) if isinstance(slow, Path) else None)
    except RotorsimError as error:
        raise error if str(error).startswith(str(slow)) else DataError(f"{file}: {error}") from error

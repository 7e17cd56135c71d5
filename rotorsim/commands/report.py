"""`rotorsim report diagnosis | record | tables`: pages and tables of stored results and of measured records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.commands.options import AsJson, PageOptions, print_files, print_json, quantity
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files

if TYPE_CHECKING:
    import xarray as xr


@group("report", "Example: rotorsim report record run.csv --mapping rig.toml")
class Report(CommandGroup):
    """Write the page of a stored result or of a measured record."""


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

"""`rotorsim data check | cut | convert | resample | vectors | mapping`: check and convert files of measured data.

Exit code 0: sound, with the channels of at least one use. 2: cannot be read; one sentence gives the reason. 3: `check`
could read the file, but it is fit for nothing as it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_text
from rotorsim.base.units import TO_MPA, TO_RPM, TO_UM
from rotorsim.commands.options import Console, print_json, print_rows, quantity
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files

if TYPE_CHECKING:
    import xarray as xr

    from identification import Examination

UNFIT = 3
_FILE = typer.Argument(metavar="FILE", help="CSV, .mat, UFF 58, TDMS or a record .nc.")
Out = Annotated[Path, typer.Argument(metavar="OUT", help="File to write: .nc, .csv or .mat.")]
Replace = Annotated[bool, typer.Option("--force", help="Replace OUT if it is there.")]
_MAPPING = typer.Option("--mapping", help="TOML file that states which column is which channel.")
_SHOWN = {"m": (TO_UM, "um"), "rad/s": (TO_RPM, "rpm"), "Pa": (TO_MPA, "MPa"), "kg/s": (1e3, "g/s")}
"""Factor and name of the unit in which a channel [SI] is printed."""


@group("data", "Example: rotorsim data check run.csv")
class Data(CommandGroup):
    """Check measured data, map its channels, convert between formats."""


@command(
    "data check",
    "rotorsim data check run.csv --mapping rig.toml. Exit code 0 if the data is sound for a use, "
    "2 if it cannot be read, 3 if it can be read but is fit for nothing.",
    "rs.identification.examine(rs.identification.load('run.csv', 'rig.toml'))",
)
def check(
    file: Annotated[Path, _FILE],
    mapping: Annotated[Path | None, _MAPPING] = None,
    as_json: Annotated[bool, typer.Option("--json", help="The findings as JSON, in SI units.")] = False,
    proposal: Annotated[
        Path | None, typer.Option("--propose", help="Write a mapping here, guessed from names, units and values.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the mapping if it is there.")] = False,
) -> None:
    """List the contents and defects of a data file and the analyses that it is fit for."""
    if proposal is not None:
        _propose(file, proposal, force)
        return
    from identification import examine, load

    record = load(file, mapping)
    found = _asked(examine(record), record, file.stem)
    if as_json:
        print_json(_numbers(found, record))
    else:
        _print(file, found, record)
    if not found.usable:
        raise typer.Exit(UNFIT)


@command(
    "data convert",
    "rotorsim data convert run.mat run.nc --mapping rig.toml",
    "rs.identification.save(rs.identification.read('run.mat', 'rig.toml'), 'run.nc')",
)
def convert(
    file: Annotated[Path, _FILE], out: Out, mapping: Annotated[Path | None, _MAPPING] = None, force: Replace = False
) -> None:
    """Write a file's data as a record of the schema, in SI units; data with faults is refused."""
    from identification import held, read, save

    _not_itself(file, out, "convert")
    with files(out, force=force, another="name"):
        record = held(read(file, mapping), out)
        save(record, out)
    size = " x ".join(f"{n} {dim}" for dim, n in record.sizes.items())
    typer.echo(f"{out}: written, {size}: {', '.join(map(str, record.data_vars))}")
    _say_notes(record)


@command(
    "data cut",
    "rotorsim data cut run.csv run.nc --mapping rig.toml, for the longest stretch; --all for every one.",
    "rs.identification.longest(rs.identification.whole_stretches(record, 0.1))",
)
def cut(
    file: Annotated[Path, _FILE],
    out: Out,
    mapping: Annotated[Path | None, _MAPPING] = None,
    every: Annotated[bool, typer.Option("--all", help="Write every stretch: OUT-1.nc, OUT-2.nc, ...")] = False,
    shortest: Annotated[str, typer.Option(help="Shorter stretches are left out.")] = "0.1 s",
    force: Replace = False,
) -> None:
    """Cut gaps and missing values out of a file: write its longest whole stretch, or all of them."""
    from identification import checked, held, load, longest, notes_of, save, whole_stretches

    _not_itself(file, out, "cut")
    least = quantity("shortest", shortest, "s")
    with _faults_of(file):
        found = whole_stretches(load(file, mapping), least)
        chosen = [held(checked(record), out) for record in (found if every else [longest(found)])]
    names = [out.with_name(f"{out.stem}-{i + 1}{out.suffix}") for i in range(len(chosen))] if every else [out]
    with files(*names, force=force, another="name"):
        for name, record in zip(names, chosen, strict=True):
            save(record, name)
    for name, record in zip(names, chosen, strict=True):
        was = next((text for text in notes_of(record) if text.startswith("cut: ")), "whole")
        typer.echo(f"{name}: written, {record.sizes['time']} samples, {was}")
    _say_notes(chosen[0], but="cut: ")


@command(
    "data resample",
    "rotorsim data resample run.mat run.nc --mapping rig.toml --rate '5 kHz'",
    "rs.identification.resample(record, 5000.0)",
)
def resample_command(
    file: Annotated[Path, _FILE],
    out: Out,
    rate: Annotated[str, typer.Option(help="New sampling rate; the plant's own is 5 kHz.")] = "5 kHz",
    mapping: Annotated[Path | None, _MAPPING] = None,
    order: Annotated[int, typer.Option(help="Highest order that the record must still hold.", min=0)] = 0,
    force: Replace = False,
) -> None:
    """Write a file's data as a record at a lower sampling rate, filtered so that nothing folds back."""
    from identification import held, read, resample, save

    _not_itself(file, out, "resample")
    new = quantity("rate", rate, "Hz")
    with files(out, force=force, another="name"):
        with _faults_of(file):
            record = held(resample(read(file, mapping), new, order), out)
        save(record, out)
    typer.echo(f"{out}: written, {record.sizes['time']} samples, resampled {record.attrs['resampled']}")
    _say_notes(record)


@command(
    "data vectors",
    "rotorsim data vectors runup.csv runup.nc --mapping rig.toml --turns 4, then rotorsim diagnose my.toml runup.nc",
    "rs.discrepancy.runup_vectors(record, turns=4)",
)
def vectors(
    file: Annotated[Path, _FILE],
    out: Out,
    mapping: Annotated[Path | None, _MAPPING] = None,
    turns: Annotated[int, typer.Option(help="Revolutions of a window.", min=1)] = 8,
    orders: Annotated[int, typer.Option(help="Highest order.", min=1, max=20)] = 3,
    force: Replace = False,
) -> None:
    """Write 1X, 2X, 3X vectors over the speed of a run-up or coast-down that a file has over time."""
    from identification import read, save
    from rotorsim.discrepancy import runup_vectors

    _not_itself(file, out, "read")
    with files(out, force=force, another="name"):
        with _faults_of(file):
            table = runup_vectors(read(file, mapping).assign_attrs(record=file.stem), turns, range(1, orders + 1))
        save(table, out)
    rpm = table["speed"].values * TO_RPM
    rate = table.attrs["rate"] * TO_RPM
    typer.echo(f"{out}: written, {len(rpm)} speeds, {rpm[0]:.0f} to {rpm[-1]:.0f} rpm at {rate:.3g} rpm/s")
    _say_notes(table)


@command(
    "data mapping",
    "rotorsim data mapping run.csv > rig.toml",
    "rs.identification.mapping_template(rs.identification.columns('run.csv'), 'run.csv')",
)
def mapping(file: Annotated[Path, _FILE]) -> None:
    """Print a draft of the mapping for the columns of a file, to be completed."""
    from identification import columns, mapping_template

    typer.echo(mapping_template(columns(file), file.name), nl=False)


def _propose(file: Path, out: Path, force: bool) -> None:
    """Write the proposed mapping, and print what is left to do."""
    from identification import columns, propose

    _not_itself(file, out, "check")
    table = columns(file)
    text, incomplete = propose(table, file.name)
    with files(out, force=force, another="name"):
        write_text(out, text)
    of = len(table.columns)
    left = f" ({incomplete} left out or incomplete: see its comments)" if incomplete else ""
    typer.echo(f"{out}: written, {of - incomplete} of {of} columns proposed{left}; check every line, then")
    typer.echo(f"rotorsim data check {file} --mapping {out}")


@contextmanager
def _faults_of(file: Path) -> Iterator[None]:
    """Faults of the records of a file as a DataError that begins with its name."""
    from rotorsim.base.errors import SchemaError

    try:
        yield
    except SchemaError as error:
        raise DataError(str(error) if str(error).startswith(f"{file}: ") else f"{file}: {error}") from error


def _not_itself(file: Path, out: Path, verb: str) -> None:
    if out.exists() and file.exists() and out.samefile(file):
        raise DataError(f"{out}: is the file to {verb}; choose another name")


def _say_notes(record: xr.Dataset, but: str = "") -> None:
    """Print the notes on a record, but those that begin so."""
    from identification import notes_of

    for text in notes_of(record):
        if not but or not text.startswith(but):
            typer.echo(f"note: {text}")


def _numbers(found: Examination, record: xr.Dataset) -> dict[str, Any]:
    """The findings for a program; what is not finite is null."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: plain(entry) for key, entry in value.items()}
        if isinstance(value, (list, tuple)):
            return [plain(entry) for entry in value]
        return None if isinstance(value, float) and not isfinite(value) else value

    unused = _unused(record)
    return {**plain(asdict(found)), "usable": found.usable, "unused_columns": unused}


def _unused(record: xr.Dataset) -> list[str]:
    unused = record.attrs.get("unused_columns", [])
    return [unused] if isinstance(unused, str) else list(map(str, unused))


def _with_likely(column: str) -> str:
    """A column's name, and the channel that was probably meant."""
    from identification.records.proposal import likely

    meant = likely(column)
    return f"{column!r} (did you mean '{meant}'?)" if meant else repr(column)


def _print(file: Path, found: Examination, record: xr.Dataset) -> None:
    console = Console()
    console.print(f"{file}: {_summary(found)}", soft_wrap=True)
    rows = []
    for channel in found.channels:
        scale, unit = _SHOWN.get(channel.units, (1.0, channel.units))
        limits = (f"{scale * value:.6g}" for value in (channel.minimum, channel.maximum))
        rows.append((channel.name, *limits, unit, "; ".join(channel.remarks)))
    print_rows(("channel", "from", "to", "unit", "remarks"), rows)
    lines = [f"problem: {text}" for text in found.problems]
    lines += [f"warning: {text}" for text in found.warnings]
    lines += [f"{use}: {_verdict(found, use)}" for use in found.uses]
    if unused := _unused(record):
        lines.append(f"columns not used: {', '.join(map(_with_likely, unused))}")
    for line in lines:
        console.print(line, soft_wrap=True)


def _asked(found: Examination, record: xr.Dataset, name: str) -> Examination:
    """An examination with what identification and diagnosis themselves answer, where they lack no variable."""
    from identification.local.identify import refusal
    from identification.records.examination import FITS
    from rotorsim.discrepancy.run_ups import refusal as undiagnosed

    asked = [use for use in FITS if found.fit(use)]
    stated = dict.fromkeys(asked, refusal(record) if asked else "")
    stated["diagnosis"] = undiagnosed(record, name) if found.fit("diagnosis") else ""
    return replace(found, refused={**found.refused, **{use: why for use, why in stated.items() if why}})


def _summary(found: Examination) -> str:
    if found.kind == "run-up vectors":
        return f"run-up vectors at {found.samples} speeds"
    rate = f"{found.sample_rate:.6g} Hz" if isfinite(found.sample_rate) else "no clear sample rate"
    return f"time series, {found.samples} samples, {rate}, {found.duration:.6g} s"


def _verdict(found: Examination, use: str) -> str:
    if missing := found.uses[use]:
        return f"lacks {missing}"
    if found.fit(use):
        return f"fit without its gaps: {found.left_out}" if found.problems else "fit"
    if use in found.refused and not (found.problems or found.doubts):
        return f"refused: {found.refused[use]}"
    return "once the problems are corrected" if found.problems else "once the unit or the angle is corrected"

"""`rotorsim compare RUN RUN ...` and `rotorsim balance MACHINE RECORDS`: several measurements side by side.

Runs are compared by an order over the speed and its peaks; balancing finds unbalance from measured 1X vectors, and the
weights against it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_json, write_text
from rotorsim.commands.options import GivenMachine, ResultOptions, print_files, print_json
from rotorsim.commands.registry import command

if TYPE_CHECKING:
    from identification import Mapping


@command(
    "compare",
    "rotorsim compare before.nc after.nc measured.csv --mapping rig.toml",
    "rs.signals.compare_runs({'before': before, 'after': after}).peaks()",
)
def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN",
            help="Records, run-up vectors or the folders of runs, the first is the reference; or results of response, "
            "campbell, map or sweep; or machines.",
        ),
    ],
    mapping: Annotated[
        Path | None,
        typer.Option(help="TOML file that states which column is which; its section conditions holds for .nc too."),
    ] = None,
    order: Annotated[int, typer.Option(help="Multiple of the shaft speed.", min=1, max=100)] = 1,
    *,
    result: ResultOptions,
) -> None:
    """Overlay several runs and list how their peaks differ.

    Results of response, campbell, map or sweep, of several machines, are laid over each other too. Of machines the
    fields in which they differ are listed.
    """
    result.check()
    if len(runs) < 2:
        raise DataError(f"compare: {len(runs)} run; give at least two, e.g. rotorsim compare before.nc after.nc")
    if all(map(_is_machine, runs)):
        _compare_machines(_named(runs), result)
        return
    from identification import load_mapping, read
    from identification.readers import in_folder

    named = {name: in_folder(path) for name, path in _named(runs).items()}
    runs = list(named.values())
    if any(map(_is_analysis, runs)):
        _compare_results(named, result)
        return
    from rotorsim.signals.orders import compare_runs

    mapped = _mappings(runs, None if mapping is None else load_mapping(mapping))
    opened = {name: read(path, mapped[path]) for name, path in named.items()}
    found = compare_runs(opened, order)
    peaks = found.peaks()
    summary = {
        "order": order,
        "channels": found.channels,
        "peaks": peaks,
        "warnings": [found.mixed] * bool(found.mixed),
    }
    if found.mixed:
        print(f"warning: {found.mixed}", file=sys.stderr)
    with result.folder("compare", "compare.json") as folder:
        write_json(folder.add("peaks", "compare.json"), summary)
        if result.report:
            folder.write_page_of(found)
    if result.as_json:
        print_json({**summary, "files": folder.files})
        return
    for peak in peaks:
        typer.echo(_peak_text(peak))
    print_files(folder.files)


def _peak_text(peak: dict[str, Any]) -> str:
    """Peak of a run as a line."""
    change = peak.get("um_change")
    end = "" if peak["local_maximum"] else " at an end of the tracked speeds"
    more = "" if change is None else f", {100 * change:+.1f} % against the first"
    return f"{peak['run']}, {peak['axis']}: {peak['um']:.3g} um 0-pk at {peak['rpm']:.0f} rpm{end}{more}"


def _is_machine(path: Path) -> bool:
    """True if a path is that of a machine file, or the name of a shipped machine."""
    from rotorsim.machine import shipped_machines

    return path.suffix == ".toml" or str(path) in shipped_machines()


def _compare_machines(named: dict[str, Path], result: ResultOptions) -> None:
    """List the fields in which machines differ."""
    from rotorsim.machine import differences, load_machine

    rows = differences({name: load_machine(path) for name, path in named.items()})
    with result.folder("compare", "compare.json") as folder:
        write_json(folder.add("differences", "compare.json"), {"differences": rows})
    if result.as_json:
        print_json({"differences": rows, "files": folder.files})
        return
    for row in rows:
        typer.echo(f"{row['field']}: {', '.join(f'{name} {row[name]}' for name in named)}")
    if not rows:
        typer.echo("the machines are the same")
    print_files(folder.files)


def _is_analysis(path: Path) -> bool:
    """True if a file holds the result of a linear analysis in place of a run."""
    if path.suffix != ".nc" or not path.is_file():
        return False
    from rotorsim.signals import open_record

    found = open_record(path)
    return "kind" in found.attrs and "time" not in found.sizes


def _compare_results(named: dict[str, Path], result: ResultOptions) -> None:
    """Compare results of linear analyses, of one kind."""
    from rotorsim.report.comparison import result_rows
    from rotorsim.signals import open_record

    opened = {name: open_record(path).load() for name, path in named.items()}
    rows = result_rows(opened)
    with result.folder("compare", "compare.json") as folder:
        write_json(folder.add("results", "compare.json"), {"results": rows})
        if result.report:
            folder.write_page_of(opened)
    if result.as_json:
        print_json({"results": rows, "files": folder.files})
        return
    for row in rows:
        shown = (f"{k} {'none' if v is None else f'{v:.5g}' if isinstance(v, float) else v}" for k, v in row.items())
        typer.echo(", ".join(shown).removeprefix("result "))
    print_files(folder.files)


def _mappings(runs: list[Path], given: Mapping | None) -> dict[Path, Mapping | None]:
    """Mapping of each file; a record .nc takes only the conditions of one that maps columns of other files."""
    from identification import Mapping

    own = [path for path in runs if path.suffix == ".nc"]
    mapped: dict[Path, Mapping | None] = dict.fromkeys(runs, given)
    if given is not None and given.maps_columns and len(own) < len(runs):
        mapped |= dict.fromkeys(own, Mapping(conditions=given.conditions))
    return mapped


def _named(paths: list[Path]) -> dict[str, Path]:
    """Files and folders by the shortest of name, folder with name, and path that distinguishes them."""
    for name in (lambda p: p.stem, lambda p: f"{p.resolve().parent.name}/{p.stem}", str):
        found = {name(path): path for path in paths}
        if len(found) == len(paths):
            return found
    raise DataError(f"compare: {paths[0]} or another run is given twice; give different runs")


@command(
    "balance",
    "rotorsim balance bently_rk4 docs/rk4/open.csv docs/rk4/unlabelled.csv --mapping docs/rk4/balance.toml",
    "rs.balance.assess('bently_rk4', rs.balance.read_conditions(records, 'balance.toml'))",
)
def balance(
    machine: GivenMachine,
    records: Annotated[list[Path], typer.Argument(metavar="RECORDS", help="CSV files of 1X vectors, a row a record.")],
    mapping: Annotated[Path, typer.Option(help="TOML file: which columns are probes, planes and known unbalances.")],
    correct: Annotated[str, typer.Option(help="Condition to balance; default the first without added unbalance.")] = "",
    *,
    result: ResultOptions,
) -> None:
    """Find unbalance and correction weights from 1X vectors.

    By influence coefficients and by the machine's model, side by side.
    """
    result.check()
    from rotorsim.machine import load_machine

    model = load_machine(machine)
    from rotorsim.balance import assess, read_conditions
    from rotorsim.balance.unbalance import result_rows, summary, unbalance_csv

    found = assess(model, read_conditions(records, mapping), correct)
    with result.folder("balance", "balance.json", "unbalance.csv") as folder:
        write_json(folder.add("results", "balance.json"), summary(found))
        write_text(folder.add("unbalance", "unbalance.csv"), unbalance_csv(found))
        if result.report:
            folder.write_page_of(found)
    result.show(summary(found), result_rows(found), folder.files)

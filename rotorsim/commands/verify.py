"""`rotorsim verify`: pass or fail of a control law on the nonlinear plant of a machine."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from rotorsim.base.exchange import json_text as json
from rotorsim.base.files import write_json
from rotorsim.base.progress import on_terminal
from rotorsim.commands.console import Console
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import Force, MachineName, PlantOptions, a_folder, note_compiling
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import results
from rotorsim.control import load_law
from rotorsim.verify import Verification, closed_loop, safe_speed
from rotorsim.verify.closed_loop import edited
from rotorsim.verify.safe_speed import comparison, sentence

FAILED = 1


@example(
    "rotorsim verify hinf.json dtu_gas_bearing --out verification",
    "rs.verify.closed_loop(rs.load_law('hinf.json'), plant)",
)
def verify(
    law: Annotated[Path, typer.Argument(help="Law that 'rotorsim design' wrote.")],
    machine: MachineName = "dtu_gas_bearing",
    quick: Annotated[bool, typer.Option("--quick", help="Five impact points, this machine alone.")] = False,
    safe: Annotated[bool, typer.Option("--safe-speed", help="Also run up until the safety circle is left.")] = False,
    out: Annotated[Path | None, typer.Option("--out", callback=a_folder, help="Folder for report and table.")] = None,
    *,
    settings: PlantOptions,
    page: PageOptions,
    force: Force = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
) -> None:
    """Verify a control law on a machine's nonlinear plant.

    Exit code 1 if a criterion fails.
    """
    page.check()
    loaded = load_law(law)
    plant = settings.plant(machine)
    with results(out, "verification", ("table.json", "report.html"), force) as folder:
        page.begin(folder / "report.html", force)
        note_compiling(plant.assembly, "settle", "run")
        result = closed_loop(loaded, plant, quick=quick, progress=_progress())
        if safe:
            pair = [safe_speed(plant, one) for one in (None, loaded)]
            result.runs["safe_speed"] = pair
        first = _first(folder / "table.json") or result.settings["criteria"]
        result.settings.update(first=first, edited=edited(first, result.settings["criteria"]))
        write_json(folder / "table.json", _plain(result))
        files = {"report": str(result.report(folder / "report.html"))}
        files |= page.finish(files["report"])
    _print(result, files, as_json)
    raise typer.Exit(0 if result.passed else FAILED)


def _progress() -> Callable[[str], None] | None:
    """Steps on a terminal, silence in a pipe."""
    return (lambda step: print(f"{step} ...", file=sys.stderr)) if on_terminal() else None


def _first(path: Path) -> dict[str, float | None] | None:
    """Bounds of the first verification in the folder, from the table that is replaced; None where it states none."""
    try:
        before = json.loads(path.read_text(encoding="utf-8-sig"))
        found = before.get("first_criteria", before["criteria"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return found if isinstance(found, dict) else None


def _plain(result: Verification) -> dict[str, object]:
    numbers: dict[str, object] = {"law": result.law.name, "machine": result.machine, "passed": result.passed}
    numbers |= {"criteria": result.settings["criteria"], "first_criteria": result.settings["first"]}
    numbers["edited"] = result.settings["edited"]
    numbers["rows"] = [
        {key: None if isinstance(v, float) and not isfinite(v) else v for key, v in row.items()} for row in result.table
    ]
    numbers["alarms"] = [asdict(one) for one in result.alarms]
    if result.remark:
        numbers["remark"] = result.remark
    if "safe_speed" in result.runs:
        numbers["safe_speed"] = comparison(*result.runs["safe_speed"])
    return numbers


def _print(result: Verification, files: dict[str, str], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(_plain(result) | files, indent=2))
        return
    table = Table("criterion", "measured", "bound", "", "remark", box=None, pad_edge=False)
    for row in result.rows:
        words = {True: "pass", False: "FAIL", None: "-"}[row.passed]
        bound = "" if row.bound is None else f"{row.bound:.3g}"
        table.add_row(*map(escape, (row.check, f"{row.measured:.3g} {row.unit}", bound, words, row.remark)))
    console = Console()
    console.print(table)
    for bound in result.settings["edited"]:
        console.print(f"edited bound: {escape(bound)}")
    if "safe_speed" in result.runs:
        console.print(escape(f"safe speed: {sentence(*result.runs['safe_speed'])}"), soft_wrap=True)
    console.print(f"{result.law.name} on {result.machine}: {'passed' if result.passed else 'FAILED'}")
    for kind, path in files.items():
        console.print(f"{kind}: {path}", soft_wrap=True)

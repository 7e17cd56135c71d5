"""`rotorsim report diagnosis FOLDER`: pages of stored results, written again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.commands.options import AsJson, PageOptions
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files


@group("report", "Example: rotorsim report diagnosis diagnosis --units imperial")
class Report(CommandGroup):
    """Write the page of a stored result again."""


@command(
    "report diagnosis",
    "rotorsim report diagnosis diagnosis --out again.html --units imperial",
    "rs.discrepancy.load_diagnosis('diagnosis').report('again.html')",
)
def diagnosis(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder that 'rotorsim diagnose' wrote.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Page to write; by default that in the folder, in place of the older.")
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
        typer.echo(json.dumps({"verdict": found.sentence, "files": written}, indent=2))
        return
    typer.echo(found.sentence)
    for kind, path in written.items():
        typer.echo(f"{kind}: {path}")

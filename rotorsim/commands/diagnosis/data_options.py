"""Options of `rotorsim diagnose` on its data: records by their use, columns, candidates, tolerance of the model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.commands.completion import parameters


@dataclass(frozen=True)
class DataOptions:
    """What is diagnosed, and what may be missing."""

    records: Annotated[
        list[Path] | None, typer.Argument(metavar="RECORDS", help="Records to fit: files, or a folder of .nc.")
    ] = None
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", help="Record at another operating point that chooses the effect.")
    ] = None
    untouched: Annotated[
        list[Path] | None, typer.Option("--untouched", help="Record that only shows the gap; may be repeated.")
    ] = None
    mapping: Annotated[Path | None, typer.Option("--mapping", help="Columns of files that are not .nc.")] = None
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            help="Only this is a candidate, e.g. runout or runout.amplitude_2x; may be repeated.",
            autocompletion=parameters,
        ),
    ] = None
    tolerance: Annotated[float, typer.Option("--tolerance", help="Tolerance of the model: share of a line.")] = 0.004

    def check(self, records: bool) -> None:
        """Raise DataError for a tolerance that is not a fraction, and without `records` where they are needed."""
        if records and not self.records:
            raise DataError("diagnose: no records; name files or a folder, or give --self-test")
        if not 0 < self.tolerance < 1:
            text = f"--tolerance: {self.tolerance:g} is not a fraction; give a number between 0 and 1, e.g. 0.004"
            raise DataError(text)

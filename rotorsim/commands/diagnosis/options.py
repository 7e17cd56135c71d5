"""Options of `rotorsim diagnose`: its data, and the next experiments as a plan or made on a rig."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorsim.base.constants import MINUTE
from rotorsim.base.errors import DataError
from rotorsim.base.units import parse
from rotorsim.commands.completion import parameters
from rotorsim.discrepancy.decision import ALLOWED, check_allowed

if TYPE_CHECKING:
    from rotorsim.discrepancy.loop import ExperimentRig
    from rotorsim.machine import Machine

BUDGET, WAIT = "30 min", "8 h"
"""Rig time of the experiments, and longest time to wait for a record, where none is given."""


@dataclass(frozen=True)
class DataOptions:
    """Records by their use, columns, candidates, and tolerance of the model."""

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


@dataclass(frozen=True)
class ExperimentOptions:
    """Next experiments: planned or made, on which rig, with which changes and rig time."""

    plan_next: Annotated[
        bool,
        typer.Option("--plan-next", help="Rank the experiments that may come next; write the best as a plan."),
    ] = False
    allow: Annotated[
        str | None,
        typer.Option("--allow", help=f"What experiments may change: {', '.join(ALLOWED)}; all if not given."),
    ] = None
    until_decided: Annotated[
        bool,
        typer.Option("--until-decided", help="Make experiments on --rig until one explanation has 95 %."),
    ] = False
    rig: Annotated[
        str | None,
        typer.Option("--rig", help="virtual:FOLDER of 'hide', or the folder into which new records are put."),
    ] = None
    budget: Annotated[
        str | None, typer.Option("--budget", help=f"Rig time that experiments may take; {BUDGET} if not given.")
    ] = None
    wait: Annotated[
        str | None, typer.Option("--wait", help=f"Longest time to wait for a record; {WAIT} if not given.")
    ] = None

    def check(self, roles: bool) -> None:
        """Raise DataError for options that do not belong together; `roles`: whether records have one by an option."""
        if self.allow is not None and not (self.plan_next or self.until_decided):
            raise DataError("--allow: is about a plan; give --plan-next or --until-decided too")
        _ = self.allowed
        if not self.until_decided:
            for option, given in (("rig", self.rig), ("budget", self.budget), ("wait", self.wait)):
                if given is not None:
                    raise DataError(f"--{option}: is about a loop of experiments; give --until-decided too")
        elif self.rig is None:
            raise DataError(
                "--until-decided: needs --rig: virtual:FOLDER of rotorsim hide, or a folder for new records"
            )
        elif roles:  # records that are yet to come cannot have one
            raise DataError(
                "--until-decided: takes no --held-out and --untouched; state the attribute role in the records"
            )

    @property
    def allowed(self) -> tuple[str, ...]:
        """Changes that experiments may make; raises DataError for something unknown."""
        return check_allowed([] if self.allow is None else [name.strip() for name in self.allow.split(",")])

    @property
    def budget_minutes(self) -> float:
        """Rig time of the experiments [min]; raises DataError."""
        return _minutes("--budget", self.budget or BUDGET)

    def open_rig(self, machine: Machine) -> ExperimentRig:
        """The rig, with the longest wait for a record; raises DataError where the text names none."""
        from rotorsim.discrepancy.loop import open_rig

        longest = MINUTE * _minutes("--wait", self.wait or WAIT)
        return open_rig(str(self.rig), machine, longest)


def _minutes(option: str, text: str) -> float:
    """Minutes of a time as text; raises DataError."""
    try:
        found = parse(text, "s") / MINUTE
    except ValueError as error:
        raise DataError(f"{option}: {error}") from error
    if found <= 0:
        raise DataError(f"{option}: '{text}' is not above 0; give e.g. '30 min'")
    return found

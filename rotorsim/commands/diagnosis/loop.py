"""`rotorsim diagnose --until-decided`: diagnoses and experiments in turn, with a table of the odds after each."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import typer

from rotorsim.base.constants import MINUTE
from rotorsim.base.errors import DataError
from rotorsim.base.progress import end_line, on_terminal
from rotorsim.base.units import parse
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import results
from rotorsim.discrepancy import Diagnosis, decide
from rotorsim.discrepancy.loop.rigs import open_rig
from rotorsim.discrepancy.loop.steps import FILE, Steps
from rotorsim.discrepancy.odds.explanation import shown_share
from rotorsim.discrepancy.outcome.files import RESULTS, save_diagnosis
from rotorsim.machine import load_machine

BUDGET, WAIT = "30 min", "8 h"
"""Rig time of the experiments, and longest time to wait for a record, where none is given."""
FOLDER = Path("decision")
"""Folder of a loop when none is given; one name, so that the same command resumes."""


@dataclass(frozen=True)
class Asked:
    """What a loop is asked to do: rig, budget and longest wait for a record as texts, what may change, the page."""

    rig: str
    budget: str | None
    wait: str | None
    allow: tuple[str, ...]
    tolerance: float
    page: PageOptions


def minutes(option: str, text: str) -> float:
    """Minutes of a time as text; raises DataError."""
    try:
        found = parse(text, "s") / MINUTE
    except ValueError as error:
        raise DataError(f"{option}: {error}") from error
    if found <= 0:
        raise DataError(f"{option}: '{text}' is not above 0; give e.g. '30 min'")
    return found


def run_loop(
    machine: str, records: list[Path], mapping: Path | None, effect: list[str] | None, asked: Asked, out: Path | None,
    force: bool, report: bool, progress: Callable[[str], None], as_json: bool,
) -> tuple[Diagnosis, dict[str, str]]:  # fmt: skip
    """The last diagnosis and its files."""
    folder, loaded = out or FOLDER, load_machine(machine)
    budget = minutes("--budget", asked.budget or BUDGET)
    longest = MINUTE * minutes("--wait", asked.wait or WAIT)
    rig = open_rig(asked.rig, loaded, longest)
    with results(folder, str(FOLDER), (*RESULTS.values(), FILE), force or (folder / FILE).exists()) as place:
        asked.page.begin(place / RESULTS["report"], True)
        found = decide(
            loaded, rig, budget, records, asked.allow, effect, out=place, mapping=mapping, progress=progress,
            shown=Shown(place / RESULTS["plan"], as_json).show, tolerance=asked.tolerance, anew=force,
        )  # fmt: skip
        files = save_diagnosis(found, place, report)
        if report:
            files |= asked.page.finish(files["report"])
    return found, files | {"steps": str(place / FILE)}


@dataclass
class Shown:
    """Steps as they come: the odds after each, and which experiment to make next."""

    plan: Path
    as_json: bool
    steps: int = 0
    waited: str = ""

    def show(self, steps: Steps) -> None:
        """Print what is new, on standard error where the result is JSON."""
        stream = sys.stderr if self.as_json else sys.stdout
        if on_terminal():
            end_line()
        if len(steps.steps) > self.steps:
            self.steps, last = len(steps.steps), steps.steps[-1]
            odds = sorted(last.odds.items(), key=lambda one: -one[1])[:3]
            text = ", ".join(f"{shown_share(p)} {name}" for name, p in odds)
            print(f"step {self.steps - 1}, {last.experiment or 'records there are'}: {text}", file=stream, flush=True)
        name = str(steps.pending.get("experiment", ""))
        if name and not steps.made and name != self.waited:
            self.waited = name
            text = f"next: {name} ({steps.pending['minutes']:.0f} min); as a plan: {self.plan}"
            print(text, file=stream, flush=True)


def print_steps(found: Diagnosis) -> None:
    """The table of the odds after each step, and how the loop ended."""
    if found.steps is not None:
        typer.echo(found.steps.table())
        typer.echo(found.steps.sentence)

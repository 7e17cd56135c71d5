"""`rotorsim diagnose --until-decided`: diagnoses and experiments in turn, with a table of the odds after each."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rotorsim.base.progress import end_line, on_terminal
from rotorsim.commands.diagnosis.data_options import DataOptions
from rotorsim.commands.diagnosis.experiment_options import ExperimentOptions
from rotorsim.commands.options import PageOptions
from rotorsim.commands.results import results
from rotorsim.discrepancy import Diagnosis, decide
from rotorsim.discrepancy.odds import shown_share
from rotorsim.discrepancy.outcome.files import RESULTS, save_diagnosis
from rotorsim.discrepancy.outcome.steps import FILE, DecisionSteps
from rotorsim.machine import load_machine

FOLDER = Path("decision")
"""Folder of a loop when none is given; one name, so that the same command resumes."""


def run_loop(
    machine: str, data: DataOptions, experiments: ExperimentOptions, out: Path | None, force: bool, report: bool,
    page: PageOptions, progress: Callable[[str], None], as_json: bool,
) -> tuple[Diagnosis, dict[str, str]]:  # fmt: skip
    """The last diagnosis and its files."""
    folder, loaded = out or FOLDER, load_machine(machine)
    budget, rig = experiments.budget_minutes, experiments.open_rig(loaded)
    with results(folder, str(FOLDER), (*RESULTS.values(), FILE), force or (folder / FILE).exists()) as place:
        page.begin(place / RESULTS["report"], True)
        found = decide(
            loaded,
            rig,
            budget,
            data.records or (),
            experiments.allowed,
            data.effect,
            out=place,
            mapping=data.mapping,
            progress=progress,
            shown=StepPrinter(place / RESULTS["plan"], as_json).show,
            tolerance=data.tolerance,
            anew=force,
        )
        files = save_diagnosis(found, place, report)
        if report:
            files |= page.finish(files["report"])
    return found, files | {"steps": str(place / FILE)}


@dataclass
class StepPrinter:
    """Steps as they come: the odds after each, and which experiment to make next."""

    plan: Path
    as_json: bool
    steps: int = 0
    waited: str = ""

    def show(self, steps: DecisionSteps) -> None:
        """Print what is new, on standard error where the result is JSON."""
        stream = sys.stderr if self.as_json else sys.stdout
        if on_terminal():
            end_line()
        if len(steps.steps) > self.steps:
            self.steps, last = len(steps.steps), steps.steps[-1]
            odds = sorted(last.odds.items(), key=lambda one: -one[1])[:3]
            text = ", ".join(f"{shown_share(p)} {name}" for name, p in odds)
            print(f"step {self.steps - 1}, {steps.names[-1]}: {text}", file=stream, flush=True)
        name = str(steps.pending.get("experiment", ""))
        if name and not steps.made and name != self.waited:
            self.waited = name
            text = f"next: {name} ({steps.pending['minutes']:.0f} min); as a plan: {self.plan}"
            print(text, file=stream, flush=True)

"""A diagnosis on the terminal: progress, steps of a loop, verdict, odds, sizes, misfit and plan, as text or JSON."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rotorsim.base.display import end_line, line, on_terminal
from rotorsim.base.units import TO_UM
from rotorsim.commands.options import print_files, print_json

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis
    from rotorsim.discrepancy.decision import DecisionSteps
    from rotorsim.discrepancy.ranking import ExperimentPlan

STAGES = {
    "compile": "compiling the machine with all candidate effects, on three grids and laws: about 50 s, once",
    "check": "checking the records",
    "calibrate": "re-calibrating",
    "prove": "proving the solver",
    "screen": "screening candidates",
    "name": "re-fitting candidates",
    "show": "showing the gap",
    "plan": "planning the next experiment",
    "experiment": "waiting for the record of the experiment",
}


def show(diagnosis: Diagnosis, files: dict[str, str], as_json: bool) -> None:
    """Print the diagnosis and the paths of its files by kind."""
    if as_json:
        print_json(diagnosis.as_dict() | {"files": files})
        return
    end_line()
    for text in _lines(diagnosis):
        typer.echo(text)
    print_files(files)


def _lines(diagnosis: Diagnosis) -> Iterator[str]:
    from rotorsim.discrepancy.result import PLAN_NEXT

    if diagnosis.steps is not None:
        yield diagnosis.steps.table()
        yield diagnosis.steps.sentence
    yield diagnosis.sentence
    yield from _odds(diagnosis)
    yield from _effects(diagnosis)
    yield from _disagreement(diagnosis)
    if diagnosis.unplanned:
        yield PLAN_NEXT
    if diagnosis.planned is not None:
        yield from _plan(diagnosis.planned)
    for note in diagnosis.notes:
        yield f"  note: {note}"


def _odds(diagnosis: Diagnosis) -> Iterator[str]:
    from rotorsim.discrepancy.verdict import LEAST_SHOWN, shown_share

    for one in diagnosis.explanations[:4]:
        if one.probability >= LEAST_SHOWN:
            yield f"  probability {shown_share(one.probability)}: {one.name}"
            if one.unseen:
                yield f"    {one.unseen_sentence}"


def _effects(diagnosis: Diagnosis) -> Iterator[str]:
    """Each effect that was found, with its sizes and what is indistinguishable from it."""
    for found in diagnosis.effects:
        numbers = (f"{p} = {value}" + (f" +- {sd}" if sd else "") for p, value, sd in found.sizes())
        yield f"  {found.form}: {', '.join(numbers)}"
        others = [k for k in found.tie_class if k != found.form]
        if others:
            yield f"    no record distinguishes it from: {', '.join(others)}"


def _disagreement(diagnosis: Diagnosis) -> Iterator[str]:
    """Groups of lines beyond the floor, the gap that is gone, the equivalent force of what is left."""
    from rotorsim.discrepancy.gap import reduction

    for flag in diagnosis.localisation[:6]:
        yield (
            f"  {flag.record} ({flag.point}), {flag.channel}, {flag.group}: {flag.rms * TO_UM:.3g} um over a floor of "
            f"{flag.floor * TO_UM:.2g} um" + (f", largest {flag.place}" if flag.place else "")
        )
    share = reduction(diagnosis.gap)
    if diagnosis.effects and share == share:
        yield f"  gap on untouched records, re-calibrated to with effect: {100 * share:.0f} % gone"
    for one in diagnosis.unknown.get("lines", ())[:3]:
        place = f"{one['frequency_hz']:.4g} Hz, {one['direction']}, {one['point']}"
        yield f"  equivalent force {one['force_n']:.3g} N at {place}"


def _plan(plan: ExperimentPlan) -> Iterator[str]:
    """The sentence and the best five experiments."""
    yield plan.sentence
    for sentence in plan.unbreakable:
        yield f"  {sentence}"
    for one in plan.proposals[:5]:
        yield (
            f"  {one.option.name}: {one.option.minutes:.0f} min, {one.outlook.entropy:.2f} bit left, "
            f"{100 * one.outlook.decided:.0f} % chance of a decision"
        )


class Stages:
    """Progress by stage on a terminal; in a pipe a line when a stage begins for the first time."""

    def __init__(self) -> None:
        self.stage, self.steps, self.begin = "", 0, time.monotonic()
        self.seen: set[str] = set()

    def show(self, stage: str) -> None:
        """Note one step of a stage."""
        self.steps = self.steps + 1 if stage == self.stage else 1
        new, self.stage = stage != self.stage, stage
        if not on_terminal():
            if stage not in self.seen:
                print(STAGES[stage], file=sys.stderr, flush=True)
            self.seen.add(stage)
            return
        elapsed = time.monotonic() - self.begin
        if new and elapsed > 0.5:
            end_line()
        number = list(STAGES).index(stage) + 1
        bar = "#" * number + "." * (len(STAGES) - number)
        line(f"[{bar}] {STAGES[stage]}: step {self.steps}, {elapsed:.0f} s")


@dataclass
class StepPrinter:
    """Printer of a loop's steps: the odds after each, and the experiment to make next."""

    plan: Path
    as_json: bool
    steps: int = 0
    waited: str = ""

    def show(self, steps: DecisionSteps) -> None:
        """Print what is new, on standard error where the result is JSON."""

        from rotorsim.discrepancy.verdict import shown_share

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

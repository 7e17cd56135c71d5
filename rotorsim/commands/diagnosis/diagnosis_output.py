"""A diagnosis on the terminal: verdict, probabilities, sizes, where it disagrees, plan, notes, files; or as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator

import typer

from rotorsim.base.constants import TO_UM
from rotorsim.base.progress import end_line
from rotorsim.discrepancy import Diagnosis
from rotorsim.discrepancy.odds import LEAST_SHOWN, shown_share
from rotorsim.discrepancy.outcome.gap import reduction
from rotorsim.discrepancy.outcome.result import PLAN_NEXT
from rotorsim.discrepancy.plan.ranking import ExperimentPlan


def show(diagnosis: Diagnosis, files: dict[str, str], as_json: bool) -> None:
    """Print the diagnosis and the paths of its files by kind."""
    if as_json:
        typer.echo(json.dumps(diagnosis.as_dict() | {"files": files}, indent=2, default=float))
        return
    end_line()
    for line in _lines(diagnosis):
        typer.echo(line)
    for kind, path in files.items():
        typer.echo(f"{kind}: {path}")


def _lines(diagnosis: Diagnosis) -> Iterator[str]:
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

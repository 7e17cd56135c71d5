"""Experiments as rows of a table, Markdown, plain values and sections of a report."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from rotorsim.machine import Machine
from studies.thesis.claims.verdicts import number
from studies.thesis.experiments.run import Found
from studies.thesis.experiments.table import figure_of, values

if TYPE_CHECKING:
    from rotorsim.report.page import Block

SUMMARY = ("claims", "number", "changed to", "figures met", "lost of Table E.2")
HEADS = ("figure", "thesis", "here", "with the changed number", "verdicts", "thesis' number at")


def rows(found: Found) -> list[tuple[str, ...]]:
    """Figure by figure: ours, that at the best factor, both verdicts, and the factor that gives the thesis' number."""
    best = found.best
    listed: list[tuple[str, ...]] = []
    for key in found.experiment.figures:
        figure, at = figure_of(key), found.reached(key)
        both = found.verdict(key, 1.0), found.verdict(key, best)
        listed.append((
            f"{key.split('.')[0]} {figure.words}", f"{number(figure.thesis)} {figure.unit}".strip(),
            number(found.value(key, 1.0)), f"{number(found.value(key, best))} (x {best:g})", " -> ".join(both),
            "no factor tried" if at is None else f"x {at:.4g}",
        ))  # fmt: skip
    return listed


def sentence(found: Found, machine: Machine) -> str:
    """The number, its value here, what else the machine then leaves, and why the value is not taken."""
    one = found.experiment
    own = ", ".join(dict.fromkeys(f"{value:.4g}" for value, _ in values(machine, one).values()))
    factors = ", ".join(f"{factor:g}" for factor in one.factors)
    text = f"{one.words[0].upper()}{one.words[1:]} ({', '.join(one.fields)}; here {own} in SI units), times {factors}. "
    if found.best != 1:
        text += f"At {found.best:g} times it, of the calibrated rows of Table E.2, " + (
            f"{', '.join(found.broken)} are lost. " if found.broken else "none is lost. "
        )
    text += "".join(f"At {factor:g} no figure: {why} " for factor, why in found.failed.items())
    return text + one.why


def summary(found: Sequence[Found]) -> list[tuple[str, ...]]:
    """A row for each experiment: claims, number, factor that meets the most figures, how many, what is then lost."""
    listed: list[tuple[str, ...]] = []
    for one in found:
        best, count = one.best, len(one.experiment.figures)
        lost = ", ".join(one.broken) or "none" if best != 1 else ""
        met = f"{one.met(1.0)} to {one.met(best)} of {count}"
        changed = f"x {best:g}" if best != 1 else "no factor tried is better"
        listed.append((", ".join(one.experiment.claims), one.experiment.words, changed, met, lost))
    return listed


def markdown(found: Sequence[Found], machine: Machine) -> str:
    """All experiments as Markdown: a row for each, then each with its figures."""
    text = [f"| {' | '.join(SUMMARY)} |", f"|{'---|' * len(SUMMARY)}"]
    text += [*(f"| {' | '.join(_escaped(cell) for cell in row)} |" for row in summary(found)), ""]
    for one in found:
        text += [f"**{', '.join(one.experiment.claims)}.** {sentence(one, machine)}", "", f"| {' | '.join(HEADS)} |"]
        text += [f"|{'---|' * len(HEADS)}", *(f"| {' | '.join(_escaped(cell) for cell in row)} |" for row in rows(one))]
        text += [""]
    return "\n".join(text)


def _escaped(words: str) -> str:
    return words.replace("|", r"\|")


def plain(found: Sequence[Found]) -> list[dict[str, Any]]:
    """Plain values for JSON."""
    return [
        {
            "name": one.experiment.name, "claims": list(one.experiment.claims), "fields": list(one.experiment.fields),
            "best": one.best, "broken": one.broken, "failed": {f"{f:g}": why for f, why in one.failed.items()},
            "figures": {key: _plain(one, key) for key in one.experiment.figures},
        }
        for one in found
    ]  # fmt: skip


def _plain(found: Found, key: str) -> dict[str, Any]:
    """A figure at all factors; None where there is no finite number."""
    numbers = {f"{f:g}": found.value(key, f) for f in found.experiment.factors}
    return {
        "thesis": figure_of(key).thesis,
        "values": {f: v if v is not None and isfinite(v) else None for f, v in numbers.items()},
        "verdicts": {f"{f:g}": found.verdict(key, f) for f in found.experiment.factors},
        "reached": found.reached(key),
    }


def blocks(found: Sequence[Found], machine: Machine) -> list[Block]:
    """A table and a figure for each experiment."""
    from rotorsim.report.page import Block
    from studies.thesis.figures import over_factor

    made = [Block("Experiments", "The factor that the most figures are met at.", SUMMARY, summary(found))]
    for one in found:
        title = f"{', '.join(one.experiment.claims)}: {one.experiment.words}"
        made.append(Block(title, sentence(one, machine), HEADS, rows(one)))
        keys = {figure_of(key).words: key for key in one.experiment.figures}
        curves = {words: [(f, one.value(key, f)) for f in sorted(one.numbers)] for words, key in keys.items()}
        bands = {words: (figure_of(key).thesis, figure_of(key).met) for words, key in keys.items()}
        made.append(Block("", figure=over_factor(curves, bands)))
    return made

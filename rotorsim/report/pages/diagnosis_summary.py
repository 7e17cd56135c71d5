"""First screen of the report of a diagnosis: verdict, probabilities, place on the machine, next step, gap."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.discrepancy.explanation import NOTHING, Explanation, shown_share
from rotorsim.discrepancy.outcome.gap import reduction
from rotorsim.discrepancy.outcome.result import FORCE, NO_ACCURACY, NOTHING_BEYOND, PLAN_NEXT, LocatedEffect, located
from rotorsim.report.figures.diagnosis_summary_plots import gap_by_role, leading_odds, stages_of
from rotorsim.report.figures.machine_sketch import MARKS, machine_sketch
from rotorsim.report.pages import html

if TYPE_CHECKING:
    from rotorsim.discrepancy import Diagnosis

MEANING = {
    "no_disagreement": "The file describes the machine as well as these records can show. Nothing needs to be added.",
    "named": "One explanation has 95 % and accounts for at least 95 % of what was beyond the floor, also in held-out "
    "records where there are any.",
    "tie": "No explanation has 95 % alone; the machine file holds the most probable effect. No name is given: choose "
    "by what is known, or plan and record an experiment that distinguishes them.",
    "partial": "An effect explains part of what is beyond the floor. Something else is missing; it is not a name.",
    "unknown": "Nothing in the catalogue explains what is beyond the floor. The force on the disc that would "
    "explain it is given below.",
}
NEXT = {
    "no_disagreement": "Use the re-calibrated machine file. Nothing needs to be recorded.",
    "named": "Inspect {places}; the new machine file holds the effect.",
    "tie": "Inspect {places}: these records do not distinguish the explanations.",
    "partial": "Do not use the effect as found. Inspect {places}, record more operating points at two excitation "
    "amplitudes, and diagnose again.",
    "unknown": "Look on the machine for what acts like the equivalent force below, by its frequency, its direction and "
    "what it grows with. If it is known, write it as an effect of your own and diagnose again.",
}
"""What to do, by verdict, where no experiment is proposed."""
NO_PLACE = "the machine"
ALSO = {"found": "", "rival": "or ", "force": ""}


def first_screen(d: Diagnosis) -> str:
    """The parts that a reader sees without scrolling."""
    panels = [*_odds(d), _where(d), _next(d), _before_after(d)]
    return f'{_cards(d)}<div class="first">{"".join(panels)}</div>'


def _cards(d: Diagnosis) -> str:
    cards = [(d.status.replace("_", " "), "verdict")]
    cards += [(shown_share(e.probability), _card_name(e)) for e in d.explanations[:1]]
    cards += [(f"{len(d.localisation)}", "groups of lines beyond the floor")]
    share = reduction(d.gap)
    if d.effects and np.isfinite(share):
        cards.append((f"{100 * share:.0f} %", "gap gone on untouched records"))
    return html.key_numbers(cards)


def _card_name(e: Explanation) -> str:
    if e.name == NOTHING:
        return f"that {e.name}"
    others = [" with ".join(keys) for keys in e.alike]
    return " or ".join([e.name, *(others if len(others) == 1 else [f"{len(others)} others"] if others else [])])


def _odds(d: Diagnosis) -> Iterator[str]:
    if d.explanations:
        yield html.section("How probable each explanation is", html.drawn(leading_odds(d), tools=False))


def _where(d: Diagnosis) -> str:
    """Sketch of the machine with the places of the effects."""
    found = located(d)
    lines = (html.coloured(f"{ALSO[one.role]}{one.sentence}", MARKS[one.role][1]) for one in found)
    text = "<br>".join(lines) or "Nothing is marked: no effect was found."
    marked = [(one.role, place) for one in found for place in one.places]
    return html.section(
        "Where on the machine", f"<p>{text}</p>{html.drawn(machine_sketch(d.machine, marked), tools=False)}"
    )


def _next(d: Diagnosis) -> str:
    """The next step, and the meaning of the verdict."""
    text = f'<p class="step">{escape(next_step(d))}</p><p>{escape(_meaning(d))}</p>'
    if d.notes:
        count = f"{len(d.notes)} notes" if len(d.notes) > 1 else "a note"
        text += f'<p>The limits of these records: <a href="#notes">{count}</a> below.</p>'
    return html.section("What to do next", text)


def next_step(d: Diagnosis) -> str:
    """What to do next: the plan's sentence, else what follows from the verdict, with how to get a plan."""
    if d.planned is not None and d.planned.as_dict().get("proposals"):
        return d.planned.sentence
    if d.status == "unknown" and NO_ACCURACY in d.notes and not d.localisation:
        return f"{NO_ACCURACY[:1].upper()}{NO_ACCURACY[1:]}."
    step = NEXT[d.status].format(places=_places(located(d)))
    if d.planned is not None:
        return f"{d.planned.sentence} {step}"
    return f"{step} {PLAN_NEXT}" if d.unplanned else step


def _meaning(d: Diagnosis) -> str:
    """What the verdict states; of records without a group beyond their own scatter that alone."""
    return MEANING[d.status] if d.status != "unknown" or d.localisation else NOTHING_BEYOND


def _places(found: tuple[LocatedEffect, ...]) -> str:
    names = dict.fromkeys(place.name for one in found if one.label != FORCE for place in one.places)
    return " and ".join(names) or NO_PLACE


def _before_after(d: Diagnosis) -> str:
    names = {"nominal": "file as given", "with effect": "with the effect"}
    stages = "".join(html.coloured(names.get(name, name), colour) for name, colour in stages_of(d).items())
    text = f"<p>Rms of measured less simulated; the line is the scatter of repeats.<br>{stages}</p>"
    return html.section("Gap before and after", text + html.drawn(gap_by_role(d), tools=False))


__all__ = ["first_screen", "next_step"]

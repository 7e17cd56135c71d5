"""Verdict table of the claims as report sections, plain values, text lines and Markdown.

Every table has the verdict by the rules as they are now and by the first ones, and what the thesis' own printed model
gives where the claim can be computed from it: a figure that it misses is a contradiction inside the thesis.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from math import isinf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from studies.thesis.claims.judge import MET, NEAR, NOT_MET, Judged, Numbers, count, judge, judge_figure
from studies.thesis.claims.rules import Amendment, Claim, ClaimFigure, Interval, claims, first_claims, marked
from studies.thesis.printed import printed_numbers

if TYPE_CHECKING:
    from rotorsim.report.page import Block

FITTED = " (fitted)"
OWN = "thesis' own model"
"""Head of what the thesis' printed models give with its printed laws."""
FIRST_RULE = "first rule"
HEADS = ("figure", "thesis", OWN, "here", f"{MET} in", f"{NEAR} in", "verdict", FIRST_RULE)
NO_RULE = "-"
"""Verdict of the first rules on a claim that they do not have."""


def verdicts(
    ours: Numbers,
    letters: str = "ICN",
    left_out: Collection[str] = (),
    elsewhere: Mapping[str, Numbers] = MappingProxyType({}),
) -> list[Judged]:
    """Verdicts, by the rules as they are now and by the first ones, on claims whose number begins with a letter.

    What `ours` does not hold is not run in the claims of `left_out`, and not met in all others. The first rules measure
    everything on one machine, the rules as they are now some claims `elsewhere`, whose numbers stand there by machine;
    a study of one machine gives none, and judges all claims on it.
    """

    def judged(claim: Claim) -> Judged:
        return judge(claim, elsewhere.get(claim.machine, ours).get(claim.number, {}), left_out)

    first = {claim.number: judged(marked(claim)) for claim in first_claims()}
    return [replace(judged(one), first=first.get(one.number)) for one in claims() if one.number[0] in letters]


def counted(found: Sequence[Judged]) -> str:
    """Number of claims with each verdict, by the rules and by the first rules, and of those added since."""
    kept, added = [one for one in found if one.first], [one.verdict for one in found if not one.first]
    text = f"{count(one.verdict for one in kept)}; by the first rules {count(one.old_verdict or '' for one in kept)}"
    fitted = ", ".join(one.claim.number for one in kept if one.verdict == MET and _fitted_alone(one.claim))
    text += f"; of those met {fitted} by figures alone that the machines were fitted to" if fitted else ""
    return f"{text}; of claims added since {count(added)}" if added else text


def _fitted_alone(claim: Claim) -> bool:
    return all(figure.fitted for figure in claim.figures if not figure.kind)


def tally(found: Sequence[Judged]) -> dict[str, dict[str, int]]:
    """The same as numbers by verdict."""
    kept = [one for one in found if one.first]
    return {
        "rules": dict(Counter(one.verdict for one in kept)),
        "old_rules": dict(Counter(str(one.old_verdict) for one in kept)),
        "added": dict(Counter(one.verdict for one in found if not one.first)),
    }


def claims_blocks(found: Sequence[Judged], title: str = "Claims of the thesis") -> list[Block]:
    """A table of the claims with a count of the verdicts, and one of their figures."""
    from rotorsim.report.page import Block

    rows = [(one.claim.number, one.verdict, one.old_verdict or NO_RULE, one.claim.words, count(one.verdicts),
             one.claim.source) for one in found]  # fmt: skip
    text = (f"{counted(found)}. A claim is as good as the worst of its figures; trivial and not "
            "comparable ones count only where there is no other.")  # fmt: skip
    lines = [(f"{one.claim.number} {cells[0]}", *cells[1:]) for one in found for cells in _rows(one)]
    notes = [(one.claim.number, note) for one in found for note in remarks(one.claim)] + moves(found)
    return [
        Block(title, text, ("claim", "verdict", "by the first rules", "", "figures", "source"), rows),
        Block("Figure by figure", f"{count(v for one in found for v in one.verdicts)}. The intervals are those of the "
              "rules, which were written before the run; the last column has the first rule where it was amended.",
              HEADS, lines),
        Block("Remarks on the claims", "", ("claim", ""), notes),
    ]  # fmt: skip


def remarks(claim: Claim) -> list[str]:
    """Why these tolerances, what is one-sided, trivial or not comparable and why, and what else must be known."""
    found = [f"tolerance: {claim.why}"]
    for kind, name in (("one_sided", "one-sided"), ("because", "")):
        reasons = dict.fromkeys(getattr(figure, kind) for figure in claim.figures if getattr(figure, kind))
        for reason in reasons:
            which = [figure for figure in claim.figures if getattr(figure, kind) == reason]
            found.append(f"{name or which[0].kind}, {'; '.join(figure.words for figure in which)}: {reason}")
    if claim.amendment is not None:
        word = "added" if claim.added else "amended"
        reason = "" if claim.added else f": {claim.amendment.why}"
        found.append(f"{word} after lines {claim.amendment.lines} of the thesis{reason}; known before: "
                     f"{claim.amendment.seen}")  # fmt: skip
    if claim.moved is not None:
        found.append(f"measured on {claim.machine}")
    return [*found, claim.remark] if claim.remark else found


def moves(found: Sequence[Judged]) -> list[tuple[str, str]]:
    """Numbers of claims that are measured on another machine, and why there."""
    moved: dict[tuple[str, Amendment], list[str]] = {}
    for claim in (one.claim for one in found):
        if claim.moved is not None:
            moved.setdefault((claim.machine, claim.moved), []).append(claim.number)
    return [(", ".join(numbers), f"measured on {machine} after lines {why.lines} of the thesis: {why.why}; known "
             f"before: {why.seen}") for (machine, why), numbers in moved.items()]  # fmt: skip


def plain(found: Sequence[Judged]) -> dict[str, dict[str, Any]]:
    """Plain values for JSON, by claim."""
    return {
        one.claim.number: {
            "claim": one.claim.words, "source": one.claim.source, "verdict": one.verdict,
            "verdict_old_rules": one.old_verdict, "machine": one.claim.machine or None,
            "figures": [_plain_figure(one, f, value) | {"verdict": verdict} for f, value, verdict in _figures(one)],
            "figures_old_rules": [] if one.first is None else [
                _plain_figure(one, f, value) | {"verdict": verdict} for f, value, verdict in _figures(one.first)
            ],
        }
        for one in found
    }  # fmt: skip


def _plain_figure(one: Judged, f: ClaimFigure, value: float | None) -> dict[str, Any]:
    return {"name": f.name, "words": f.words, "unit": f.unit, "thesis": f.thesis, "thesis_model": _own(one.claim, f),
            "ours": value, MET: _plain(f.met), NEAR: _plain(f.near)}  # fmt: skip


def lines(found: Sequence[Judged]) -> list[str]:
    """A line for each claim with both verdicts, one for each figure that is not met, and the count."""
    text = [f"{'':4s} {'verdict':14s} {'first rules':14s}"]
    for one in found:
        text.append(f"{one.claim.number:4s} {one.verdict:14s} {one.old_verdict or NO_RULE:14s} {one.claim.words}")
        text += [f"     {f.words}: {number(value)} {f.unit} (thesis {number(f.thesis)})"
                 for f, value, verdict in _figures(one) if verdict in (NEAR, NOT_MET)]  # fmt: skip
    return [*text, counted(found)]


def markdown(found: Sequence[Judged]) -> str:
    """Claims with links, then a heading and the table of figures of each, as Markdown."""
    text = [f"{counted(found)}; by figure {count(v for one in found for v in one.verdicts)}.", ""]
    text += [overview(found), "", *(f"- {numbers}: {why}" for numbers, why in moves(found)), ""]
    for one in found:
        text += [f"### {heading(one)}", "", f"{one.claim.words} ({one.claim.source}).", "",
                 f"| {' | '.join(HEADS)} |", f"|{'---|' * len(HEADS)}"]  # fmt: skip
        text += [f"| {' | '.join(_escaped(cell) for cell in cells)} |" for cells in _rows(one)]
        text += ["", *(f"- {note}" for note in remarks(one.claim)), ""]
    return "\n".join(text)


def overview(found: Sequence[Judged]) -> str:
    """Claim, both verdicts and words as a Markdown table with links to the headings of `markdown`."""
    rows = [
        f"| [{one.claim.number}](#{heading(one).lower().replace(':', '').replace(' ', '-')}) | {one.verdict} | "
        f"{one.old_verdict or NO_RULE} | {_escaped(one.claim.words)} |"
        for one in found
    ]
    return "\n".join(["| claim | verdict | by the first rules | |", "|---|---|---|---|", *rows])


def heading(one: Judged) -> str:
    """Heading of a claim."""
    return f"{one.claim.number}: {one.verdict}"


def _escaped(words: str) -> str:
    """Words for a cell of a table, where a pipe would end it."""
    return words.replace("|", r"\|")


def number(value: float | None) -> str:
    """A number with four digits, or all before the point; a word where there is none."""
    if value is None or value != value:
        return "none"
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def _figures(one: Judged) -> list[tuple[ClaimFigure, float | None, str]]:
    return list(zip(one.claim.figures, one.values, one.verdicts, strict=True))


def _rows(one: Judged) -> list[tuple[str, ...]]:
    """Cells of each figure, in the order of HEADS."""
    return [
        (f.words, f"{number(f.thesis)} {f.unit}".strip() + (FITTED if f.fitted else ""), _own_words(one.claim, f),
         number(value), _interval(f.met), _interval(f.near), verdict, _first_rule(one, f))
        for f, value, verdict in _figures(one)
    ]  # fmt: skip


@lru_cache
def _printed() -> dict[str, dict[str, float]]:
    return printed_numbers()


def _own(claim: Claim, figure: ClaimFigure) -> float | None:
    """Figure of the thesis' printed model; None where it gives none."""
    return _printed().get(claim.number, {}).get(figure.old or figure.name)


def _own_words(claim: Claim, figure: ClaimFigure) -> str:
    """The same with its verdict by the rule, empty without."""
    value = _own(claim, figure)
    return "" if value is None else f"{number(value)} ({judge_figure(figure, value)})"


def _first_rule(one: Judged, figure: ClaimFigure) -> str:
    """Our number, intervals and verdict by the first rule where figure or machine were amended; empty where not."""
    if one.first is None or not (figure.old or one.claim.machine):
        return ""
    for f, value, verdict in _figures(one.first):
        if f.name == (figure.old or figure.name):
            what = "" if f.words == figure.words else f"{f.words}, thesis {number(f.thesis)}: "
            return f"{what}{number(value)}; {_interval(f.met)}, {_interval(f.near)}: {verdict}"
    return ""


def _interval(interval: Interval) -> str:
    low, high = interval
    return f"from {number(low)}" if isinf(high) else f"{number(low)} to {number(high)}"


def _plain(interval: Interval) -> list[float | None]:
    return [None if isinf(v) else v for v in interval]

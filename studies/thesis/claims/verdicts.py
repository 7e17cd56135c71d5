"""Verdict table of the claims as report sections, plain values, text lines and Markdown."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import isinf
from typing import TYPE_CHECKING, Any

from studies.thesis.claims.judge import MET, NEAR, NOT_MET, Judged, Numbers, count, judge
from studies.thesis.claims.rules import Claim, Figure, Interval, claims

if TYPE_CHECKING:
    from rotorsim.report.page import Block

FITTED = " (fitted)"
HEADS = ("figure", "thesis", "here", f"{MET} in", f"{NEAR} in", "verdict")


def verdicts(ours: Numbers, letters: str = "IC", left_out: Collection[str] = ()) -> list[Judged]:
    """Verdicts on the claims whose number begins with one of the letters.

    What `ours` does not hold is not run in the claims of `left_out`, and not met in all others.
    """
    return [judge(claim, ours.get(claim.number, {}), left_out) for claim in claims() if claim.number[0] in letters]


def claims_blocks(found: Sequence[Judged], title: str = "Claims of the thesis") -> list[Block]:
    """A table of the claims with a count of the verdicts, and one of their figures."""
    from rotorsim.report.page import Block

    rows = [(one.claim.number, one.verdict, one.claim.words, count(one.verdicts), one.claim.source) for one in found]
    text = (f"{count(one.verdict for one in found)}. A claim is as good as the worst of its figures; trivial and not "
            "comparable ones count only where there is no other.")  # fmt: skip
    lines = [(f"{one.claim.number} {f.words}", *_cells(f, value), verdict)
             for one in found for f, value, verdict in _figures(one)]  # fmt: skip
    notes = [(one.claim.number, note) for one in found for note in remarks(one.claim)]
    return [
        Block(title, text, ("claim", "verdict", "", "figures", "source"), rows),
        Block("Figure by figure", f"{count(v for one in found for v in one.verdicts)}. The intervals are those of the "
              "rules, which were written before the run.", HEADS, lines),
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
    return [*found, claim.remark] if claim.remark else found


def plain(found: Sequence[Judged]) -> list[dict[str, Any]]:
    """Plain values for JSON."""
    return [
        {
            "number": one.claim.number, "claim": one.claim.words, "source": one.claim.source, "verdict": one.verdict,
            "figures": [{"name": f.name, "words": f.words, "unit": f.unit, "thesis": f.thesis, "ours": value,
                         MET: _plain(f.met), NEAR: _plain(f.near), "verdict": verdict}
                        for f, value, verdict in _figures(one)],
        }
        for one in found
    ]  # fmt: skip


def lines(found: Sequence[Judged]) -> list[str]:
    """A line for each claim, one for each figure that is not met, and the count."""
    text = []
    for one in found:
        text.append(f"{one.claim.number:4s} {one.verdict:14s} {one.claim.words}")
        text += [f"     {f.words}: {number(value)} {f.unit} (thesis {number(f.thesis)})"
                 for f, value, verdict in _figures(one) if verdict in (NEAR, NOT_MET)]  # fmt: skip
    return [*text, count(one.verdict for one in found)]


def markdown(found: Sequence[Judged]) -> str:
    """Claims with links, then a heading and the table of figures of each, as Markdown."""
    text = [f"{count(one.verdict for one in found)}; by figure {count(v for one in found for v in one.verdicts)}.", ""]
    text += [overview(found), ""]
    for one in found:
        text += [f"### {heading(one)}", "", f"{one.claim.words} ({one.claim.source}).", "",
                 f"| {' | '.join(HEADS)} |", f"|{'---|' * len(HEADS)}"]  # fmt: skip
        text += [f"| {' | '.join((_escaped(f.words), *_cells(f, value), verdict))} |"
                 for f, value, verdict in _figures(one)]  # fmt: skip
        text += ["", *(f"- {note}" for note in remarks(one.claim)), ""]
    return "\n".join(text)


def overview(found: Sequence[Judged]) -> str:
    """Claim, verdict and words as a Markdown table with links to the headings of `markdown`."""
    rows = [
        f"| [{one.claim.number}](#{heading(one).lower().replace(':', '').replace(' ', '-')}) | {one.verdict} | "
        f"{_escaped(one.claim.words)} |"
        for one in found
    ]
    return "\n".join(["| claim | verdict | |", "|---|---|---|", *rows])


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


def _figures(one: Judged) -> list[tuple[Figure, float | None, str]]:
    return list(zip(one.claim.figures, one.values, one.verdicts, strict=True))


def _cells(figure: Figure, value: float | None) -> tuple[str, str, str, str]:
    thesis = f"{number(figure.thesis)} {figure.unit}".strip() + (FITTED if figure.fitted else "")
    return thesis, number(value), _interval(figure.met), _interval(figure.near)


def _interval(interval: Interval) -> str:
    low, high = interval
    return f"from {number(low)}" if isinf(high) else f"{number(low)} to {number(high)}"


def _plain(interval: Interval) -> list[float | None]:
    return [None if isinf(v) else v for v in interval]

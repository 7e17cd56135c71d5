"""Verdicts on figures and claims from the rules' intervals and the reproduced numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

from rotorsim.reproduction.claims.rules import Claim, Figure, Interval

MET, NEAR, NOT_MET = "met", "near", "not met"
TRIVIAL, NOT_COMPARABLE = "trivial", "not comparable"
VERDICTS = (MET, NEAR, NOT_MET, NOT_COMPARABLE, TRIVIAL)
Numbers = Mapping[str, Mapping[str, float]]
"""Ours, by claim and figure."""


@dataclass(frozen=True)
class Judged:
    """A claim with our values (None: there is none) and verdicts by figure, and its own verdict."""

    claim: Claim
    values: tuple[float | None, ...]
    verdicts: tuple[str, ...]
    verdict: str


def judge(claim: Claim, ours: Mapping[str, float]) -> Judged:
    """The verdict on a claim; a figure that `ours` does not hold is not met."""
    values = tuple(ours.get(figure.name) for figure in claim.figures)
    verdicts = tuple(judge_figure(f, v) for f, v in zip(claim.figures, values, strict=True))
    return Judged(claim, values, verdicts, judge_claim(verdicts))


def judge_figure(figure: Figure, value: float | None) -> str:
    """The verdict on a number, which is None where there is none."""
    if figure.kind == NOT_COMPARABLE:
        return NOT_COMPARABLE
    if value is None or not isfinite(value):
        return NOT_MET
    if _within(value, figure.met):
        return figure.kind or MET
    return NEAR if _within(value, figure.near) else NOT_MET


def judge_claim(verdicts: Sequence[str]) -> str:
    """The worst of the figures' verdicts; trivial and not comparable ones count where there is no other."""
    for verdict in (NOT_MET, NEAR, MET, NOT_COMPARABLE):
        if verdict in verdicts:
            return verdict
    return TRIVIAL


def count(verdicts: Iterable[str]) -> str:
    """How many of each verdict, as words."""
    listed = list(verdicts)
    return ", ".join(f"{listed.count(word)} {word}" for word in VERDICTS if word in listed)


def _within(value: float, interval: Interval) -> bool:
    return interval[0] <= value <= interval[1]

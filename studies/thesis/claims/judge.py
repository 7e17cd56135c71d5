"""Verdicts on figures and claims from the rules' intervals and the reproduced numbers."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

from studies.thesis.claims.rules import Claim, ClaimFigure, Interval

MET, NEAR, NOT_MET, NOT_RUN = "met", "near", "not met", "not run"
TRIVIAL, NOT_COMPARABLE = "trivial", "not comparable"
VERDICTS = (MET, NEAR, NOT_MET, NOT_RUN, NOT_COMPARABLE, TRIVIAL)
Numbers = Mapping[str, Mapping[str, float]]
"""Ours, by claim and figure."""


@dataclass(frozen=True)
class Judged:
    """A claim with our values (None: there is none) and verdicts by figure, and its own verdict.

    first: the same claim by the first rules; None where they have no such claim.
    """

    claim: Claim
    values: tuple[float | None, ...]
    verdicts: tuple[str, ...]
    verdict: str
    first: Judged | None = None

    @property
    def old_verdict(self) -> str | None:
        """The verdict by the first rules; None for a claim that they do not have."""
        return None if self.first is None else self.first.verdict


def judge(claim: Claim, ours: Mapping[str, float], left_out: Collection[str] = ()) -> Judged:
    """The verdict on a claim; a figure that `ours` does not hold is not met, in a claim of `left_out` not run."""
    values = tuple(ours.get(figure.name) for figure in claim.figures)
    none = NOT_RUN if claim.number in left_out else NOT_MET
    verdicts = tuple(judge_figure(f, v, none) for f, v in zip(claim.figures, values, strict=True))
    return Judged(claim, values, verdicts, judge_claim(verdicts))


def judge_figure(figure: ClaimFigure, value: float | None, none: str = NOT_MET) -> str:
    """The verdict on a number; `none` where it is None."""
    if figure.kind == NOT_COMPARABLE:
        return NOT_COMPARABLE
    if value is None:
        return none
    if not isfinite(value):
        return NOT_MET
    if _within(value, figure.met):
        return figure.kind or MET
    return NEAR if _within(value, figure.near) else NOT_MET


def judge_claim(verdicts: Sequence[str]) -> str:
    """The worst of the figures' verdicts; trivial and not comparable ones count where there is no other.

    Not run comes after not met: whatever a figure that was not run would be, a claim with one not met is not met.
    """
    for verdict in (NOT_MET, NOT_RUN, NEAR, MET, NOT_COMPARABLE):
        if verdict in verdicts:
            return verdict
    return TRIVIAL


def count(verdicts: Iterable[str]) -> str:
    """Number of claims by verdict, as words."""
    listed = list(verdicts)
    return ", ".join(f"{listed.count(word)} {word}" for word in VERDICTS if word in listed)


def _within(value: float, interval: Interval) -> bool:
    return interval[0] <= value <= interval[1]

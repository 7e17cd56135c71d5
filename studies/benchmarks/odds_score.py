r"""Trust in stated probabilities: Brier score, calibration error, reliability, coverage of intervals.

.. math:: B = \Big\langle \sum_k (p_k - r_k)^2 \Big\rangle, \qquad
          E = \sum_b \frac{n_b}{n} \, \big|\overline{r}_b - \overline{p}_b\big|

p_k is the probability of explanation k in a case and r_k is 1 for the hidden one; B is a mean over cases. E takes the
most probable explanation of every case, in bins b of its probability. Sources: Brier (1950); Naeini et al. (2015).

Cites: brier_1950, naeini_2015.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple, Protocol

import numpy as np
from scipy.special import erfinv

from rotorsim.discrepancy.candidates import class_of
from rotorsim.discrepancy.verdict import Explanation

EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99, 1.0)
"""Edges of the bins of probability; finer where most cases are."""
BEYOND_ALL = "beyond the catalogue"
"""Name of all explanations that hold something beyond the catalogue, where such a thing is hidden."""
LEAST = 1e-4
"""Probability below which an explanation is not kept."""


Odds = tuple[tuple[str, float, bool], ...]
"""Name, probability and whether it is the hidden one, of each explanation."""


class ScoredCase(Protocol):
    """Numbers of a case of the benchmark that are scored."""

    @property
    def kind(self) -> str: ...
    @property
    def verdict(self) -> str: ...
    @property
    def status(self) -> str: ...
    @property
    def ties(self) -> int: ...
    @property
    def odds(self) -> Odds: ...
    @property
    def apart(self) -> tuple[float, ...]: ...
    @property
    def calibrated(self) -> tuple[float, ...]: ...


class Bin(NamedTuple):
    """Cases whose most probable explanation has a probability in one bin: their mean, share that is right, number."""

    stated: float
    right: float
    cases: int


def scored(odds: Iterable[Explanation], kind: str, hidden: tuple[str, ...], known: set[str]) -> Odds:
    """Explanations of a case: name, probability, whether it is the hidden one.

    `known` are the keys of the whole catalogue. Where something beyond the candidates is hidden all explanations that
    hold such a thing are one; an effect that was left out and has a like among the candidates is not beyond them.
    """
    target = sorted({class_of(key, known) for key in hidden})
    odds, own_key = [*odds], tuple(sorted(hidden))
    alike = any(k.partition(".")[0] != key.partition(".")[0] for key in hidden for k in class_of(key, known))
    alike |= any(own_key in one.alike for one in odds)
    out_of_reach = kind == "foreign" or (kind == "left_out" and not alike)
    out, beyond = [], 0.0
    for one in odds:
        own = sorted({class_of(key, known) for key in one.effects})
        if out_of_reach and one.beyond:
            beyond += one.probability
        elif one.probability >= LEAST:
            same = own == target or own_key in one.alike
            out.append((one.name, one.probability, same and not one.beyond and not out_of_reach))
    return tuple([*out, (BEYOND_ALL, beyond, True)] if beyond else out)


def from_verdict(case: ScoredCase) -> Odds:
    """A verdict read as probabilities: certain where it is a name or nothing, even among the names of a tie."""
    right = case.verdict in ("right", "class")
    if case.status == "tie" and case.ties:
        share = 1 / (1 + case.ties)
        return tuple((f"{k}", share, right and k == 0) for k in range(1 + case.ties))
    return ((case.status, 1.0, right),)


def brier(rows: Iterable[Odds]) -> float:
    """Mean Brier score of cases; what is right and has no probability counts as 0."""
    scores = []
    for own in rows:
        found = any(right for _, _, right in own)
        scores.append(sum((p - right) ** 2 for _, p, right in own) + (not found))
    return float(np.mean(scores)) if scores else float("nan")


def reliability(found: Iterable[ScoredCase]) -> tuple[Bin, ...]:
    """Bins of the most probable explanations, the empty ones left out."""
    tops = [max(case.odds, key=lambda one: one[1]) for case in found if case.odds]
    p = np.array([one[1] for one in tops])
    right = np.array([one[2] for one in tops], float)
    at = np.clip(np.searchsorted(EDGES, p, side="right") - 1, 0, len(EDGES) - 2)
    return tuple(
        Bin(float(p[at == b].mean()), float(right[at == b].mean()), int((at == b).sum()))
        for b in range(len(EDGES) - 1) if (at == b).any()
    )  # fmt: skip


def calibration_error(bins: Iterable[Bin]) -> float:
    """Expected calibration error of bins."""
    rows = list(bins)
    total = sum(b.cases for b in rows)
    return sum(b.cases * abs(b.right - b.stated) for b in rows) / total if total else float("nan")


def coverage(found: Iterable[ScoredCase], share: float, of: str = "apart") -> float:
    """Share of hidden sizes ('apart') or 'calibrated' parameters within the interval of a probability `share`."""
    apart = np.array([z for case in found for z in getattr(case, of)])
    return float(np.mean(apart < np.sqrt(2) * erfinv(share))) if apart.size else float("nan")


def sure_and_wrong(found: Iterable[ScoredCase], kinds: tuple[str, ...], least: float = 0.95) -> int:
    """Cases of some kinds in which a wrong explanation that names an effect has more than a probability."""
    own = [one for case in found if case.kind in kinds for one in case.odds if one[1] > least and not one[2]]
    return sum(not name.startswith(("nothing", "something")) for name, _, _ in own)


def beyond_left_out(found: Iterable[ScoredCase]) -> Iterator[float]:
    """Probability of something beyond the catalogue, in cases whose effect was taken out of it.

    Without those that a candidate is indistinguishable from, in which nothing is beyond it.
    """
    for case in found:
        beyond = [p for name, p, _ in case.odds if name == BEYOND_ALL]
        if case.kind == "left_out" and beyond:
            yield sum(beyond)

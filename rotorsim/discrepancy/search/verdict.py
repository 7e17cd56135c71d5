"""Verdict of a search: named, tie, partial or unknown; named only for at least 95 % of the flagged misfit.

An explanation is confirmed by records that took no part in the search. The gap there is that of the line groups beyond
their floor, before or with the effect, the floor's own part subtracted. In the few cases known when the border was
chosen, halfway, right names took 97 to 100 % of the whole gap (69 % in records resampled by hand) and wrong ones 0 to
20 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf, sqrt

import numpy as np

from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.residuals.misfit import Misfit, flagged, table
from rotorsim.discrepancy.search.candidates import alike_by_weight, class_of
from rotorsim.discrepancy.search.hypotheses import (
    CLEAR,
    ENOUGH,
    TIE,
    EffectSearch,
    Hypothesis,
    passes,
    share_gone,
    within_form_error,
)

MOST_EFFECTS = 3
"""Most effects that are named together."""
MORE = 100.0
"""Flagged excess that explanations may leave before an additional effect is searched for."""
TIE_LEAST = 16.0
"""Difference of two rivals' sums of squares below which they are always tied."""
A_FIFTH = 0.2
"""Share of the flagged excess that a partial explanation takes at least."""
ANOTHER = 0.05
"""Share of the flagged misfit that a further effect must take."""
STATUSES = ("no_disagreement", "named", "tie", "partial", "unknown")
"""Verdicts of a search."""
LEAST_GONE = {"named": 0.5, "tie": 0.5, "partial": 0.1}
"""Share of the gap on untouched records that has to go, by verdict."""


@dataclass(frozen=True, eq=False)
class SearchVerdict:
    """Status, best hypothesis, rivals, and all fitted hypotheses."""

    status: str
    best: Hypothesis | None = None
    rivals: tuple[Hypothesis, ...] = ()
    classes: tuple[tuple[str, ...], ...] = ()
    tried: tuple[Hypothesis, ...] = field(default=(), repr=False)

    @property
    def fitted(self) -> tuple[Hypothesis, ...]:
        """All hypotheses that were fitted, with rivals and the best one as they were fitted last."""
        return (*self.tried, *self.rivals, *((self.best,) if self.best else ()))


def judge(search: EffectSearch) -> SearchVerdict:
    """Search single effects, then pairs, then triples until one explains the flagged misfit; singles if unflagged."""
    known = {f.key for f in search.forms}
    tried: list[Hypothesis] = []
    for size in range(1, (MOST_EFFECTS if search.base_excess > 0 else 1) + 1):
        found = search.best_singles() if size == 1 else search.sets(size)
        tried += found
        good = [h for h in found if passes(h, search) and not _needless(h, tried)]
        if good:
            return _accepted(search, good[0], found, known, tried)
        if size > 1 and not _worth_more(tried, size):
            break
    return _short_of_a_name(search, tried, known)


def _needless(h: Hypothesis, tried: list[Hypothesis]) -> bool:
    """Whether some of its effects alone fit the records as well as all of a hypothesis' do."""
    return any(set(s.keys) < set(h.keys) and s.fit.cost < h.fit.cost + CLEAR for s in tried)


def _worth_more(tried: list[Hypothesis], size: int) -> bool:
    """Whether larger sets explained clearly more than smaller ones, so that still larger ones may be worth trying."""
    best = {s: max((h.gone for h in tried if len(h.forms) == s), default=0.0) for s in (size - 1, size)}
    return best[size] > best[size - 1] + ANOTHER and best[size] > 0.5


def _accepted(
    search: EffectSearch, best: Hypothesis, found: list[Hypothesis], known: set[str], tried: list[Hypothesis]
) -> SearchVerdict:
    if len(best.forms) > 1:
        best = without_idle(best, search)
    best = search.polished(best)
    if len(best.forms) > 1 and not search.is_sure(best, best.forms):
        return _short_of_a_name(search, tried, known)
    rivals = tied(best, found, search.base)
    while len(best.forms) < MOST_EFFECTS and best.excess - search.unsteady > MORE:
        extended = _extended(search, best, tried)
        if not extended:
            break
        best, *others = extended
        rivals += others
    rivals = [h for h in rivals if len(h.forms) <= len(best.forms) and not set(h.keys) < set(best.keys)]
    classes = tuple(_class_at(search, best, k, known) for k in best.keys)
    rivals = [h for h in rivals if not _same(h, best, known)]
    several = any(len(c) > 1 for c in classes) or bool(rivals)
    return SearchVerdict("tie" if several else "named", best, tuple(rivals), classes, tuple(tried))


def _extended(search: EffectSearch, best: Hypothesis, tried: list[Hypothesis]) -> list[Hypothesis]:
    """The best hypothesis extended by an effect that explains what it leaves, and what is tied with that."""
    if within_form_error(search.comparison, search.base.residual, best.fit.residual):
        return []
    onward = search.onward(best)
    found = onward.singles()
    good = [h for h in found if passes(h, onward)]
    if not good:
        return []
    first = onward.polished(good[0])
    joined = [_joined(search, best, h) for h in (first, *tied(first, found, onward.base))]
    joined = [h for h in joined if not search.cancels(h) and search.is_sure(h, h.forms[len(best.forms) :])]
    tried += joined
    return joined


def _joined(search: EffectSearch, best: Hypothesis, h: Hypothesis) -> Hypothesis:
    """Hypothesis with the forms of both."""
    left = h.excess + search.unsteady
    return replace(h, forms=(*best.forms, *h.forms), excess=left, gone=share_gone(left, search.base_excess))


def _class_at(search: EffectSearch, h: Hypothesis, key: str, known: set[str]) -> tuple[str, ...]:
    """The class of an effect of a hypothesis, with those that the weight of the rotor makes alike."""
    twin = search.comparison.twin
    alike = class_of(key, known)
    if any(e.acceleration > 0 for e in twin.machine.effects.get("gravity", ())):  # type: ignore[attr-defined]
        effect, table = next(f for f in h.forms if f.key == key).parameters[0].key.split(".")[:2]
        own = h.fit.point.setting(twin)
        found = vars(twin.effect(effect, int(table))) | {
            path.rpartition(".")[2]: value for path, value in own.items() if path.startswith(f"{effect}.{table}.")
        }
        alike = (*alike, *alike_by_weight(key, found, known))
    return tuple(sorted(set(alike)))


def _same(a: Hypothesis, b: Hypothesis, known: set[str]) -> bool:
    """Whether two hypotheses are of the same classes."""
    return [class_of(k, known) for k in a.keys] == [class_of(k, known) for k in b.keys]


def _short_of_a_name(search: EffectSearch, tried: list[Hypothesis], known: set[str]) -> SearchVerdict:
    helps = [
        h
        for h in tried
        if not h.failed and h.gone >= A_FIFTH and (search.held_out is None or h.held_out < 0.8 * search.base_held)
    ]
    helps = [h for h in helps if len(h.forms) == 1 or search.is_sure(h, h.forms)]
    if not helps:
        return SearchVerdict("unknown", None, (), (), tuple(tried))
    best = min(helps, key=lambda h: h.score)
    simpler = [h for h in helps if set(h.keys) < set(best.keys) and h.gone > best.gone - ANOTHER]
    best = min(simpler, key=lambda h: (len(h.forms), h.score)) if simpler else best
    rivals = tied(best, [h for h in helps if len(h.forms) == len(best.forms)], search.base)
    return SearchVerdict("partial", best, tuple(rivals), tuple(class_of(k, known) for k in best.keys), tuple(tried))


def untouched_gone(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> float | None:
    """Share of the gap that goes from one whitened residual (n,) to another; None if no group is beyond its floor.

    Negative where the gap grows, minus infinity where there was none.
    """
    tables = [table(comparison, residual) for residual in (before, after)]
    beyond = {_place(f) for groups in tables for f in flagged(groups)}
    if not beyond:
        return None
    old, new = (max(sum(_power(f) for f in groups if _place(f) in beyond), 0.0) for groups in tables)
    return 1 - sqrt(new / old) if old > 0 else -inf


def objection(status: str, names: str, gone: float | None) -> str:
    """Sentence that refuses a verdict for the share of the untouched gap that goes; empty where nothing does."""
    if gone is None or gone >= LEAST_GONE.get(status, -inf):
        return ""
    found = f"only {100 * gone:.0f} % of the gap goes" if gone > 0 else "the gap does not get smaller"
    return f"with {names} {found} on untouched records: not confirmed, nothing is named"


def _place(flag: Misfit) -> tuple[int, str, str]:
    return flag.number, flag.channel, flag.group


def _power(flag: Misfit) -> float:
    """Sum of squares [m^2] of a group beyond its floor."""
    return flag.numbers * (flag.rms**2 - flag.floor**2)


def tied(best: Hypothesis, others: Sequence[Hypothesis], base: ParameterFit) -> list[Hypothesis]:
    """Hypotheses that the records cannot distinguish from the best one."""
    margin = max(TIE_LEAST, TIE * (base.cost - best.fit.cost))
    return [h for h in others if h is not best and h.fit.cost - best.fit.cost < margin and h.gone >= 0.8]


def without_idle(h: Hypothesis, search: EffectSearch) -> Hypothesis:
    """Backward elimination of forms without which the others explain as much."""
    while len(h.forms) > 1:
        smaller = []
        view = search.screened()
        for i in range(len(h.forms)):
            rest = tuple(f for k, f in enumerate(h.forms) if k != i)
            drop, start = view.drop(*(search.forms.index(f) for f in rest))
            if drop > 0:
                smaller.append(search.hypothesis(rest, start))
        best = min(smaller, key=lambda s: s.score, default=None)
        if best is None or best.score > h.score + 10 or (h.gone >= ENOUGH > best.gone):
            return h
        h = best
    return h

"""Verdict of a search: named, tie, partial or unknown; named only for at least 95 % of the flagged misfit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from rotorsim.discrepancy.fit.parameters import contributions, setting
from rotorsim.discrepancy.search.indistinguishable import alike_by_weight, class_of
from rotorsim.discrepancy.search.search import (
    A_FIFTH,
    CLEAR,
    MORE,
    MOST_EFFECTS,
    EffectSearch,
    Hypothesis,
    passes,
    share_gone,
    tied,
    without_idle,
)
from rotorsim.discrepancy.search.second_effect import within_form_error

ANOTHER = 0.05
"""Share of the flagged misfit that a further effect must take."""
STATUSES = ("no_disagreement", "named", "tie", "partial", "unknown")


@dataclass(frozen=True, eq=False)
class SearchVerdict:
    """Status, best hypothesis, rivals, and all fitted hypotheses."""

    status: str
    best: Hypothesis | None = None
    rivals: tuple[Hypothesis, ...] = ()
    classes: tuple[tuple[str, ...], ...] = ()
    tried: tuple[Hypothesis, ...] = field(default=(), repr=False)


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
        own = setting(twin, contributions(h.fit.point.values, 0.0, 0.0), h.fit.point.fixed)
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

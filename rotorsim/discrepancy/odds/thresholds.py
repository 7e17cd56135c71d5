"""Verdict by thresholds on the odds, among the explanations that the search has accepted.

A name or a tie of the search is named where one explanation has `SURE`, a tie where several share it, and partial where
something beyond the catalogue is more likely than not. A partial explanation is the most probable one that helps. Where
the search knows nothing, or not enough, `no_disagreement` follows if nothing missing has `SURE`: what is flagged is
within the model's inferred form error then.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from rotorsim.discrepancy.odds.explanation import SURE, Explanation
from rotorsim.discrepancy.search.indistinguishable import class_of
from rotorsim.discrepancy.search.search import A_FIFTH, Hypothesis
from rotorsim.discrepancy.search.verdict import SearchVerdict

RIVAL = 0.01
"""Probability from which an explanation is a rival of a tie."""
LIKELY = 0.5
"""Probability of something beyond the catalogue from which no name is given."""


def by_odds(verdict: SearchVerdict, odds: Sequence[Explanation], known: Iterable[str]) -> SearchVerdict:
    """The verdict of a search as the odds have it; unchanged where there are none."""
    if not odds:
        return verdict
    beyond = sum(e.probability for e in odds if e.beyond)
    if verdict.status in ("named", "tie") and verdict.best is not None:
        return _partial(verdict) if beyond > LIKELY else _of_names(verdict, verdict.best, odds, set(known))
    nothing = sum(e.probability for e in odds if not e.effects and not e.beyond)
    if verdict.status in ("unknown", "partial") and nothing >= SURE:
        return replace(verdict, status="no_disagreement", best=None, rivals=(), classes=())
    return _most_probable_part(verdict, odds, set(known)) if verdict.status == "partial" else verdict


def _partial(verdict: SearchVerdict) -> SearchVerdict:
    return replace(verdict, status="partial", rivals=())


def _most_probable_part(verdict: SearchVerdict, odds: Sequence[Explanation], known: set[str]) -> SearchVerdict:
    """A partial explanation by the effects that are most probable, with something beyond the catalogue or without."""
    first = max((e for e in odds if e.effects), key=lambda e: e.probability, default=None)
    own = () if first is None else (first.effects, *first.alike)
    helps = [h for h in verdict.tried if h.keys in own and not h.failed and h.gone >= A_FIFTH]
    if not helps:
        return verdict
    best = min(helps, key=lambda h: h.fit.cost)
    return replace(verdict, best=best, rivals=(), classes=tuple(class_of(key, known) for key in best.keys))


def _of_names(verdict: SearchVerdict, best: Hypothesis, odds: Sequence[Explanation], known: set[str]) -> SearchVerdict:
    """A name or a tie of the hypotheses that the search has accepted."""
    accepted = sorted((best, *verdict.rivals), key=lambda h: -probability_of(h.keys, odds))
    first, p = accepted[0], probability_of(accepted[0].keys, odds)
    others = [h for h in accepted[1:] if p < SURE and probability_of(h.keys, odds) >= RIVAL]
    classes = verdict.classes if first is best else tuple(class_of(key, known) for key in first.keys)
    several = any(len(own) > 1 for own in classes) or bool(others) or p < SURE
    return replace(verdict, status="tie" if several else "named", best=first, rivals=tuple(others), classes=classes)


def joined_classes(odds: Sequence[Explanation], verdict: SearchVerdict) -> tuple[Explanation, ...]:
    """The odds with the members of the found effects' classes as one: some are known once the size is found."""
    if verdict.best is None:
        return tuple(odds)
    own, key_sets = verdict.best.keys, [set(c) for c in verdict.classes]

    def same(e: Explanation) -> bool:
        pairs = zip(e.effects, key_sets, strict=False)
        return not e.beyond and len(e.effects) == len(key_sets) and all(key in c for key, c in pairs)

    members = [e for e in odds if same(e)]
    if len(members) < 2:
        return tuple(odds)
    first = next((e for e in members if own in (e.effects, *e.alike)), members[0])
    alike = tuple(keys for e in members for keys in (e.effects, *e.alike) if keys != first.effects)
    one = replace(first, probability=sum(e.probability for e in members), alike=alike)
    rest = [e for e in odds if e not in members]
    return tuple(sorted((one, *rest), key=lambda e: (-e.probability, e.name)))


def probability_of(keys: tuple[str, ...], odds: Sequence[Explanation]) -> float:
    """Probability of an explanation by its effects, as one of a class or alone."""
    return next((e.probability for e in odds if not e.beyond and keys in (e.effects, *e.alike)), 0.0)

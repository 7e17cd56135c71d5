r"""Odds of a diagnosis: probability of every explanation, and the verdict that follows from them.

.. math:: P_k \propto p_k\, Z_k

p_k are the prior probabilities stated here; Z_k is the evidence of explanation k with a likelihood to the power 1/T.
Where it was re-fitted with the plant the evidence is taken there, otherwise from the sensitivities at the re-calibrated
point. The temperature T makes up for what the evidence takes for certain (independent lines, the tangent); it is fitted
on hidden cases, not derived. An effect whose size the records do not narrow down cannot be distinguished from nothing,
and is counted with it.

A name or a tie of the search is named where one explanation has `SURE`, a tie where several share it, and partial where
something beyond the catalogue is more likely than not. A partial explanation is the most probable one that helps. Where
the search has no name, or too little, `no_disagreement` follows if nothing missing has `SURE`: all that is flagged is
within the model's inferred form error then.

Cites: mackay_2003, kennedy_2001.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np

from rotorsim.discrepancy.evidence import (
    ModelForm,
    likely_sizes,
    log_evidence,
    model_form,
    one_sided,
    prior_sizes,
    settled,
    unexplained_gain,
    whitened_size,
)
from rotorsim.discrepancy.explanation import NOTHING, SURE, Explanation
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.search.candidates import class_of
from rotorsim.discrepancy.search.hypotheses import EffectSearch, Hypothesis
from rotorsim.discrepancy.search.verdict import A_FIFTH, SearchVerdict

TEMPERATURE = 4.0
"""T of the formula above. With it and `ELSE` 35 hidden cases for tuning had a Brier score of .02, with 1 one of .10."""
PRIORS = {0: 0.40, 1: 0.40, 2: 0.12, 3: 0.03}
"""Prior probability by number of missing effects, shared evenly by their combinations."""
ELSE = 0.05
"""Prior probability of something that is not in the catalogue."""
LESS_EXACT = 10.0
"""Error of an effect's form over that of the whole model: where a response is within 1 %, a crack's or a rub's is
within 10 %."""
NARROWED = 0.3
"""Standard deviation of a size, over the prior one, from which on the records do not show it."""
RIVAL = 0.01
"""Probability from which an explanation is a rival of a tie."""
LIKELY = 0.5
"""Probability of something beyond the catalogue from which no name is given."""


def explanation_odds(
    comparison: TwinComparison,
    base: ParameterFit,
    search: EffectSearch | None,
    tried: Iterable[Hypothesis],
    unsteady: float = 0.0,
    temperature: float = TEMPERATURE,
) -> tuple[Explanation, ...]:
    """Explanations by falling probability; those that no record distinguishes are one.

    `tried` are those re-fitted with the plant; `unsteady` is the excess sum of squares of what does not repeat from
    period to period, which no effect of the catalogue takes away.
    """
    whole = whitened_size(comparison.layout, comparison.predict(base.point), comparison.sigma)
    form = model_form(comparison.layout, comparison.trials, whole)
    rest = BeyondCatalogue(_line_numbers(comparison), unsteady, temperature)
    none, *unknown = _of_fit(form, base, (), rest)
    known = {f.key for f in search.forms} if search is not None else set()
    fitted = {h.keys: h for h in sorted(tried, key=lambda h: -h.fit.cost) if h.forms and not h.failed}
    found: list[Explanation] = []
    for keys, h in fitted.items():
        own = whitened_size(comparison.layout, base.residual - h.fit.residual, np.ones(len(whole)))
        wider = model_form(comparison.layout, comparison.trials, whole + LESS_EXACT * own)
        found += _of_fit(wider, h.fit, keys, rest)
    linear = _linear(form, base, search, {e.effects for e in found}, temperature) if search is not None else []
    everything = [none, *unknown, *found, *linear]
    logs = np.array([np.log(_prior(e, len(known))) + e.evidence - none.evidence for e in everything])
    p = np.exp(logs - logs.max())
    p /= p.sum()
    judged = [
        replace(e, probability=float(x), evidence=e.evidence - none.evidence)
        for e, x in zip(everything, p, strict=True)
    ]
    return _merged(judged, known)


@dataclass(frozen=True, eq=False)
class BeyondCatalogue:
    """Signs of something beyond the catalogue: line numbers (n,), excess that does not repeat, temperature."""

    lines: np.ndarray
    unsteady: float
    temperature: float


def _of_fit(form: ModelForm, fit: ParameterFit, keys: tuple[str, ...], rest: BeyondCatalogue) -> list[Explanation]:
    """A fitted explanation, and the same with something else on top of it."""
    origin, sd = fit.residual + fit.J @ fit.vector, prior_sizes(fit.parameters, fit.vector)
    found = log_evidence(form, origin, fit.J, sd, rest.temperature)
    value = found.log + one_sided(found, fit.parameters)
    left = settled(form, origin, fit.J, sd, found)
    more = unexplained_gain(left, rest.lines, rest.temperature) + 0.5 * rest.unsteady / rest.temperature
    return [
        Explanation(keys, False, value, found.error, True),
        Explanation(keys, True, value + more, found.error, True),
    ]


def _linear(
    form: ModelForm, base: ParameterFit, search: EffectSearch, done: set[tuple[str, ...]], temperature: float
) -> list[Explanation]:
    """Single effects that were not re-fitted, by their sensitivities; of an effect and its options the mean."""
    origin = base.residual + base.J @ base.vector
    values: dict[str, list[tuple[float, float, bool]]] = {}
    for one in search.forms:
        if (one.key,) in done:
            continue
        J, parameters = np.concatenate([base.J, search.columns[one.label]], axis=1), (*base.parameters, *one.parameters)
        sd = prior_sizes(parameters, likely_sizes(origin, J, parameters))
        found = log_evidence(form, origin, J, sd, temperature)
        narrowed = float(found.sd[len(base.parameters) :].min()) < NARROWED
        values.setdefault(one.key, []).append((found.log + one_sided(found, parameters), found.error, narrowed))
    return [
        Explanation((key,), False, *_mean([(z, error) for z, error, _ in found]), False,
                    shown=any(narrowed for *_, narrowed in found))
        for key, found in values.items()
    ]  # fmt: skip


def _mean(found: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Logarithm of the mean evidence, and the error of the best one."""
    top, error = max(found)
    return top + float(np.log(np.mean(np.exp(np.array([z for z, _ in found]) - top)))), error


def _prior(e: Explanation, forms: int) -> float:
    if e.beyond and not e.effects:
        return ELSE
    size = len(e.effects)
    return PRIORS[size] / max(comb(forms, size), 1) * (ELSE if e.beyond else 1.0)


def _line_numbers(comparison: TwinComparison) -> np.ndarray:
    """Number (n,) of the line of a record's channel that each value is of; real and imaginary part are of one."""
    layout = comparison.layout
    parts = np.stack([layout.record, layout.channel, np.round(1e3 * layout.frequency), layout.drift])
    return np.unique(parts, axis=1, return_inverse=True)[1].ravel()


def _merged(found: list[Explanation], known: set[str]) -> tuple[Explanation, ...]:
    """Explanations of the same classes as one, the most probable first; those not shown with nothing missing."""
    classes: dict[tuple[object, ...], list[Explanation]] = {}
    for e in sorted(found, key=lambda e: (-e.probability, e.name)):
        classes.setdefault((e.shown, e.beyond, *sorted(class_of(k, known) for k in e.effects)), []).append(e)
    joined = [_as_one(own) for own in classes.values()]
    unseen = tuple(e for e in joined if not e.shown)
    out = [_with_unseen(e, unseen) if e.name == NOTHING else e for e in joined if e.shown]
    return tuple(sorted(out, key=lambda e: (-e.probability, e.name)))


def _as_one(own: list[Explanation]) -> Explanation:
    """Explanations of one class as one, named after the most probable."""
    first, *others = own
    return replace(first, probability=sum(e.probability for e in own), alike=tuple(e.effects for e in others))


def _with_unseen(nothing: Explanation, unseen: tuple[Explanation, ...]) -> Explanation:
    """Nothing missing together with what the records do not show."""
    probability = nothing.probability + sum(e.probability for e in unseen)
    return replace(nothing, probability=probability, unseen=unseen)


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
    """Odds with the members of each identified effect's class as one; some classes follow from the size."""
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

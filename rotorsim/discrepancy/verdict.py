r"""Verdict of a search, and the odds of all explanations; the judge (`judge`) makes the verdict of a diagnosis of both.

The search names an effect for at least 95 % of the flagged misfit only.

.. math:: P_k \propto p_k\, Z_k

p_k are the prior probabilities stated here; Z_k is the evidence of explanation k with a likelihood to the power 1/T.
Where it was re-fitted with the plant the evidence is taken there, otherwise from the sensitivities at the re-calibrated
point. The temperature T makes up for what the evidence takes for certain (independent lines, the tangent); it is fitted
on hidden cases, not derived. An effect whose size the records do not narrow down cannot be distinguished from nothing,
and is counted with it.

Cites: mackay_2003, kennedy_2001.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations, product
from math import comb

import numpy as np
from scipy.special import softmax

from rotorsim.discrepancy.candidates import alike_by_weight, class_of, counterpart
from rotorsim.discrepancy.comparison import TwinComparison
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
from rotorsim.discrepancy.fit import ParameterFit, covariance, strained
from rotorsim.discrepancy.hypotheses import (
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
BEYOND = "something that is not in the catalogue"
NOTHING = "nothing is missing"
NOT_IN_CATALOGUE = "not in the catalogue"
"""Name of all explanations together that hold something which is not in the catalogue."""
SURE = 0.95
"""Probability from which an explanation is settled."""
MOST_LISTED = 6
"""Effects that a sentence lists at most."""
MOST_BY_MORE = 0.94
"""Most probability that more points give an effect: below `SURE`, so that they settle nothing, as printed too."""
LEAST_SHOWN = 1e-3
"""Probability below which an explanation is not listed."""
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
    """Search single effects, then pairs, then triples until one explains the flagged misfit; singles if unflagged.

    Where less than `A_FIFTH` of the misfit repeats none can be named, nor help: single effects next to the calibration
    are fitted all the same, as rivals of a law and for the odds.
    """
    known = {f.key for f in search.forms}
    tried: list[Hypothesis] = []
    flagged, hopeless = search.base_excess > 0, search.most_gone < A_FIFTH
    for size in range(1, (MOST_EFFECTS if flagged and not hopeless else 1) + 1):
        found = search.singles() if hopeless else search.best_singles() if size == 1 else search.best_sets(size)
        tried += found
        # not where some of its effects alone fit the records as well
        good = [
            h
            for h in found
            if passes(h, search)
            and not any(set(s.keys) < set(h.keys) and s.fit.cost < h.fit.cost + CLEAR for s in tried)
        ]
        if good:
            return _accepted(search, preferred(good[0], good, search.base, known), found, known, tried)
        if size > 1 and not _worth_more(tried, size):
            break
    return _short_of_a_name(search, tried, known)


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
    own = [class_of(k, known) for k in best.keys]
    rivals = [h for h in rivals if [class_of(k, known) for k in h.keys] != own]
    several = any(len(c) > 1 for c in classes) or bool(rivals)
    return SearchVerdict("tie" if several else "named", best, tuple(rivals), classes, tuple(tried))


def _extended(search: EffectSearch, best: Hypothesis, tried: list[Hypothesis]) -> list[Hypothesis]:
    """The best hypothesis extended by an effect that explains what it leaves, and what is tied with that."""
    if within_form_error(search.comparison, search.base.residual, best.fit.residual):
        return []
    onward = search.onward(best)
    found = onward.best_singles()
    good = [h for h in found if passes(h, onward)]
    if not good:
        return []
    first = onward.polished(preferred(good[0], good, onward.base, {f.key for f in search.forms}))
    joined = [
        replace(h, forms=(*best.forms, *h.forms), excess=left, gone=share_gone(left, search.base_excess))
        for h in (first, *tied(first, found, onward.base))
        for left in (h.excess + search.unsteady,)
    ]
    joined = [h for h in joined if not search.cancels(h) and search.is_sure(h, h.forms[len(best.forms) :])]
    tried += joined
    return joined


def _class_at(search: EffectSearch, h: Hypothesis, key: str, known: set[str]) -> tuple[str, ...]:
    """The class of an effect of a hypothesis, with those that the weight of the rotor makes alike.

    Its counterpart is one of them where it was left out of the candidates; a candidate has a fit of its own.
    """
    twin = search.comparison.twin
    alike = (*class_of(key, known), *_counterpart(search, h, key, known))
    if any(e.acceleration > 0 for e in twin.machine.effects.get("gravity", ())):  # type: ignore[attr-defined]
        effect, table = next(f for f in h.forms if f.key == key).parameters[0].key.split(".")[:2]
        own = h.fit.point.setting(twin)
        found = vars(twin.effect(effect, int(table))) | {
            path.rpartition(".")[2]: value for path, value in own.items() if path.startswith(f"{effect}.{table}.")
        }
        alike = (*alike, *alike_by_weight(key, found, known))
    return tuple(sorted(set(alike)))


def _counterpart(search: EffectSearch, h: Hypothesis, key: str, known: set[str]) -> tuple[str, ...]:
    """The form, left out of the candidates, whose force an effect of a hypothesis nearly makes.

    Its size has to be within two standard deviations of those that both have. A shape of both has to explain the
    records as well: a standard deviation does not tell where the records hardly narrow it.
    """
    found = counterpart(key)
    if found is None or found[0] in known:
        return ()
    other, parameter, low, high = found
    first = next(f for f in h.forms if f.key == key).parameters[0].key
    path = f"{first.rpartition('.')[0]}.{parameter}"
    value = h.fit.point.setting(search.comparison.twin)[path]
    nearest = float(np.clip(value, low, high))
    if path == first:
        i = [k.key for k in h.fit.parameters].index(path)
        sd = float(np.sqrt(covariance(h.fit, search.comparison.layout.record)[i, i]))
        return (other,) if abs(value - nearest) <= 2 * sd else ()
    wanted = h.fit.cost + tie_margin(h, search.base)
    return (other,) if nearest == value or search.with_shape(h, path, nearest, wanted).fit.cost < wanted else ()


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
    best = preferred(best, helps, search.base, known)
    rivals = tied(best, [h for h in helps if len(h.forms) == len(best.forms)], search.base)
    return SearchVerdict("partial", best, tuple(rivals), tuple(class_of(k, known) for k in best.keys), tuple(tried))


def tied(best: Hypothesis, others: Sequence[Hypothesis], base: ParameterFit) -> list[Hypothesis]:
    """Hypotheses that the records cannot distinguish from the best one."""
    near = as_near(best, others, base)
    return [h for h in near if h is not best and h.gone >= 0.8]


def as_near(best: Hypothesis, others: Iterable[Hypothesis], base: ParameterFit) -> list[Hypothesis]:
    """Hypotheses whose sums of squares are within a tie of that of the best one."""
    margin = tie_margin(best, base)
    return [h for h in others if h.fit.cost - best.fit.cost < margin]


def tie_margin(best: Hypothesis, base: ParameterFit) -> float:
    """Difference of sums of squares within which records do not distinguish another hypothesis from the best one."""
    return max(TIE_LEAST, TIE * (base.cost - best.fit.cost))


def preferred(best: Hypothesis, others: Iterable[Hypothesis], base: ParameterFit, known: Iterable[str]) -> Hypothesis:
    """The member of a hypothesis' class, among those within a tie, that asks least of the machine.

    It has the fewest calibrated numbers that are not believed, then leaves least at held-out points. The records do not
    distinguish members of a class, and sums of squares within a tie do not choose: that an effect needs a number which
    is not believed speaks against it.
    """
    alike = [h for h in as_near(best, others, base) if not h.failed and _classes(h, known) == _classes(best, known)]
    return min([best, *alike], key=lambda h: (len(strained(h.fit)), h.held_out, h.fit.cost))


def _classes(h: Hypothesis, known: Iterable[str]) -> list[tuple[str, ...]]:
    """Classes of the effects of a hypothesis, sorted."""
    return sorted(class_of(key, known) for key in h.keys)


def one_of_each_class(verdict: SearchVerdict, base: ParameterFit, known: Iterable[str]) -> SearchVerdict:
    """The verdict with, of all that was tried, only the preferred members of their classes."""
    best: dict[tuple[tuple[str, ...], ...], Hypothesis] = {}
    able = [h for h in verdict.tried if not h.failed]
    for h in sorted(able, key=lambda h: h.fit.cost):
        best.setdefault(tuple(_classes(h, known)), h)
    return replace(verdict, tried=tuple(preferred(h, able, base, known) for h in best.values()))


def without_idle(h: Hypothesis, search: EffectSearch) -> Hypothesis:
    """Backward elimination of forms without which the others explain as much."""
    while len(h.forms) > 1:
        rests = [tuple(f for k, f in enumerate(h.forms) if k != i) for i in range(len(h.forms))]
        smaller = [found for rest in rests for found in search.refitted(rest)]
        best = min(smaller, key=lambda s: s.score, default=None)
        if best is None or best.score > h.score + 10 or (h.gone >= ENOUGH > best.gone):
            return h
        h = best
    return h


@dataclass(frozen=True)
class Explanation:
    """Set of effects that may be missing, with its probability.

    effects : keys of forms, none where nothing of the catalogue is missing
    beyond : whether something that is not in the catalogue is missing as well
    alike : explanations that no record distinguishes from it; their probabilities are in this one
    evidence : logarithm, above that of nothing missing
    error : relative error of the model's form that it leaves, most probable value
    shown : whether the records narrow its size down; otherwise it cannot be distinguished from nothing
    refitted : whether the plant was fitted with it; otherwise by the sensitivities alone
    unseen : explanations that are counted with it because these records do not show them; other records may
    """

    effects: tuple[str, ...]
    beyond: bool
    evidence: float
    error: float
    refitted: bool
    probability: float = 0.0
    alike: tuple[tuple[str, ...], ...] = ()
    shown: bool = True
    unseen: tuple[Explanation, ...] = ()

    @property
    def shown_probability(self) -> float:
        """Probability without that of the effects that the records do not show."""
        return self.probability - sum(e.probability for e in self.unseen)

    @property
    def unseen_sentence(self) -> str:
        """Sentence on the effects that the records do not show, with their probability; empty for none."""
        if not self.unseen:
            return ""
        names = [e.name for e in self.unseen]
        more = f" and {len(names) - MOST_LISTED} others" if len(names) > MOST_LISTED else ""
        share = shown_share(self.probability - self.shown_probability)
        return f"{share} of it is of effects that these records do not show: {', '.join(names[:MOST_LISTED])}{more}"

    @property
    def name(self) -> str:
        """Name as text."""
        if not self.effects:
            return BEYOND if self.beyond else NOTHING
        return " with ".join(self.effects) + (f" and {BEYOND}" if self.beyond else "")


def shown_share(probability: float) -> str:
    """Probability in percent, next to certainty by the bound that it exceeds."""
    if probability > 0.999:
        return "> 99.9 %"
    return f"{100 * probability:.0f} %" if 0.01 <= probability < 0.99 else f"{100 * probability:.1f} %"


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
    joined = [
        replace(own[0], probability=sum(e.probability for e in own), alike=tuple(e.effects for e in own[1:]))
        for own in classes.values()
    ]
    unseen = tuple(e for e in joined if not e.shown)
    more = sum(e.probability for e in unseen)
    out = [
        replace(e, probability=e.probability + more, unseen=unseen) if e.name == NOTHING else e
        for e in joined
        if e.shown
    ]
    return tuple(sorted(out, key=lambda e: (-e.probability, e.name)))


def joined_classes(odds: Sequence[Explanation], verdict: SearchVerdict) -> tuple[Explanation, ...]:
    """Odds with the members of each identified effect's class as one, by the name of the verdict's member.

    So with something beyond the catalogue as without; some classes follow from the size, and have members that are no
    candidates.
    """
    if verdict.best is None:
        return tuple(odds)
    own, orders = verdict.best.keys, list(permutations(verdict.classes))

    def same(e: Explanation) -> bool:
        alike = len(e.effects) == len(verdict.classes)
        return alike and any(all(key in c for key, c in zip(e.effects, order, strict=True)) for order in orders)

    joined = [e for e in odds if not same(e)]
    for beyond in (False, True):
        members = [e for e in odds if e.beyond == beyond and same(e)]
        every = [keys for e in members for keys in (e.effects, *e.alike)]
        if not members:
            continue
        first = next((e for e in members if own in (e.effects, *e.alike)), members[0])
        name = own if own in every else first.effects
        more = [keys for keys in map(tuple, map(sorted, product(*verdict.classes))) if not {*keys} <= {*sum(every, ())}]
        alike = tuple(keys for keys in (*every, *more) if keys != name)
        joined.append(replace(first, effects=name, probability=sum(e.probability for e in members), alike=alike))
    return tuple(sorted(joined, key=lambda e: (-e.probability, e.name)))


def probability_of(keys: tuple[str, ...], odds: Sequence[Explanation]) -> float:
    """Probability of an explanation by its effects, as one of a class or alone."""
    return next((e.probability for e in odds if not e.beyond and keys in (e.effects, *e.alike)), 0.0)


def with_more(
    odds: Sequence[Explanation], falls: Mapping[tuple[str, ...], float], temperature: float = TEMPERATURE
) -> tuple[Explanation, ...]:
    """Odds with more points, at which the sum of squares is lower than that of nothing missing by these falls.

    It is that of nothing missing with an explanation that was not re-fitted, which hardly helps at the fitted points.
    No effect gets more than `MOST_BY_MORE` by them; the others share what is left in their own proportions.
    """
    best = [max((falls.get(keys, 0.0) for keys in (e.effects, *e.alike)), default=0.0) for e in odds]
    logs = np.log(np.maximum([e.probability for e in odds], 1e-300)) + 0.5 * np.array(best) / temperature
    p = softmax(logs)
    first = int(p.argmax())
    if odds[first].effects and p[first] > (most := max(MOST_BY_MORE, odds[first].probability)):
        logs[first] = -np.inf
        p = (1 - most) * softmax(logs)
        p[first] = most
    own = (replace(e, probability=float(x)) for e, x in zip(odds, p, strict=True))
    return tuple(sorted(own, key=lambda e: (-e.probability, e.name)))


def with_other(
    odds: Sequence[Explanation], keys: tuple[str, ...], other: Explanation, fall: float
) -> tuple[Explanation, ...]:
    """Odds in which another explanation stands, beforehand as likely as that with these keys.

    `fall` is that of the sum of squares from the known explanation to the other one.
    """
    p = probability_of(keys, odds) * float(np.exp(np.clip(fall / (2 * TEMPERATURE), -500.0, 500.0)))
    return tuple(replace(e, probability=e.probability / (1 + p)) for e in (*odds, replace(other, probability=p)))


def entropy(p: np.ndarray) -> np.ndarray:
    """Entropy [bit] of probabilities along the last axis."""
    return np.asarray(-(p * np.log2(np.maximum(p, 1e-300))).sum(axis=-1))

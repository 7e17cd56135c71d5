"""Hypotheses of a search: sets of forms, screened linearly, fitted to the plant, tested at held-out points.

Two things speak against a further effect next to another: their responses cancel, or the further one explains the
other's form error. A model of an effect is never exact: damping, a delay of the recorder, the shape of the effect
itself leave a share of its own response in the same line groups. A remainder that is small against the effect's
response there, group by group, is measured as that form error and gets no name of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import isfinite, log
from typing import Any

import numpy as np

from rotorsim.base.errors import NoAnswerError
from rotorsim.base.rounding import answer
from rotorsim.base.units import show
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint, within
from rotorsim.discrepancy.candidates import Form, Screening, apart, distinct, screen, unit_of
from rotorsim.discrepancy.comparison import Misfit, TwinComparison, excess, flagged, table
from rotorsim.discrepancy.fit import (
    ParameterFit,
    cost_of,
    covariance,
    fall_within,
    finished,
    fit_parameters,
    prior_rows,
    strained,
)

CLEAR = 100.0
"""Least fall of the sum of squares by a name, besides k ln N: twice that of a detectable effect. Where nothing is
missing the best effect lowers it by some ten, with another law of the injectors by up to thirty."""
NEVER = "never"
"""Size from which an effect would be seen that a calibration takes up."""
TIE = 0.06
"""Difference of two rivals' sums of squares below which they are tied, as a share of the fall by the best one."""
CANCEL = 0.5
"""Sum of responses over the largest one below which they cancel: of two equal ones, a cosine below -0.87."""
FORM = 0.1
"""Share of its own response that an effect's form may leave in a group. Chosen, not measured: a remainder of .4 % in
energy, as a bow in records of another program left, is 0.06 in amplitude."""
OTHERS = 0.02
"""Share of its largest response in a record's channel that an effect's form may leave in any group: of forces that are
not linear, such as those of a crack, a model has the strongest harmonics right. Chosen as FORM was."""
ENOUGH = 0.95
"""Share of the flagged excess that has to go before anything is named."""
NEARLY = 0.8
"""Share of the excess gone from which on a hypothesis is fitted with all sensitivities updated before it is dropped."""
REFITS = 3
"""Hypotheses of each size that are re-fitted with the plant."""
SURE = 5.0
"""Standard deviations by which the size of a further effect differs from none."""
MOST_HALVINGS = 4
"""Most reductions of the linear estimate, by 0.4 each, before a fit begins at size 0."""
MOST_ROUNDS = 8
"""Most fits of a hypothesis with new sensitivities."""
LITTLE = 0.05
"""Share of its fall so far below which what a hypothesis may still gain is not fitted: less than a tie, it decides
nothing."""
FITTED_ON = 2
"""Hypotheses from the machine file's own numbers that are fitted on: as many as most classes have members."""
COARSE = 10.0
"""Factor on the floor where forms are ranked against a calibration that is not believed."""
FINALISTS = 10
"""Forms whose sensitivities are updated at the re-fitted point."""


def cancel(responses: Sequence[np.ndarray]) -> bool:
    """Whether responses (n,) of several effects nearly cancel."""
    if len(responses) < 2:
        return False
    largest = max(float(np.linalg.norm(r)) for r in responses)
    return float(np.linalg.norm(np.sum(responses, axis=0))) < CANCEL * largest


def beyond_form_error(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> list[Misfit]:
    """Groups beyond their floor in which what an effect leaves is not small against its own response there.

    Where the group itself has little of that response, the largest one in the same channel of the record counts.
    `before` and `after` are whitened residuals (n,) without the effect and with it.
    """
    own = {(f.number, f.channel, f.group): f.rms for f in table(comparison, before - after)}
    largest: dict[tuple[int, str], float] = {}
    for (number, channel, _), size in own.items():
        largest[number, channel] = max(largest.get((number, channel), 0.0), size)
    return [
        f
        for f in flagged(table(comparison, after))
        if f.rms >= max(FORM * own[f.number, f.channel, f.group], OTHERS * largest[f.number, f.channel])
    ]


def within_form_error(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> bool:
    """Whether what an effect leaves is small against its own response in every group that is beyond its floor."""
    return not beyond_form_error(comparison, before, after)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Combination of forms that explains the misfit, fitted to the plant."""

    forms: tuple[Form, ...]
    fit: ParameterFit
    excess: float
    held_out: float
    gone: float
    """Share of the flagged excess that is gone."""
    failed: bool = False
    """Whether no fit with these forms is better than the one without them."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the effects, sorted."""
        return tuple(sorted(f.key for f in self.forms))

    @property
    def score(self) -> float:
        """Sum of squares with priors and k ln N."""
        return self.fit.cost + (len(self.fit.parameters)) * log(len(self.fit.residual))

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for the stored result."""
        cost, keys = self.fit.cost, list(self.keys)
        return {"effects": keys, "gone": self.gone, "cost": cost, "held_out": self.held_out, "failed": self.failed}


@dataclass(eq=False)
class EffectSearch:
    """Search for missing effects; `columns` are sensitivities by form at some point."""

    comparison: TwinComparison
    held_out: TwinComparison | None
    base: ParameterFit
    forms: tuple[Form, ...]
    columns: dict[str, np.ndarray]
    base_excess: float
    base_held: float
    progress: Callable[[], None] = lambda: None
    updated: set[str] | None = None
    nominal: ParameterFit | None = None
    """Base with the sensitivities of the point of `columns`; without one all are updated at once."""
    before: EffectSearch | None = None
    """The same search from the machine file's own numbers, where what is missing has led the calibration astray."""
    unsteady: float = 0.0
    """Part of the excess that does not repeat from period to period: no effect takes it away."""

    @property
    def most_gone(self) -> float:
        """Largest share of the excess that an effect may take away: all that repeats."""
        return 1 - self.unsteady / self.base_excess if self.base_excess > 0 else 1.0

    def screened(self, base: ParameterFit | None = None) -> Screening:
        """All forms, projected off the calibration as it is at the re-fitted point (or at that of another `base`)."""
        return screen(base or self.base, self.forms, [self.columns[f.label] for f in self.forms])

    def promise(self) -> float:
        """Fall of the sum of squares by the best form, from linear sensitivities."""
        if not self.forms:
            return 0.0
        view = self.screened(self.nominal)
        return max((view.drop(i)[0] for i in range(len(self.forms))), default=0.0)

    def seen_from(self) -> dict[str, str]:
        """Sizes from which the records would have shown an effect wherever it acts, with units, by key without place.

        Those that are the smallest share of what is usual come first. By the sensitivities that the search begins with,
        and the fall of the sum of squares that a name needs.
        """
        if not self.forms:
            return {}
        units = {form.key.partition(" of ")[0]: unit_of(form) for form in self.forms}
        usual = {form.key.partition(" of ")[0]: form.parameters[0].prior_size for form in self.forms}
        sizes = self.screened(self.nominal).seen_from(CLEAR)
        return {
            key: show(float(f"{size:.2g}"), units[key]) if isfinite(size) else NEVER
            for key, size in sorted(sizes.items(), key=lambda one: (one[1] / usual[one[0]], one[0]))
        }

    def update_columns(self, forms: Iterable[Form]) -> None:
        """Take sensitivities of these forms at the re-fitted point."""
        self.updated = self.updated or set()
        todo = [f for f in forms if f.label not in self.updated]
        if not todo:
            return
        here = self.comparison.predict(self.base.point)
        for form in todo:
            point = self.base.point.holding(form.fixed)
            self.columns[form.label] = self.comparison.jacobian(point, form.parameters, here, self.progress)
            self.updated.add(form.label)

    def hypothesis(self, forms: Sequence[Form], start: np.ndarray) -> Hypothesis:
        """Fit forms and calibration together, renewing the forms' own columns once; failed if it does not help."""
        try:
            found = self._fitted(forms, start)
        except NoAnswerError:
            return self._failed(forms)
        return found if found.fit.cost < self.base.cost else self._failed(forms)

    def _failed(self, forms: Sequence[Form]) -> Hypothesis:
        """A failed fit: that without the forms, which takes nothing away."""
        return Hypothesis(tuple(forms), self.base, self.base_excess, self.base_held, 0.0, failed=True)

    def _fitted(self, forms: Sequence[Form], start: np.ndarray) -> Hypothesis:
        own = tuple(k for f in forms for k in f.parameters)
        fixed = {key: v for f in forms for key, v in f.fixed.items()}
        S = np.concatenate([self.columns[f.label] for f in forms], axis=1)
        parameters = (*self.base.parameters, *own)
        J = np.concatenate([self.base.J, S], axis=1)
        point, residual = self._beginning(parameters, fixed, S, start)
        first = fit_parameters(self.comparison, point, parameters, J, residual, progress=self.progress)
        done = self._left(first) <= (1 - ENOUGH) * self.base_excess and not any(f.shaped for f in forms)
        if not done and first.cost < self.base.cost:
            refine = tuple(k for f in forms for k in f.refine)
            turned = (*own, *refine)
            here = self.comparison.predict(first.point)
            fresh = self.comparison.jacobian(first.point, turned, here, self.progress)
            J = np.concatenate([first.J[:, : len(self.base.parameters)], fresh], axis=1)
            again = fit_parameters(
                self.comparison,
                first.point,
                (*self.base.parameters, *turned),
                J,
                first.residual,
                progress=self.progress,
            )
            first = again if again.cost < first.cost else first
        found = self._found(tuple(forms), first)
        if NEARLY <= found.gone < ENOUGH:
            found = min(found, self.polished(found), key=lambda h: h.fit.cost)
        return found

    def _beginning(
        self, parameters: tuple[FitParameter, ...], fixed: dict[str, float], S: np.ndarray, start: np.ndarray
    ) -> tuple[ParameterPoint, np.ndarray]:
        """Point and residual that a fit begins at: the linear estimate or a part of it that helps, or size 0."""
        own, p = parameters[len(self.base.parameters) :], prior_rows(parameters)
        for halving in range(MOST_HALVINGS + 1):
            point = self._start(own, fixed, S, 0.4**halving * start)
            residual = self.comparison.residual(point)
            v = np.array([point.values.get(k, 0.0) for k in parameters])
            if cost_of(residual, v, p) < self.base.cost:
                return point, residual
        point = self.base.point.holding(fixed)
        return point, self.comparison.residual(point)

    def polished(self, h: Hypothesis, J: np.ndarray | None = None) -> Hypothesis:
        """The hypothesis fitted once more with every sensitivity taken where it stands, or J (n, k) of that point.

        The calibration's sensitivities change with the effect at work: without them its size and uncertainty are off.
        """
        J = self._sensitivities(h.fit) if J is None else J
        done = fit_parameters(self.comparison, h.fit.point, h.fit.parameters, J, h.fit.residual, progress=self.progress)
        return self._found(h.forms, done)

    def with_shape(self, h: Hypothesis, path: str, value: float, wanted: float) -> Hypothesis:
        """The hypothesis converged with a shape held at a value, unless a sum of squares `wanted` is out of reach."""
        parameters = tuple(k for k in h.fit.parameters if k.key != path)
        values = {k: v for k, v in h.fit.point.values.items() if k.key != path}
        point = replace(h.fit.point, values=values).holding({path: value})
        there = replace(h.fit, parameters=parameters, point=point, residual=self.comparison.residual(point))
        there = replace(there, cost=cost_of(there.residual, there.vector, prior_rows(parameters)))
        try:
            done = finished(self.comparison, there, self.progress, central=False, wanted=wanted)
        except NoAnswerError:
            return self._failed(h.forms)
        return self._found(h.forms, done)

    def _sensitivities(self, fit: ParameterFit) -> np.ndarray:
        """Jacobian (n, k) where a fit stands."""
        return self.comparison.jacobian(fit.point, fit.parameters, progress=self.progress)

    def _left(self, fit: ParameterFit) -> float:
        """Excess that a fit leaves."""
        return excess(table(self.comparison, fit.residual)) + self.unsteady

    def _found(self, forms: tuple[Form, ...], fit: ParameterFit) -> Hypothesis:
        left = self._left(fit)
        return Hypothesis(forms, fit, left, self._held(fit.point), share_gone(left, self.base_excess))

    def cancels(self, h: Hypothesis) -> bool:
        """Whether the responses of a hypothesis' effects nearly cancel."""
        values = h.fit.point.values
        sizes = [np.array([values.get(k, 0.0) for k in f.parameters]) for f in h.forms]
        return cancel([self.columns[f.label] @ size for f, size in zip(h.forms, sizes, strict=True)])

    def is_sure(self, h: Hypothesis, forms: Sequence[Form]) -> bool:
        """Whether the size of each of these forms is SURE standard deviations or more from none.

        At the shape that was found: an effect of no size has none.
        """
        V, at = covariance(h.fit, self.comparison.layout.record), {k: i for i, k in enumerate(h.fit.parameters)}
        for form in forms:
            i, shape = [at[k] for k in form.parameters], [at[k] for k in form.refine if k in at]
            own, cross = V[np.ix_(i, i)], V[np.ix_(i, shape)]
            if shape:
                own = own - cross @ answer(np.linalg.solve, V[np.ix_(shape, shape)], cross.T)
            size = h.fit.vector[i]
            if float(size @ answer(np.linalg.solve, own, size)) < SURE**2:
                return False
        return True

    def onward(self, h: Hypothesis) -> EffectSearch:
        """A search for effects missing besides those of a hypothesis.

        What is missing may have led its calibration astray too: it is searched from the machine file's numbers as well.
        """
        forms = tuple(f for f in self.forms if all(apart((f, taken)) for taken in h.forms))
        columns = {f.label: self.columns[f.label] for f in forms}
        left = h.excess - self.unsteady
        found = EffectSearch(self.comparison, self.held_out, h.fit, forms, columns, left, h.held_out, self.progress)
        if self.before is not None and strained(h.fit):
            base = self._from_file(h.fit, self.before.base.J)
            columns = {f.label: self.before.columns[f.label] for f in forms}
            found.before = replace(found, base=base, nominal=base, columns=columns, updated={*columns})
        return found

    def _from_file(self, fit: ParameterFit, J: np.ndarray) -> ParameterFit:
        """A hypothesis' fit with its effects as they are and the calibration, whose columns are J, at the file's."""
        count = len(self.base.parameters)
        values = {k: v for k, v in fit.point.values.items() if k not in self.base.parameters}
        point = replace(fit.point, values=values)
        there = replace(fit, point=point, residual=self.comparison.residual(point), J=np.hstack([J, fit.J[:, count:]]))
        return replace(there, cost=cost_of(there.residual, there.vector, prior_rows(fit.parameters)))

    def _start(
        self, own: tuple[FitParameter, ...], fixed: dict[str, float], S: np.ndarray, start: np.ndarray
    ) -> ParameterPoint:
        """The linear estimate: forms at `start` (in steps), and the calibration as it moves with them."""
        values = start * np.array([k.step for k in own])
        low, high = np.array([k.low for k in own]), np.array([k.high for k in own])
        values = np.clip(values, low, high)
        J, p = self.base.J, np.array([1 / k.sd for k in self.base.parameters])
        A = np.vstack([J, np.diag(p)])
        target = np.concatenate([self.base.residual - S @ values, -p * self.base.vector])
        size = np.linalg.norm(A, axis=0)
        size[size == 0] = 1.0
        move = answer(np.linalg.lstsq, A / size, target, rcond=1e-10)[0] / size
        moved = within(self.base.parameters, self.base.vector + move) - self.base.vector
        return self.base.point.holding(fixed).moved(self.base.parameters, moved).moved(own, values)

    def not_moved(self, keys: Iterable[str]) -> dict[tuple[str, ...], ParameterFit]:
        """Fits of single forms, by their effects, at a size of zero: what the records do not show stays there."""
        wanted, base = set(keys), self.base
        return {
            (one.key,): ParameterFit(
                (*base.parameters, *one.parameters),
                base.point.holding(dict(one.fixed)),
                base.residual,
                np.concatenate([base.J, self.columns[one.label]], axis=1),
                base.cost,
            )
            for one in reversed(self.forms)
            if one.key in wanted
        }

    def tangents(self, keys: Iterable[str]) -> dict[tuple[str, ...], ParameterFit]:
        """Fits of single forms, by their effects and by sensitivities alone; of a form's options the best."""
        view, best = self.screened(), dict[str, tuple[float, ParameterFit]]()
        wanted = set(keys)
        for i, one in enumerate(self.forms):
            if one.key not in wanted:
                continue
            gain, start = view.drop(i)
            if gain <= best.get(one.key, (-1.0,))[0]:
                continue
            S = self.columns[one.label]
            point = self._start(one.parameters, dict(one.fixed), S, start)
            parameters, J = (*self.base.parameters, *one.parameters), np.concatenate([self.base.J, S], axis=1)
            fit = ParameterFit(parameters, point, self.base.residual, J, self.base.cost - gain)
            moved = fit.vector - np.concatenate([self.base.vector, np.zeros(len(start))])
            best[one.key] = gain, replace(fit, residual=self.base.residual - J @ moved)
        return {(key,): fit for key, (_, fit) in best.items()}

    def _held(self, point: ParameterPoint) -> float:
        """Excess of the held-out records."""
        if self.held_out is None:
            return 0.0
        return excess(table(self.held_out, self.held_out.residual(point)))

    def singles(self) -> list[Hypothesis]:
        """The best single forms, re-fitted; of one effect and place only its best option."""
        if not self.forms:
            return []
        if self.nominal is None:
            self.update_columns(self.forms)
        else:
            # sensitivities of forms and calibration of one point: mixed, a faint effect drowns in the difference
            first = self.screened(self.nominal)
            order = np.argsort([-first.drop(i)[0] for i in range(len(self.forms))])
            self.update_columns(self.forms[i] for i in order[:FINALISTS] if first.drop(int(i))[0] > 0)
        again = self.screened()
        ranked = sorted(range(len(self.forms)), key=lambda i: -again.drop(i)[0])
        ranked = [i for i in ranked if self.forms[i].label in (self.updated or set())]
        chosen = distinct([(self.forms[i],) for i in ranked], REFITS + 3)
        best = max((again.drop(i)[0] for i in ranked), default=0.0)
        found: list[Hypothesis] = []
        for rank, forms in enumerate(chosen):
            i = self.forms.index(forms[0])
            drop, start = again.drop(i)
            if drop <= 0 or (rank >= REFITS and drop < (1 - 2 * TIE) * best):
                continue
            if found and drop < (1 - 4 * TIE) * best and passes(found[0], self):
                continue  # the best one explains everything and this one is not a rival
            found.append(self.hypothesis(forms, start))
        return sorted(found, key=lambda h: h.fit.cost)

    def best_singles(self) -> list[Hypothesis]:
        """`singles`, and those from the machine file's own numbers where they fit better."""
        found = self.singles()
        if self.before is None:
            return found
        if self.base_excess <= 0:
            return _best_of([*found, *self.in_place_of_calibration()])
        return _best_of([*found, *self._fitted_on(self.before.singles())])

    def _fitted_on(self, started: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Hypotheses from the machine file's own numbers that are better than the calibration, the best ones fitted on.

        A large effect is not linear, and its fit from there takes more rounds.
        """
        found = [self._closer(h) if i < FITTED_ON else h for i, h in enumerate(started)]
        return [h for h in found if h.fit.cost < self.base.cost]

    def in_place_of_calibration(self) -> list[Hypothesis]:
        """Single forms that may be what a calibration beyond its priors has taken up, fitted as long as that helps.

        Ranked with the machine file's own sensitivities and a floor `COARSE` times as high: no tangent reaches as far
        as the calibration has gone, so it is the priors that are to tell.
        """
        nominal, columns = self.nominal or self.base, (self.before or self).columns
        coarse = replace(nominal, residual=nominal.residual / COARSE, J=nominal.J / COARSE)
        view = screen(coarse, self.forms, [columns[f.label] / COARSE for f in self.forms])
        order = sorted(range(len(self.forms)), key=lambda i: -view.drop(i)[0])
        chosen = distinct([(self.forms[i],) for i in order if view.drop(i)[0] > 0], REFITS)
        return [self._closer(self.hypothesis(own, view.drop(self.forms.index(own[0]))[1])) for own in chosen]

    def _closer(self, h: Hypothesis) -> Hypothesis:
        """A hypothesis fitted on with new sensitivities as long as that helps.

        Where a misfit is shown, it ends too after two rounds running from which the rounds that are left, each as good,
        would not bring it to the calibration's cost. A law, which has no `nominal`, is fitted on once it is borne out.
        """
        shown, was_slow = self.base_excess > 0, False
        if not shown and self.nominal is not None:
            return self._closer_in_noise(h)
        for left in reversed(range(MOST_ROUNDS)):
            if h.failed or (shown and within_form_error(self.comparison, self.base.residual, h.fit.residual)):
                break
            last, h = h.fit.cost, self.polished(h)
            share = h.fit.cost / max(last, 1e-300)
            slow = shown and h.fit.cost * share**left > self.base.cost
            if share > 0.95 or (slow and was_slow):
                break
            was_slow = slow
        return h

    def _closer_in_noise(self, h: Hypothesis) -> Hypothesis:
        """An effect of the catalogue fitted on where no misfit is shown: most of the sum of squares is noise.

        A round that takes little of it may come before one that takes all that is missing. It ends once the fall so far
        and what sensitivities where it stands foretell are less than half of that by a name, or they foretell `LITTLE`
        more, or a round leaves it where it stands.
        """
        for number in range(0 if h.failed else MOST_ROUNDS):
            J, fallen = self._sensitivities(h.fit), self.base.cost - h.fit.cost
            ahead = fall_within(h.fit, J)
            if number and (fallen + ahead < CLEAR / 2 or ahead < LITTLE * fallen):
                break
            last, h = h.fit.point, self.polished(h, J)
            if h.fit.point == last:
                break
        return h

    def sets(self, size: int, of: Sequence[int] | None = None) -> list[Hypothesis]:
        """The best pairs or triples, re-fitted."""
        self.update_columns(self.forms)
        view = self.screened()
        pool = list(of) if of is not None else self._pool(view, 40 if size == 2 else 14)
        combos = [c for c in combinations(pool, size) if apart([self.forms[i] for i in c])]
        drops = sorted(((view.drop(*c)[0], c) for c in combos), key=lambda d: -d[0])
        alone = {i: view.drop(i)[0] for i in pool}
        # a set is named where it is better by `CLEAR` than what it holds
        more = [c for d, c in drops[:200] if d > max(alone[i] for i in c) + CLEAR / 2]
        top = distinct([tuple(self.forms[i] for i in c) for c in more], REFITS)
        found = []
        for forms in top:
            drop, start = view.drop(*(self.forms.index(f) for f in forms))
            if drop > 0:
                found.append(self.hypothesis(forms, start))
        return sorted(found, key=lambda h: h.fit.cost)

    def best_sets(self, size: int) -> list[Hypothesis]:
        """`sets`, and those from the machine file's own numbers unless one that explains the misfit is believed."""
        found = self.sets(size)
        if self.before is None or any(passes(h, self) and not strained(h.fit) for h in found):
            return found
        return _best_of([*found, *self._fitted_on(self.before.sets(size))])

    def refitted(self, forms: Sequence[Form]) -> list[Hypothesis]:
        """Fits of forms that help, next to the calibration and, where that is astray, from the file's own numbers."""
        found = []
        for search in (self, self.before):
            if search is None:
                continue
            drop, start = search.screened().drop(*(search.forms.index(f) for f in forms))
            if drop > 0:
                h = search.hypothesis(forms, start)
                found.append(h if search is self else self._closer(h))
        return [h for h in found if not h.failed and h.fit.cost < self.base.cost]

    def _pool(self, view: Screening, most: int) -> list[int]:
        """Forms worth combining: best options of every key by their own drop, and by what they add to the best one."""
        drops = [view.drop(i)[0] for i in range(len(self.forms))]
        best = int(np.argmax(drops))
        adds = [view.drop(*sorted({best, i}))[0] for i in range(len(self.forms))]
        pool: dict[str, int] = {}
        for i in np.argsort([-a for a in adds]):
            pool.setdefault(self.forms[i].key, int(i))
        chosen = list(pool.values())[: most // 2]
        own: dict[str, int] = {}
        for i in np.argsort([-d for d in drops]):
            own.setdefault(self.forms[i].key, int(i))
        return sorted({*chosen, *list(own.values())[: most // 2]})


def _best_of(found: Iterable[Hypothesis]) -> list[Hypothesis]:
    """The best hypothesis of each set of effects, the best first."""
    best: dict[tuple[str, ...], Hypothesis] = {}
    for h in found:
        best[h.keys] = min(best.get(h.keys, h), h, key=lambda one: one.fit.cost)
    return sorted(best.values(), key=lambda h: h.fit.cost)


def share_gone(left: float, before: float) -> float:
    """Share of an excess that is gone; where there was none, 1 if none came."""
    if before > 0:
        return 1 - left / before
    return 1.0 if left <= 0 else 0.0


def passes(h: Hypothesis, search: EffectSearch) -> bool:
    """True if a hypothesis explains the flagged misfit, at held-out points too."""
    price = CLEAR + (len(h.fit.parameters) - len(search.base.parameters)) * log(len(h.fit.residual))
    better = search.base.cost - h.fit.cost > price
    held = search.held_out is None or h.held_out <= max(0.25 * search.base_held, 0.1 * search.base_excess)
    return bool(better and held and h.gone >= ENOUGH and not search.cancels(h))

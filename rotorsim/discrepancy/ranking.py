"""Ranking of the experiments that a rig can do next by what they should leave of the odds.

Every experiment that is allowed gets a first look; those that promise most get a close one, until none that is left
promises more than the best one seen closely, or `CLOSE` have been.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomlkit

from rotorsim.base.errors import DataError, NoAnswerError
from rotorsim.base.units import MPA, TO_RPM
from rotorsim.discrepancy.candidates import signature_of
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.experiments import ExperimentOption, options, written_changes
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.forecast import (
    Columns,
    CurrentOdds,
    Forecast,
    Outlook,
    in_proportion,
    on_turned_ring,
    outlook,
    separation,
)
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.verdict import NOT_IN_CATALOGUE, NOTHING, SURE, TEMPERATURE, Explanation, shown_share
from rotorsim.machine import Machine

LEAST = 1e-3
"""Probability, among those of the catalogue, from which an explanation is a rival."""
RIVALS, UNSEEN = 4, 8
"""Most rivals that are followed into a new run: of those that the records show, and of those that they do not."""
ENOUGH = 0.02
"""Share of today's entropy that a run has to take away to be worth its time."""
CLOSE = 6
"""Most experiments that get a close look."""
UNKNOWN_FORM, WORSE = 0.3, 3.0
"""Relative error of the response where something beyond the catalogue is missing besides the most probable effects, and
times theirs that it is at least."""
UNEXPLAINED = 1.0
"""Logarithm of the evidence from which on records show that something beyond the catalogue is missing, and a new run
would show it too; below it has little more than its prior probability, and keeps it."""
APART = 9.0
"""Sum of squares between two explanations, after re-fitting, below which an experiment does not separate them."""
A_MINUTE = 0.002
"""Entropy [bit] that a minute of rig time is worth: of runs that leave about the same the shorter one is better."""


@dataclass(frozen=True)
class Proposal:
    """Experiment with the odds that it should leave.

    close : whether sensitivities were taken in it; else those of the usual excitation at its operating point stand for
        them, or some alone where its lines are others (`bare`), which promises too much
    """

    option: ExperimentOption
    outlook: Outlook
    close: bool = True
    bare: bool = False

    @property
    def rank(self) -> float:
        """Entropy [bit] that is left, with the price of the rig time."""
        return self.outlook.entropy + A_MINUTE * self.option.minutes

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        one = self.option
        return {
            "experiment": one.name, "kind": one.experiment.name, "speed_rpm": one.speed * TO_RPM,
            "pressure_mpa": one.pressure / MPA, "minutes": one.minutes, "close_look": self.close,
            "entropy_bit": self.outlook.entropy, "chance_of_decision": self.outlook.decided,
            "probability_if_true": list(map(float, self.outlook.truths)),
            "chance_of_decision_if_true": list(map(float, self.outlook.chances)),
        }  # fmt: skip


@dataclass(frozen=True)
class ExperimentPlan:
    """Experiments, the best first; entropy [bit] of today's odds; sentences on what no experiment separates.

    Experiments that help come before those that do not, whose price may be lower (`with_proposals`).
    `odds` are the rivals' probabilities today, `tried` the number of experiments that were looked at, `sure` the
    probability at which an explanation is settled.
    """

    entropy: float
    rivals: tuple[str, ...]
    proposals: tuple[Proposal, ...]
    unbreakable: tuple[str, ...] = ()
    odds: tuple[float, ...] = ()
    tried: int = 0
    sure: float = SURE

    def helps(self, proposal: Proposal) -> bool:
        """Whether an experiment should take away a part of the entropy that is worth its time."""
        return proposal.outlook.entropy < (1 - ENOUGH) * self.entropy

    @property
    def settles(self) -> bool:
        """Whether the best experiment helps."""
        return bool(self.proposals) and self.helps(self.proposals[0])

    def with_proposals(self, ranked: Iterable[Proposal]) -> ExperimentPlan:
        """Plan with the experiments of a ranking, those that help before the others."""
        return replace(self, proposals=tuple(sorted(ranked, key=lambda p: not self.helps(p))))

    def first(self, longest: float) -> Proposal | None:
        """The best experiment that helps and takes no longer [min]."""
        return next((p for p in self.proposals if p.option.minutes <= longest and self.helps(p)), None)

    @property
    def sentence(self) -> str:
        """Sentence on the next experiment."""
        if len(self.rivals) < 2 or not self.proposals:
            return "No next experiment: one explanation is left, or none was re-fitted."
        best, share = self.proposals[0], max(self.odds, default=0.0)
        run = f"{best.option.name} ({best.option.minutes:.0f} min)"
        if not self.settles:
            return f"No allowed experiment separates {' from '.join(self.rivals[:2])}."
        if share >= self.sure:
            name = self.rivals[self.odds.index(share)]
            return f"Settled already, {shown_share(share)} {name}; what confirms or refutes it best: {run}."
        return (
            f"Next: {run}: {100 * best.outlook.decided:.0f} % chance that one explanation gets "
            f"{100 * self.sure:.3g} %; entropy {self.entropy:.2f} -> {best.outlook.entropy:.2f} bit."
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        return {
            "sentence": self.sentence, "entropy_bit": self.entropy, "experiments_tried": self.tried,
            "rivals": [{"name": n, "probability": p} for n, p in zip(self.rivals, self.odds, strict=False)],
            "proposals": [p.as_dict() for p in self.proposals], "unbreakable": list(self.unbreakable),
        }  # fmt: skip

    def campaign(self, machine: Machine, name: str) -> str:
        """The best experiment as the plan of a campaign; `name` is a shipped machine, or a file next to the plan."""
        best, document = self.proposals[0].option, tomlkit.document()
        document.add(tomlkit.comment(self.sentence))
        document.add("name", "next")
        document.add("machine", name)
        for title, content in (("changes", written_changes(machine, best)), ("experiments", {"next": best.table()})):
            if content:
                document.add(title, tomlkit.item(content))
        return tomlkit.dumps(document)


def rivals_of(odds: Iterable[Explanation]) -> list[Explanation]:
    """Explanations that a new run may settle: probable ones without something that has no response to predict.

    What the records do not show is an explanation of its own here: a run may show it.
    """
    found = [e for e in _apart(odds) if not e.beyond]
    least = LEAST * sum(e.probability for e in found)
    return sorted((e for e in found if e.probability > 0 and e.probability >= least), key=lambda e: -e.probability)


def _apart(odds: Iterable[Explanation]) -> list[Explanation]:
    """Explanations without the unseen ones that are counted with them, and those."""
    return [one for e in odds for one in (replace(e, probability=e.shown_probability, unseen=()), *e.unseen)]


def plan_next(
    comparison: TwinComparison,
    fits: Mapping[tuple[str, ...], ParameterFit],
    odds: Sequence[Explanation],
    allow: Iterable[str],
    progress: Callable[[], None] = lambda: None,
    longest: float = np.inf,
    sure: float = SURE,
) -> ExperimentPlan:
    """Rank the experiments that are allowed: those that change only what `allow` names, of `decision.ALLOWED`.

    `fits` are explanations by the effects that they name, re-fitted or by their sensitivities; () is nothing missing.
    An experiment takes at most `longest` minutes of rig time; an explanation of probability `sure` is settled. Raises
    DataError if nothing that is allowed can be done, or not in that time.
    """
    found = options(comparison.twin.machine, comparison.trials, allow)
    if not found:
        raise DataError("plan: no experiment is possible with what is allowed; allow more")
    short = [one for one in found if one.minutes <= longest]
    if not short:
        least = min(one.minutes for one in found)
        raise DataError(f"budget: {longest:.3g} min are less than the shortest experiment, {least:.3g} min; give more")
    able = [e for e in rivals_of(odds) if e.effects in fits]
    seen, unseen = [e for e in able if e.shown][:RIVALS], [e for e in able if not e.shown][:UNSEEN]
    known = [*seen, *unseen]
    inseparable = tuple(_of_class(e) for e in known if e.alike and e.effects)
    rivals = [Rival(e.effects, e.name, e.probability, fits[e.effects], e.error) for e in known]
    beyond = [e for e in odds if e.beyond and (len(known) < 2 or _shows_more(e, odds))]
    more = sum(e.probability for e in beyond)
    if known and more >= LEAST:
        first = rivals[0]
        error = max(UNKNOWN_FORM, WORSE * first.error)
        rivals.append(Rival((), NOT_IN_CATALOGUE, more, first.fit, error))
    names = tuple(r.name for r in rivals)
    if len(rivals) < 2:
        return ExperimentPlan(0.0, names, (), inseparable, tried=len(short))
    today = _today(rivals, [e for e in _apart(odds) if e not in known and e not in beyond])
    forecast = Forecast(comparison, [r.fit for r in rivals], [r.error for r in rivals])
    looks = ExperimentRanking(forecast, today, short, progress, sure)
    proposals = looks.ranked()
    inseparable += tuple(looks.inseparable([e.name for e in known if e.shown]))
    plan = ExperimentPlan(today.entropy, names, (), inseparable, tuple(map(float, today.odds)), len(short), sure)
    return plan.with_proposals(proposals)


def _shows_more(e: Explanation, odds: Sequence[Explanation]) -> bool:
    """Whether the records show that something beyond the catalogue is missing."""
    alone = next((one.evidence for one in odds if one.effects == e.effects and not one.beyond), 0.0)
    return e.evidence - alone > UNEXPLAINED


def _today(rivals: Sequence[Rival], others: Sequence[Explanation]) -> CurrentOdds:
    """Odds of the rivals; the others with the rival with the same effects, else of nothing missing."""
    rest, names = np.zeros(len(rivals)), [r.name for r in rivals]
    nothing = names.index(NOTHING) if NOTHING in names else 0
    places = {r.effects: i for i, r in enumerate(rivals) if r.effects}
    for e in others:
        rest[places.get(e.effects, nothing)] += e.probability
    odds = np.array([r.probability for r in rivals])
    whole = float(odds.sum() + rest.sum())
    beyond = sum(e.probability for e in others if e.beyond)
    return CurrentOdds(odds / whole, rest / whole, np.array([bool(r.effects) for r in rivals]), beyond / whole)


@dataclass(frozen=True)
class Rival:
    """An explanation that is followed into new runs, with its fit and the relative error of the model's form."""

    effects: tuple[str, ...]
    name: str
    probability: float
    fit: ParameterFit
    error: float


@dataclass(eq=False)
class ExperimentRanking:
    """Ranking of experiments: a first look at each, a close one at those that promise most."""

    forecast: Forecast
    today: CurrentOdds
    options: Sequence[ExperimentOption]
    progress: Callable[[], None] = lambda: None
    sure: float = SURE

    def __post_init__(self) -> None:
        machine = self.forecast.comparison.twin.machine
        self.trials: list[Trial] = [one.trial(machine) for one in self.options]
        self.means = self._means()
        self.apart = np.zeros((len(self.today.odds), len(self.today.odds)))
        """Largest sum of squares between two explanations that a look has found, after re-fitting."""

    def _means(self) -> list[list[np.ndarray]]:
        out: list[list[np.ndarray]] = []
        for first in range(0, len(self.trials), 8):
            self.progress()
            out += self.forecast.means(self.trials[first : first + 8])
        return out

    def ranked(self) -> tuple[Proposal, ...]:
        """Proposals, the best first: those seen closely, then the others."""
        first = self._first_looks()
        order = sorted(first, key=lambda i: first[i].rank)
        close = {i: look for i, look in first.items() if look.close}
        for i in [i for i in order if i not in close][:CLOSE]:
            if close and min(p.rank for p in close.values()) <= first[i].rank:
                break
            self.progress()
            columns = self.forecast.columns([self.trials[i]], [self.means[i]])[0]
            if (found := self._look(i, columns, True)) is not None:
                close[i] = found
        rest = [first[i] for i in order if i not in close and not first[i].bare]
        return (*sorted(close.values(), key=lambda p: p.rank), *rest)

    def _first_looks(self) -> dict[int, Proposal]:
        """Every experiment with the sensitivities of the first one at its operating point.

        Where its lines are others there are those to what explanations have as their own, in a record over time.
        """
        usual: dict[tuple[float, float], int] = {}
        for i, one in enumerate(self.options):
            usual.setdefault((one.speed, one.pressure), i)
        columns: dict[int, Columns] = {}
        for i in usual.values():
            self.progress()
            columns[i] = self.forecast.columns([self.trials[i]], [self.means[i]])[0]
        found = {}
        for i, one in enumerate(self.options):
            at = usual[one.speed, one.pressure]
            near = columns[i] if i == at else self._near(columns[at], at, i)
            look = self._look(i, self._own(i) if near is None else near, i == at, near is None)
            if look is not None:
                found[i] = look
        return found

    def _own(self, i: int) -> Columns:
        """Sensitivities to what explanations have as their own; none of a run-up, whose runs are long."""
        return {} if self.trials[i].orders else self.forecast.columns([self.trials[i]], [self.means[i]], own=True)[0]

    def _near(self, columns: Columns, usual: int, i: int) -> Columns | None:
        """Sensitivities of another experiment at an operating point from the usual one's; None where there are none."""
        near, ring = in_proportion(columns, self.trials[usual], self.trials[i]), self.options[i].ring
        if near is None or not ring:
            return near
        of_sensors = self.forecast.columns([self.trials[i]], [self.means[i]], of_sensors=True)[0]
        return on_turned_ring(near, ring) | of_sensors

    def _look(self, i: int, columns: Columns, close: bool, bare: bool = False) -> Proposal | None:
        trial, means = self.trials[i], self.means[i]
        sigma = self.forecast.floor(trial, means)
        try:
            predicted = self.forecast.predicted(trial, means, columns, sigma)
            if not bare:
                self.apart = np.maximum(self.apart, separation(predicted, sigma))
            found = outlook(self.today, predicted, sigma, TEMPERATURE, sure=self.sure)
            return Proposal(self.options[i], found, close, bare)
        except NoAnswerError:
            return None

    def inseparable(self, names: Sequence[str]) -> list[str]:
        """Sentences on pairs of the first explanations, which the records show, that no experiment separates."""
        pairs = [(i, k) for i in range(len(names)) for k in range(i) if self.apart[i, k] < APART]
        return [
            f"no allowed experiment separates {names[k]} from {names[i]}: after re-fitting they differ by at most "
            f"{np.sqrt(self.apart[i, k]):.1f} standard deviations in any experiment that was looked at"
            for i, k in pairs
        ]


def _of_class(e: Explanation) -> str:
    """Sentence on why no experiment separates explanations of one class."""
    others = ", ".join(" with ".join(one) for one in e.alike)
    reason = next((s for s in map(signature_of, e.effects) if s), "the same response in every record")
    return f"no experiment separates {e.name} from {others}: {reason}"

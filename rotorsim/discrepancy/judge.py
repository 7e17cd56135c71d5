"""Judge of a diagnosis: verdict, exit code, headline and next step from all evidence, in this one place.

The evidence is what the search accepts, the odds of all explanations, what is left at held-out and untouched points
against the floor there, how far the calibration stands from what was believed, and whether the floor is known.

A name or a tie of the search is named where one explanation has `SURE`, a tie where several share it, and partial where
something beyond the catalogue is more likely than not. A partial explanation is the most probable one that helps. Where
the search has no name, or too little, nothing disagrees if nothing missing has `SURE`: all that is flagged is then
within the model's inferred form error.

An explanation is confirmed by records that took no part in the search; without them a partial one has to leave less of
the gap of the fitted records. The gap there is that of the line groups beyond
their floor, before or with the effect, the floor's own part subtracted. In the few cases known when the border was
chosen, halfway, right names took 97 to 100 % of the whole gap (69 % in records resampled by hand) and wrong ones 0 to
20 %.

Every verdict has to hold at the points that were not fitted. A group of lines there with `MANY` floors refutes that
nothing disagrees, and makes a name or a tie a partial explanation; fewer floors change headline and next step. Where
most of the response stays unexplained, nothing holds. A calibration far from the machine file is a finding of its own,
`recalibrated`; where none of its numbers is off beyond its own uncertainty it is neither that nor agreement, and where
nothing states or measures the floor that uncertainty is taken several times as large. The odds
follow the verdict: an explanation that is refuted leaves its probability to the same one with something beyond the
catalogue.

An effect below what a name takes is one of a tie where all records agree with it, all of that tie have `BORNE_OUT`
together, and the points that were not fitted have a likelihood (to the power 1/T) that is 1 / (1 - `SURE`) times that
of the calibration alone: where nothing is missing that has a chance of 1 - `SURE` at most (Wasserman et al. 2020).
Without such an effect no group of lines may be beyond its floor while all records together refute the calibration. The
odds of what is missing follow then from the priors and from how often such a verdict is met (`REFUSED`, `NAMELESS`),
those of the effects among each other from the records.

Cites: wasserman_2020.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
from scipy.special import chdtrc

from rotorsim.base.units import TO_UM
from rotorsim.discrepancy.candidates import class_of
from rotorsim.discrepancy.changes import MAIN, PLANE
from rotorsim.discrepancy.comparison import UNSTEADY, Misfit, TwinComparison, flagged, table
from rotorsim.discrepancy.data_vector import own_scatter
from rotorsim.discrepancy.gap import rms
from rotorsim.discrepancy.hypotheses import Hypothesis
from rotorsim.discrepancy.records import UNLIKE
from rotorsim.discrepancy.trial import TURNING, Trial
from rotorsim.discrepancy.verdict import (
    A_FIFTH,
    ELSE,
    NOTHING,
    PRIORS,
    SURE,
    Explanation,
    SearchVerdict,
    probability_of,
    shown_share,
)

LEAST_GONE = {"named": 0.5, "tie": 0.5, "partial": 0.1}
"""Share of the gap on untouched records that has to go, by verdict."""
LEAST_FITTED = {"partial": LEAST_GONE["partial"]}
"""The same of the fitted records where none is untouched: a name takes 95 % of what is beyond the floor."""
RIVAL = 0.01
"""Probability from which an explanation is a rival of a tie."""
LIKELY = 0.5
"""Probability of something beyond the catalogue from which no name is given."""
BORNE_OUT = 0.5
"""Least probability that the effects of a faint tie have together, by the odds."""
REFUSED = 0.05
"""Chance that all records together refute a right calibration: none of 21 known ones was, and one is counted."""
NAMELESS = 0.15
"""Chance that a cause in the catalogue gets no name although they do: 3 of 21 known causes. One beyond it never has."""
LEAST_NOTHING = 0.8
"""Probability that nothing is missing below which nothing is "no disagreement": above that of any known wrong one."""
MANY = 5.0
"""Residual of a group of lines, in floors, that refutes a calibration at a point that was not fitted."""


TURNED, CHANCE = ("1X", "2X", "3X"), 1e-4
"""Orders whose lines of all records are looked at together, and the chance below which their sum of squares counts."""


@dataclass(frozen=True)
class VerdictText:
    """Exit code of a verdict, its headline, its meaning, and the next step where no experiment is proposed."""

    exit_code: int
    sentence: str
    meaning: str
    next: str


VERDICTS = {
    "no_disagreement": VerdictText(
        0,
        "No disagreement: after re-calibration every group of lines is within the floor.",
        "The file describes the machine as well as these records can show. Nothing needs to be added.",
        "Use the re-calibrated machine file. Nothing needs to be recorded.",
    ),
    "recalibrated": VerdictText(
        13,
        "Re-calibrated: {changes}. With that the records agree, and no effect is missing.",
        "Numbers of the file are far off: with others the same physics describes all records, also held-out ones "
        "where there are any.",
        "Find out why these numbers differ: inspect that place of the machine before the re-calibrated file is used.",
    ),
    "named": VerdictText(
        10,
        "Named: {effects}.",
        "One explanation has 95 % and accounts for at least 95 % of what was beyond the floor, also in held-out "
        "records where there are any.",
        "Inspect {places}; the new machine file holds the effect.",
    ),
    "tie": VerdictText(
        11,
        "Tie: the records show {effects}, or, indistinguishable from it: {rivals}.",
        "No explanation has 95 % alone; the machine file holds the most probable effect. No name is given: choose "
        "by what is known, or plan and record an experiment that distinguishes them.",
        "Inspect {places}: these records do not distinguish the explanations.",
    ),
    "partial": VerdictText(
        11,
        "Partial: {effects} helps, but much of the disagreement stays; this is not a name.",
        "An effect explains part of what is beyond the floor. Something else is missing; it is not a name.",
        "Do not use the effect as found. Inspect {places}, record more operating points at two excitation "
        "amplitudes, and diagnose again.",
    ),
    "discovered": VerdictText(
        14,
        "Discovered: {law}.",
        "No effect of the catalogue explains the disagreement, but a force law at one place does{tested}.{form}",
        "Find what makes this force at {places}. Record a speed between the others with another excitation, and "
        "diagnose again with that record untouched: {refuted}",
    ),
    "stochastic": VerdictText(
        15,
        "Stochastic: {force}.",
        "What the records show does not repeat: no law of the motion makes it, and no effect of the catalogue. Its "
        "place and size follow from the scatter between blocks, or between records that repeat each other.",
        "Look at the place for what is random there, or wanders. Record one operating point five times to see how it "
        "changes with time.",
    ),
    "unknown": VerdictText(
        12,
        "Unknown: no effect of the catalogue explains the disagreement; see the equivalent force.",
        "Nothing in the catalogue explains what is beyond the floor. The force on the disc that would "
        "explain it is given below.",
        "Look on the machine for what acts like the equivalent force below, by its frequency, its direction and "
        "what it grows with. If it is known, write it as an effect of your own and diagnose again.",
    ),
}
"""Texts and exit code of each verdict."""
NO_FORCE = VerdictText(
    12,
    "Unknown: no effect of the catalogue explains what all records show together; no group is beyond its floor.",
    "Something is there that shows in all records together; it is too small for a force on the disc to be given.",
    "Record again with more excitation, or with less noise, so that groups of lines are beyond their floor.",
)
"""Texts of an unknown cause that no group of lines shows."""
UNSTATED = VerdictText(
    13,
    "Re-calibrated: {changes}. With that nothing disagrees beyond the scatter within the records; how exact they are "
    "is not stated, and whether an effect is missing stays open.",
    "Numbers of the file are far off, also if the floor is several times larger than the records show.",
    "Find out why these numbers differ: inspect that place of the machine, and state how exact the records are, before "
    "the re-calibrated file is used.",
)
"""Texts of a calibration far from the file where nothing states or measures how exact the records are."""
LEFT = "At points that were not fitted, groups of lines stay beyond the floor: {count}."
"""Part of the headline where that is not enough to refute a verdict."""
LEFT_OVER = {
    "no_disagreement": VerdictText(
        0,
        "No disagreement at the points that were fitted. " + LEFT,
        "The file describes the fitted points as well as these records can show, and others less well.",
        "Record the points that the notes name again, and fit them too, before the re-calibrated file is used there.",
    ),
    "recalibrated": VerdictText(
        13,
        "Re-calibrated: {changes}. With that the fitted points agree. " + LEFT,
        "Numbers of the file are far off: with others the same physics describes the fitted points, others less well.",
        "Find out why these numbers differ: inspect that place of the machine, and record the points that the notes "
        "name again, before the re-calibrated file is used.",
    ),
}
"""Texts of verdicts where groups of lines stay beyond the floor at points that were not fitted."""


def text_of(status: str, left: int = 0, scatter_known: bool = True, force: bool = True) -> VerdictText:
    """Texts of a verdict with so many groups of lines beyond the floor at points that were not fitted.

    `force` : whether there is an equivalent force.
    """
    if status == "unknown" and not force:
        return NO_FORCE
    open_still = status == "recalibrated" and not scatter_known
    text = UNSTATED if open_still else VERDICTS[status]
    if not left or status in ("unknown", "partial"):
        return text
    more = replace(text, sentence=f"{text.sentence} {LEFT}")
    own = more if open_still else LEFT_OVER.get(status, more)
    return replace(own, sentence=own.sentence.replace("{count}", str(left)))


NO_ACCURACY = (
    "nothing states how exact the records are: they may agree or be too coarse to disagree; give accuracy (a "
    "displacement), or record one operating point twice"
)
"""Note on records whose scatter is neither measured nor stated."""
NOT_HELD = (
    "groups of lines beyond the floor at points that were not fitted: {count}; most of all {record} ({point}), "
    "{channel}, {group}: {left:.3g} um over a floor of {floor:.2g} um"
)
"""Note on what stays at points that were not fitted."""
TOGETHER = (
    "no group of lines is beyond its floor by itself, but {order} of all records together is: a sum of squares of "
    "{chi2:.0f} from {count} numbers has a chance of {chance:.1g} where nothing is missing"
)
"""Note on what no record shows alone."""
GROWING = (
    "1X {grows} within the records by {share:.2g} % from the first to the last part of each: the machine was not "
    "steady, as one that warms up, and the floor of 1X takes that in; record it warm, or state what changes"
)
"""Note on a motion that changes within the records."""
GROWS, LEAST_GROWTH, MOST_ALIKE, FEWEST_GROWING = 5.0, 0.02, 0.8, 4
"""Mean growth of 1X over its standard error, as a share of it, share of the channels that change that way, and fewest
channels, from which on the machine was not steady."""
WITH_VIBRATION = (
    "{order}X comes with the vibration: {size:.2g} um at {point}, where 1X is {large:.3g} um, and {less:.2g} um at "
    "{small:.3g} um of 1X. That is {times:.2g} times the stated accuracy, far beyond the scatter of the records, and "
    "more than a force of one size makes near a natural frequency: a stop, a rub or a loose part that touches by that "
    "little, a probe that is not linear, or a force at {order}X that grows so with the speed; record that speed again "
    "with more and with less vibration"
)
"""Note on a harmonic of the shaft that small vibration does not have."""
HARMONICS = (2, 3)
"""Orders that may come with the vibration."""
CLEARLY = 10.0
"""Factor over its own scatter from which on such an order is seen."""
STEEPER = 2.0
"""Factor over the growth of 1X from which on its force comes with the vibration; both chosen on a few cases."""
COPIES = 0.01
"""Share of the stated accuracy that counts as scatter where blocks are alike, as those of a simulation."""
CONTRADICTED, BELOW = 8.0, 2.0
"""Factors between a stated accuracy and what the records show from which the two contradict each other: of the misfit,
and of a scatter above it, which the blocks of all records measure well."""
TOO_FINE = (
    "the stated accuracy of {accuracy:.2g} um contradicts the scatter of the records, {scatter:.2g} um, which counts"
)
"""Note on an accuracy that the records' own scatter refutes."""
TOO_COARSE = (
    "the records agree with the machine to {left:.2g} um and scatter by {scatter:.2g} um: the stated accuracy of "
    "{accuracy:.2g} um is coarser than that, and hides disagreements down to a {times:.3g}th of it"
)
"""Note on an accuracy that is many times what is left."""
WITHIN = (
    "all that is beyond the floor is at most {left:.2g} um: with an accuracy of that size in place of the stated "
    "{accuracy:.2g} um nothing would disagree; check what is stated"
)
"""Note on a misfit that the stated accuracy alone may make."""
WORSE = "the calibration makes untouched records worse than the file as given ({records}): it is not the better file"
"""Note on a calibration that is not shown as the better file."""
ASTRAY = (
    "with {} the calibration still ends where it is not believed ({}): the effect may stand for another change of the "
    "machine, and is not named"
)
"""Note on an explanation that needs numbers of the machine which are not believed."""
GIVEN = (
    "no group of lines is beyond its floor by itself, so that these records do not show whether the cause is in the "
    "catalogue: that it is not has {beyond}, by how often such a verdict is met; the probabilities of effects are odds "
    "among those of the catalogue"
)
"""Note on odds where all records together refute the calibration, and no group of lines does."""
NOT_LIKELY = (
    "no effect of the catalogue is needed for what is beyond the floor, but that nothing is missing has only {share}, "
    "less than the {least} that it takes"
)
"""Note on odds that do not bear out that nothing disagrees."""


@dataclass(frozen=True, eq=False)
class AllEvidence:
    """All that a verdict follows from.

    search : what the search accepts
    odds : explanations with their probabilities
    known : keys of all candidates
    left : groups of lines beyond their floor in held-out and untouched records, with the search's best explanation
    of_form : those of them that are small against the response of its effects, as its own form error may leave
    gone : share of the gap on untouched records that its effects take; None where nothing is beyond the floor
    by_fitted : whether that is the share on the fitted records, as none is untouched
    worse : untouched records in which the search's best explanation is worse than the file as given, by the floor
    worse_alone : the same of the calibration without an effect
    large : calibrated numbers that are far from the machine file, as sentences
    unexplained : share of the response that stays unexplained
    scatter_known : whether the scatter of the records is measured or stated
    late : sentence where the records fit better with late probes
    together : sentence on what all records show together and none alone, after calibration alone; as where groups are
        flagged, nothing missing needs `SURE` then
    growing : sentence on 1X that changes within the records, or on a harmonic that comes with the vibration
    unclear : sentence on a calibration far from the machine file without a number that clearly is
    astray : calibration parameters that stand where they are not believed with the effects of the search's best too
    flagged : whether groups of lines are beyond their floor after calibration alone
    faint : effects below what a name takes that points which were not fitted clearly prefer, the best first
    """

    search: SearchVerdict
    odds: tuple[Explanation, ...]
    known: frozenset[str] = frozenset()
    left: tuple[Misfit, ...] = ()
    of_form: tuple[Misfit, ...] = ()
    gone: float | None = None
    worse: tuple[str, ...] = ()
    worse_alone: tuple[str, ...] = ()
    large: tuple[str, ...] = ()
    unexplained: float = 0.0
    scatter_known: bool = True
    late: str = ""
    together: str = ""
    astray: tuple[str, ...] = ()
    growing: str = ""
    unclear: str = ""
    flagged: bool = True
    faint: tuple[Hypothesis, ...] = ()
    by_fitted: bool = False

    @property
    def refuted(self) -> bool:
        """Whether a group is left with more than `MANY` floors, and not by form, at a point that was not fitted."""
        return any(f.rms > MANY * f.floor for f in self.left if f not in self.of_form)

    @property
    def not_held(self) -> str:
        """Sentence on what is left at points that were not fitted; empty where nothing is."""
        worst = max(self.left, key=lambda f: f.rms / f.floor, default=None)
        if worst is None:
            return ""
        return NOT_HELD.format(
            count=len(self.left), record=worst.record, point=worst.point, channel=worst.channel, group=worst.group,
            left=worst.rms * TO_UM, floor=worst.floor * TO_UM,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Judgement:
    """Verdict of a diagnosis, the odds as they follow from it, and notes that give the reasons.

    `left` counts the groups of lines beyond the floor at points that were not fitted; `worse` names the untouched
    records that the calibration makes worse, so that it is not written, and `worse_alone` those that it makes worse
    without an effect.
    """

    verdict: SearchVerdict
    odds: tuple[Explanation, ...]
    notes: tuple[str, ...] = ()
    left: int = 0
    worse: tuple[str, ...] = ()
    worse_alone: tuple[str, ...] = ()
    reason: str = ""
    """Sentence on what refutes that nothing is missing where no group of lines does; empty for none."""


def judged(evidence: AllEvidence) -> Judgement:
    """The verdict that follows from all evidence."""
    verdict = by_odds(evidence.search, evidence.odds, evidence.known)
    against = objections(evidence, verdict)
    if not against and verdict.status in ("named", "tie") and (evidence.refuted or evidence.astray):
        verdict = replace(verdict, status="partial", rivals=())
        against = objections(evidence, verdict)
    foreign = evidence.unexplained > UNLIKE
    faint = _faint_tie(evidence, verdict, against) if not foreign else None
    if faint is not None:
        verdict = faint
    elif against or foreign:
        verdict = replace(verdict, status="unknown", best=None, rivals=())
    elif verdict.status == "no_disagreement" and evidence.large:
        verdict = replace(verdict, status="recalibrated")
    worse = evidence.worse_alone if verdict.status in ("unknown", "partial") else ()
    notes = [*against, evidence.not_held if faint is None else "", evidence.late]
    if verdict.status == "recalibrated" and not evidence.scatter_known:
        notes.append(NO_ACCURACY)
    if verdict.best is not None and evidence.astray:
        notes.append(ASTRAY.format(" with ".join(verdict.best.keys), ", ".join(evidence.astray)))
    if worse and not any(WORSE.format(records=", ".join(names)) in notes for names in (evidence.worse, worse)):
        notes.append(WORSE.format(records=", ".join(worse)))
    refuted = evidence.refuted or foreign or bool(evidence.worse)
    refuted |= any(one in against for one in (evidence.together, evidence.growing, evidence.unclear))
    reason = ""
    if faint is not None:
        odds = evidence.odds
    elif verdict.status == "unknown" and not (evidence.flagged or foreign):
        odds, reason = nameless(evidence.odds, refuted), next(iter(against), "")
        beyond = sum(e.probability for e in odds if e.beyond)
        notes += [GIVEN.format(beyond=shown_share(beyond))] if refuted and odds else []
    else:
        odds = consistent(verdict.status, evidence.odds, refuted)
    notes = list(dict.fromkeys(note for note in notes if note))
    left = len(evidence.left) if faint is None else 0
    return Judgement(verdict, odds, tuple(notes), left, worse, evidence.worse_alone, reason)


def _faint_tie(evidence: AllEvidence, verdict: SearchVerdict, against: Sequence[str]) -> SearchVerdict | None:
    """Tie of the effects with which all records agree, where they do not agree without; None for none.

    A motion that changes within the records, or a harmonic that comes with the vibration, is not what they explain.
    """
    open_still = bool(against) or verdict.status == "unknown"
    if not (evidence.faint and open_still and verdict.best is None) or evidence.growing:
        return None
    own = {h.keys for h in evidence.faint}
    if sum(e.probability for e in evidence.odds if not e.beyond and own & {e.effects, *e.alike}) < BORNE_OUT:
        return None
    best, *rivals = evidence.faint
    classes = tuple(class_of(key, set(evidence.known)) for key in best.keys)
    return replace(verdict, status="tie", best=best, rivals=tuple(rivals), classes=classes)


def withdrawn(judgement: Judgement) -> Judgement:
    """The judgement without its name, its tie or its peace, which something else is clearly better than."""
    verdict = replace(judgement.verdict, status="unknown", best=None, rivals=())
    odds = consistent("unknown", judgement.odds, judgement.verdict.best is None)
    return replace(judgement, verdict=verdict, odds=odds, worse=judgement.worse_alone)


def objections(evidence: AllEvidence, verdict: SearchVerdict) -> list[str]:
    """Sentences on what speaks against a verdict so that it is unknown; none for one that stands.

    That a point which was not fitted refutes it has its own note.
    """
    found = []
    if verdict.best is not None:
        found.append(objection(verdict.status, " with ".join(verdict.best.keys), evidence.gone, evidence.by_fitted))
    if evidence.worse and verdict.status not in ("unknown", "partial"):
        found.append(WORSE.format(records=", ".join(evidence.worse)))
    if verdict.status == "no_disagreement":
        nothing = sum(e.probability for e in evidence.odds if not e.effects and not e.beyond)
        found += [evidence.not_held] if evidence.refuted else []
        if evidence.odds and nothing < LEAST_NOTHING:
            found.append(NOT_LIKELY.format(share=f"{100 * nothing:.0f} %", least=f"{100 * LEAST_NOTHING:.0f} %"))
        found += [] if evidence.scatter_known or evidence.large else [NO_ACCURACY]
        found += [evidence.late, evidence.growing, evidence.unclear, evidence.together if nothing < SURE else ""]
    return [one for one in found if one]


def accuracy_notes(accuracy: float, scatter: float, groups: Sequence[Misfit], answered: bool = False) -> list[str]:
    """Sentences on a stated accuracy [m] that contradicts the records: their scatter [m], or the misfit of groups.

    That misfit speaks against the accuracy only where no verdict has `answered` it, and where an accuracy of its size
    leaves no group beyond the floor. An accuracy is too coarse by what an order or a band leaves in all records.
    """
    own = [f for f in groups if f.group not in ("slow", "between", UNSTEADY)]
    loud = [f.rms for f in own]
    if not accuracy or not loud:
        return []
    parts = [[f for f in own if f.group == name] for name in {f.group for f in own}]
    left = max(sqrt(sum(f.numbers * f.rms**2 for f in part) / sum(f.numbers for f in part)) for part in parts)
    sizes = {"accuracy": accuracy * TO_UM, "scatter": scatter * TO_UM, "left": max(loud) * TO_UM}
    beyond = [f for f in flagged(list(groups)) if f.group != "slow"]
    if scatter > BELOW * accuracy:
        return [TOO_FINE.format(**sizes)]
    if not answered and beyond and max(f.rms for f in beyond) < 2 * CONTRADICTED * accuracy:
        coarser = [replace(f, chi2=f.numbers * (f.rms / max(f.floor, *loud)) ** 2) for f in beyond]
        return [] if flagged(coarser) else [WITHIN.format(**sizes)]
    if max(left, scatter) < accuracy / CONTRADICTED:
        shown = sizes | {"left": left * TO_UM}
        return [TOO_COARSE.format(**shown, times=accuracy / max(left, scatter))]
    return []


def consistent(status: str, odds: Sequence[Explanation], nothing_refuted: bool = False) -> tuple[Explanation, ...]:
    """Odds that do not contradict a verdict.

    Where no name is given no effect alone explains the records, and where they refute it nothing missing does not
    either: such an explanation leaves its probability to the same one with something beyond the catalogue.
    """
    no_name = status in ("unknown", "partial")
    moved: dict[tuple[tuple[str, ...], bool], Explanation] = {}
    for e in sorted(odds, key=lambda e: (not e.beyond, -e.probability, e.name)):
        refuted = no_name and (bool(e.effects) or nothing_refuted)
        key = e.effects, e.beyond or refuted
        same = moved.get(key)
        if same is None:
            moved[key] = replace(e, beyond=key[1], unseen=() if refuted else e.unseen)
        else:
            moved[key] = replace(same, probability=same.probability + e.probability)
    return tuple(sorted(moved.values(), key=lambda e: (-e.probability, e.name)))


def nameless(odds: Sequence[Explanation], refuted: bool) -> tuple[Explanation, ...]:
    """Odds where nothing has a name and no group of lines is beyond its floor.

    Where all records together do not refute that nothing is missing they stay as they are.
    """
    if not refuted or not odds:
        return tuple(odds)
    prior = {NOTHING: REFUSED * PRIORS[0], True: ELSE, False: NAMELESS * sum(p for n, p in PRIORS.items() if n)}
    kinds = [NOTHING if e.name == NOTHING else e.beyond for e in odds]
    total = {kind: sum(e.probability for e, own in zip(odds, kinds, strict=True) if own == kind) for kind in prior}
    whole = sum(share for kind, share in prior.items() if total[kind] > 0)
    own = (replace(e, probability=prior[kind] / whole * e.probability / total[kind], unseen=())
           for e, kind in zip(odds, kinds, strict=True) if total[kind] > 0)  # fmt: skip
    return tuple(sorted(own, key=lambda e: (-e.probability, e.name)))


def beyond_floor(comparison: TwinComparison, residual: np.ndarray) -> list[Misfit]:
    """Groups of lines of vibration beyond their floor: zeros of sensors and drifts are none."""
    return [f for f in flagged(table(comparison, residual)) if f.group != "slow"]


def seen_together(groups: Iterable[Misfit]) -> str:
    """Sentence on the orders of the shaft that all records show together; empty for none. Rows of vectors are left out,
    whose floor is that of their neighbours."""
    sums = {order: [f for f in groups if f.group == order and not f.speed] for order in TURNED}
    found = []
    for order, own in sums.items():
        count, chi2 = sum(f.numbers for f in own), sum(f.chi2 for f in own)
        if own and (chance := float(chdtrc(count, chi2))) < CHANCE:
            found.append(TOGETHER.format(order=order, chi2=chi2, count=count, chance=chance))
    return "; ".join(found)


def growing(trials: Sequence[Trial], residuals: Sequence[np.ndarray]) -> str:
    """Sentence on 1X that grows, or falls, by one share within nearly all records, as by heat; empty for none.

    `residuals` are measured less simulated lines (blocks, 2, lines) [m]: a motion that dies away is in both.
    """
    shares = list[float]()
    for trial, residual in zip(trials, residuals, strict=True):
        if trial.orders or trial.clock or trial.blocks < 2 or abs(trial.speed) < TURNING:
            continue
        at = int(np.argmin(np.abs(trial.frequencies - abs(trial.speed) / (2 * np.pi))))
        for c in range(len(trial.channels)):
            whole, change = trial.spectra[:, c, at].mean(), residual[-1, c, at] - residual[0, c, at]
            shares += [float((np.conj(whole) * change).real / abs(whole) ** 2)] if whole else []
    if len(shares) < FEWEST_GROWING:
        return ""
    mean, error = float(np.mean(shares)), float(np.std(shares)) / sqrt(len(shares))
    if abs(mean) < max(LEAST_GROWTH, GROWS * error) or np.mean(np.sign(shares) == np.sign(mean)) < MOST_ALIKE:
        return ""
    return GROWING.format(grows="grows" if mean > 0 else "falls", share=100 * abs(mean))


def with_vibration(
    trials: Sequence[Trial], residuals: Sequence[np.ndarray], answers: Callable[[Trial, int], np.ndarray]
) -> str:
    """Sentence on a harmonic that comes with the vibration and is within what floors of a stated accuracy hide.

    `residuals` are as in `growing`; `answers` are vibrations (places,) [m/N] of a trial's probes by a force at an
    order. All probes of a record show such a harmonic, beyond that accuracy and clearly beyond the scatter. The force
    that makes it grows, from the half of the records that vibrate least to there, by twice what 1X does, wherever it
    acts; and records of that plane with as much 1X or more have as much of it.
    """
    able = [i for i, t in enumerate(trials) if t.accuracy and not (t.orders or t.clock) and abs(t.speed) > TURNING]
    able = [i for i in able if trials[i].blocks > 1 and not trials[i].excited.any()]
    if len(able) < FEWEST_GROWING:
        return ""
    scatter = own_scatter([trials[i] for i in able], [residuals[i] for i in able])

    def size(lines: np.ndarray, i: int, order: int) -> float:
        at = np.argmin(np.abs(trials[i].frequencies - order * abs(trials[i].speed) / (2 * np.pi)))
        return float(np.abs(lines.mean(axis=0)[: len(trials[i].channels), at]).min())

    turning = {i: size(trials[i].spectra, i, 1) for i in able}
    quiet = sorted(able, key=turning.__getitem__)[: len(able) // 2]
    for order in HARMONICS:
        seen = [i for i in able if trials[i].frequencies[-1] > order * abs(trials[i].speed) / (2 * np.pi)]
        shown = {i: size(residuals[i], i, order) for i in seen if not trials[i].hum}
        least = {i: max(scatter, COPIES * trials[i].accuracy) for i in shown}
        still = [i for i in quiet if i in shown]
        clear = [i for i in shown if shown[i] > max(sqrt(2) * trials[i].accuracy, CLEARLY * least[i])]
        if not clear or not still:
            continue
        force = {i: max(shown[i], least[i]) / answers(trials[i], order) for i in shown}
        less, small = np.median([force[i] for i in still], axis=0), float(np.median([turning[i] for i in still]))
        for i in sorted(clear, key=shown.__getitem__, reverse=True):
            more = [j for j in shown if turning[j] >= turning[i] and _plane(trials[j]) == _plane(trials[i])]
            as_large = np.min([force[j] for j in more], axis=0) > force[i] / STEEPER
            if np.all(force[i] * small > STEEPER * turning[i] * less) and np.any(as_large):
                return WITH_VIBRATION.format(
                    order=order, size=shown[i] * TO_UM, point=trials[i].point.partition(",")[0],
                    less=float(np.median([shown[j] for j in still])) * TO_UM, large=turning[i] * TO_UM,
                    small=small * TO_UM, times=shown[i] / trials[i].accuracy,
                )  # fmt: skip
    return ""


def _plane(trial: Trial) -> float:
    return trial.changes.get(PLANE, MAIN)


def worse_than(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> tuple[str, ...]:
    """Records in which whitened residuals (n,) `after` are larger [m] than `before` by the floor, and beyond it."""
    beyond = {f.number for f in beyond_floor(comparison, after)}
    moving = comparison.layout.frequency > 0
    old, new, floor = (
        np.sqrt(np.bincount(comparison.layout.record, np.where(moving, (r * comparison.sigma) ** 2, 0.0)))
        for r in (before, after, np.ones(len(after)))
    )
    return tuple(t.name for i, t in enumerate(comparison.trials) if i in beyond and new[i] > old[i] + floor[i])


def untouched_gone(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> float | None:
    """Share of the gap that goes from one whitened residual (n,) to another; None if no group is beyond its floor.

    Negative where the gap grows, minus infinity where there was none.
    """
    tables = [table(comparison, residual) for residual in (before, after)]
    beyond = {_place(f) for groups in tables for f in flagged(groups)}
    if not beyond:
        return None
    # sums of squares [m^2] of the groups beyond their floor
    old, new = (
        max(sum(f.numbers * (f.rms**2 - f.floor**2) for f in groups if _place(f) in beyond), 0.0) for groups in tables
    )
    return 1 - sqrt(new / old) if old > 0 else -inf


def fitted_gone(comparison: TwinComparison, before: np.ndarray, after: np.ndarray) -> float | None:
    """Share of the gap of fitted records that goes, as that of untouched ones; negative where their whole gap grows."""
    share = untouched_gone(comparison, before, after)
    old, new = (float(np.sum(rms(comparison, residual * comparison.sigma) ** 2)) for residual in (before, after))
    if new <= old:
        return share
    grown = 1 - sqrt(new / old) if old > 0 else -inf
    return grown if share is None else min(share, grown)


def objection(status: str, names: str, gone: float | None, by_fitted: bool = False) -> str:
    """Sentence that refuses a verdict for the share of the gap that goes; empty where nothing does.

    The gap is that of untouched records or, `by_fitted`, of the fitted ones.
    """
    if gone is None or gone >= (LEAST_FITTED if by_fitted else LEAST_GONE).get(status, -inf):
        return ""
    found = f"only {100 * gone:.0f} % of the gap goes" if gone > 0 else "the gap does not get smaller"
    where = "the fitted records, and none is untouched" if by_fitted else "untouched records"
    return f"with {names} {found} on {where}: not confirmed, nothing is named"


def _place(flag: Misfit) -> tuple[int, str, str]:
    return flag.number, flag.channel, flag.group


def by_odds(verdict: SearchVerdict, odds: Sequence[Explanation], known: Iterable[str]) -> SearchVerdict:
    """The verdict of a search as the odds have it; unchanged where there are none."""
    if not odds:
        return verdict
    nothing = sum(e.probability for e in odds if not e.effects and not e.beyond)
    beyond = sum(e.probability for e in odds if e.beyond)
    if nothing >= SURE and verdict.status != "no_disagreement":
        return replace(verdict, status="no_disagreement", best=None, rivals=(), classes=())
    if verdict.status in ("named", "tie") and verdict.best is not None:
        if beyond > LIKELY:
            return replace(verdict, status="partial", rivals=())
        return _of_names(verdict, verdict.best, odds, set(known))
    return _most_probable_part(verdict, odds, set(known)) if verdict.status == "partial" else verdict


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

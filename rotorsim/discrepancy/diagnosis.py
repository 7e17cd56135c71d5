"""Diagnosis of a machine file by records: locate the misfit, re-calibrate, search for the missing effect, judge."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.cache import Cache
from rotorsim.base.errors import DataError, NoAnswerError
from rotorsim.discrepancy.calibration import (
    GRID,
    SHEAR,
    STEP,
    CompiledModels,
    ParameterPoint,
    Progress,
    calibration,
)
from rotorsim.discrepancy.candidates import Form, acting_at, candidates, prior_sizes
from rotorsim.discrepancy.changes import MAIN, PLANE, known_changes, notes_on_changes
from rotorsim.discrepancy.comparison import (
    THREADS,
    UNSTEADY,
    Misfit,
    TwinComparison,
    excess,
    flagged,
    table,
    unsteady,
)
from rotorsim.discrepancy.data_vector import (
    TOLERANCE,
    own_scatter,
    scatter_of_repeats,
    unknown_sources,
    without_hum,
    without_probe_drift,
)
from rotorsim.discrepancy.decision import check_allowed
from rotorsim.discrepancy.discovery import (
    BY_PLANT,
    MOST_LAWS,
    NOT_IDENTIFIABLE,
    OF_FILM,
    PRICE,
    LawTerm,
    ProposedLaw,
    after_choice,
    beyond_film,
    beyond_steady,
    candidate_laws,
    cannot_tell,
    discovered,
    laws_of,
    not_excluded,
    priced,
    promised_fall,
    remembering,
    solved,
    stability_of,
    with_rival,
)
from rotorsim.discrepancy.equivalent_input import equivalent_inputs
from rotorsim.discrepancy.fit import (
    AS_FAR,
    MOST_REPEATS,
    NEAR,
    ONE_FAR,
    ParameterFit,
    covariance,
    fall,
    far_off_file,
    far_places,
    finished,
    fit_parameters,
    most_simulations,
    null_vectors,
    recalibrate,
    relinearised,
    strained,
)
from rotorsim.discrepancy.force_shape import shape_of
from rotorsim.discrepancy.gap import (
    equivalent_force,
    gap_dataset,
    gap_of,
    missed_bands,
    reduction,
    rms,
    spectra_of,
    virtual_readings,
)
from rotorsim.discrepancy.hidden_mass import (
    SolvedLaw,
    borne_out,
    by_linear_model,
    going_with,
    in_plant,
    law_with_memory,
)
from rotorsim.discrepancy.hypotheses import CLEAR, ENOUGH, TIE, EffectSearch, Hypothesis, beyond_form_error, share_gone
from rotorsim.discrepancy.judge import (
    HARMONICS,
    LIKELY,
    AllEvidence,
    Judgement,
    accuracy_notes,
    beyond_floor,
    by_odds,
    fitted_gone,
    growing,
    judged,
    seen_together,
    untouched_gone,
    with_vibration,
    withdrawn,
    worse_than,
)
from rotorsim.discrepancy.law_terms import ObservedPlaces, law_places, order_forces, probe_answers
from rotorsim.discrepancy.linear_columns import LinearColumns, not_sure
from rotorsim.discrepancy.machine_file import CLOCK, IdentifiedEffect, far_off
from rotorsim.discrepancy.mistakes import (
    SAMPLED,
    LateProbes,
    check_alternatives,
    check_before,
    check_late,
    force_is_sampled,
    held,
)
from rotorsim.discrepancy.records import (
    UNTESTED,
    check_after,
    check_plane,
    check_ring,
    data_hash,
    limits,
    make_trials,
    open_records,
    plane_notes,
    record_notes,
    reference_notes,
    unexplained,
)
from rotorsim.discrepancy.result import (
    EXCLUDED,
    Diagnosis,
    Planner,
    calibration_of,
    evidence_of,
    found_of,
    null_sentence,
    related_of,
)
from rotorsim.discrepancy.run_ups import RunupTrial, is_table, make_sweeps, rate_notes, with_tables
from rotorsim.discrepancy.stochastic import NotRepeated
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import (
    MORE,
    SURE,
    TEMPERATURE,
    TIE_LEAST,
    Explanation,
    SearchVerdict,
    explanation_odds,
    joined_classes,
    judge,
    one_of_each_class,
    probability_of,
    with_more,
    with_other,
)
from rotorsim.effects import REGISTRY
from rotorsim.machine import Machine, load_machine
from rotorsim.plant.locations import DRIVEN
from rotorsim.plant.mesh import Mesh

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.discrepancy.ranking import ExperimentPlan

SOLVER_LEFT = 0.5
"""Share of what the solver's error moves a number by that is taken to remain in it: the proof is one refinement."""
UNSETTLED = 5.0
"""Solver's error with the effects at work, in floors (root mean square), from which on the motion is not settled."""
FLOORS = 3.0
"""Factor by which a floor may be too small that nothing states or measures; standard deviations grow with it."""
SWEEP_REPEATS = 10
"""Most repeats of the re-calibration to a run-up's vectors."""
FAINT = "no group of lines is beyond the floor by itself; the effect shows in all together (chi-square falls by {:.0f})"
"""Note on an effect that no single group shows."""
SEEN_FROM = (
    "these records would have shown each of these forms, alone in the machine and wherever it acts, from about these "
    "sizes on; smaller ones may be there, larger ones too of another form (a stop on one side is no rub all round) or "
    "two together, and 'never' is what the calibration takes up. The smallest share of a usual size comes first: {}"
)
"""Note on what the records could show."""
MOST_SEEN = 6
"""Most of these forms that the note lists; the stored verdict has all."""
NOT_SETTLED = (
    "with {} at work a finer grid and step and a longer run move the response by {:.0f} floors more than without: the "
    "solver does not settle the motion, and what is left may be that and not another effect"
)
"""Note on a motion that the solver does not settle."""
COMMON_DELAY = "the clock of each record is calibrated: a delay of the displacement sensors is a part of it"
"""Note on records whose clocks are calibrated."""
STRAINED = (
    "re-calibration ends where it is not believed ({}): what is missing leads it astray, or the machine is another one"
)
"""Note on a calibration beyond its limits or priors."""
UNCLEAR = (
    "the records ask for numbers which are not believed, and none of these is far from the file beyond its own "
    "uncertainty: {}. That shows neither a fault nor agreement"
)
"""Note on a calibration that is far from the machine file without a number that is so."""
HINT = (
    "below what a name takes: with {names} the sum of squares falls by {fall:.0f}, and a name takes {least:.0f}; look "
    "there first"
)
"""Note on the effects that help most where no group of lines is beyond the floor and no name is given."""
ONE_OF = "one of these places, which the records do not distinguish: {}"
"""Finding of a calibration that has several places."""
NAMED_PROBES = "x and y of the sensors are the probes {0} and {1}, in their own directions"
"""Note on records whose channels are their probes."""
FAINT_HINT = 2 * ONE_FAR
"""Fall of the sum of squares by an effect from which on a note states it where no name is given."""
MOST_ROUNDS = 10
"""Most rounds in which a calibration that no group disturbs converges."""
FINER = 0.1
"""Share by which the tolerance that records show is below the declared one where a law is fitted with it."""
THICK = 0.1
"""Share of shear in the compliance of a shaft's first bending mode above which its change to first order is wrong."""
EXACT = (
    "with the law the records agree with the machine to {:.2g} % of a line, better than the declared tolerance of "
    "{:.2g} %: its numbers are fitted with that"
)
"""Note on a law that leaves less than the declared tolerance."""
NO_LAW = "a law was looked for at all places; the nearest, {name}, {taken} and is not given: {reason}"
"""Note on records that show no law either."""
AS_NEAR = (
    "a law was looked for at all places; the best one, {}, and {} leave nearly the same sum of squares of all records, "
    "held-out ones too: a tie, and the law is not given"
)
"""Note on a law that effects of the catalogue nearly equal."""
NONE_CLEAR = (
    "a law was looked for at all places; none explains the records clearly better than calibration and catalogue do"
)
"""Note on records of which no law is better."""
NO_MEMORY = (
    "a spring that slips and a hidden mass, whose forces remember the motion, were tried too; the nearest, {name}, "
    "{taken} and is not given: {reason}"
)
"""Note on laws with a memory that the records do not show either."""
TAKEN, TOGETHER = "takes {} % of what is beyond the floor", "shows in all groups of lines together, in none by itself"
"""Shares of the misfit that a law takes."""
LITTLE = "a law takes 95 %"
NOT_BORNE_OUT = "records that were not fitted do not bear it out, or another law or effect explains them as well"
AT_END = "{} ends at the limit of what is searched, where it is another law"
"""Reasons for which a law is not given."""
TOO_UNSTEADY = (
    "a law was looked for at all places; the best one, {}, is not fitted: a law has to take 95 % of the misfit, and "
    "more than the rest does not repeat from period to period"
)
"""Note on records of which no law can be borne out."""
WITHDRAWN = "{} is not given either: the law that is not borne out leaves a smaller sum of squares"
"""Note on a name or a tie that is not given."""
NEEDLESS = (
    "{} is not given: no group of lines shows it, and next to a calibration that has converged, the shear of the shaft "
    "among its numbers, it explains hardly more than that alone"
)
"""Note on a name or a tie that made up for a calibration that had not converged."""
NO_PEACE = (
    "no group of lines is beyond its floor by itself, but a law explains all of them together clearly better than the "
    "calibration does: whether nothing is missing stays open"
)
"""Note on records that agree line by line alone."""
NOT_REPEATED = "the records also have what does not repeat, which would be: {}"
"""Note on what does not repeat where the gap that repeats is not explained, or where nothing disagrees."""
OF_INPUT = (*DRIVEN, "actuator")
"""Ports of the effects at the input of the injectors."""
OTHER_FORCE = Explanation((), True, 0.0, 0.0, True)
"""Explanation by a force that is not in the catalogue."""
NO_ANSWER = "the search for effects met numbers that overflow or a singular matrix; nothing is named"
"""Note on a search without finite numbers."""


def diagnose(
    machine: Machine | str | Path,
    records: Iterable[Any],
    held_out: Iterable[Any] | None = None,
    untouched: Iterable[Any] | None = None,
    effects: Iterable[str] | None = None,
    seed: int = 0,
    tolerance: float = TOLERANCE,
    mapping: Any = None,
    models: CompiledModels | None = None,
    threads: int = THREADS,
    progress: Progress = lambda stage, most=0: None,
    resume: str | Path | None = None,
    plan_next: Iterable[str] | None = None,
    noted: Callable[[str], None] = lambda note: None,
) -> Diagnosis:
    """Compare a machine file with measured records, and identify the missing effect.

    Parameters
    ----------
    machine : Machine, name or path
        The machine as it is believed to be.
    records : Datasets or paths
        Records at constant operating points, tables of run-up vectors, and run-ups or coast-downs over time with an
        angle, which become such tables; of one kind or of several. Where `held_out` and `untouched` are not given,
        their attribute `role` states their use; without one records are fitted, and a table has rows for each use.
    held_out, untouched :
        Records at other operating points that choose the effect, and that only show the gap.
    effects : names
        Candidates: effects or their forms ('runout', 'runout.amplitude_2x'); the whole catalogue when not given.
    seed : int
        Kept with the verdict; nothing in the search is drawn, so that it changes nothing.
    tolerance : float
        Declared tolerance of the model, as a share of every line.
    progress : function of a stage's name and the most steps that it takes
        Called with each step of the work; the number is 0 where it is not known.
    resume : folder
        Where to keep what was computed, so that an interrupted diagnosis resumes; yours to delete once it is done.
    plan_next : names, optional
        Rank the experiments that may come next. The names, of `decision.ALLOWED`, may differ from the records;
        all that the machine can do for an empty one. `Diagnosis.planned` has them.
    noted : function
        Called, before anything is computed, with each sentence on the records that may make the work useless.

    Returns
    -------
    Diagnosis

    Raises
    ------
    DataError
        If the records cannot be used, with one sentence.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.diagnose("dtu_gas_bearing", "puzzle/records")  # doctest: +SKIP
    >>> found.sentence  # doctest: +SKIP
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    allow = None if plan_next is None else check_allowed(plan_next)
    cache = None if resume is None else Cache(Path(resume))
    parts = {role: with_tables(open_records(given or (), mapping)) for role, given in
             (("fit", records), ("held_out", held_out), ("untouched", untouched))}  # fmt: skip
    every = [one for part in parts.values() for one in part]
    unknown = reference_notes(machine, every)
    for note in unknown:
        noted(note)
    stated = held_out is None and untouched is None
    trials = [t for role, part in parts.items() for t in trials_of(machine, part, None if stated else role)]
    if any(not t.orders for t in trials):
        trials = [replace(t, alone=False) if isinstance(t, RunupTrial) else t for t in trials]
    found = diagnose_trials(machine, trials, effects, tolerance, progress, models, threads, cache, allow)
    tables = [(name, record) for name, record in every if is_table(record)]
    notes = *unknown, *record_notes(every), *plane_notes(machine, every), *rate_notes(tables), *found.notes
    return replace(found, notes=notes)


def trials_of(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]], role: str | None) -> list[Trial]:
    """Trials of records over time and of tables of vectors, all of one role, or of the roles that they state."""
    tables = [(name, record) for name, record in opened if is_table(record)]
    others = [(name, record) for name, record in opened if not is_table(record)]
    return [*make_trials(machine, others, role), *vector_trials(machine, tables, role)]


def vector_trials(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]], role: str | None = None) -> list[Trial]:
    """Trials of tables of vectors; of six rows one is held out and one untouched, where no role is stated for all."""
    for name, vectors in opened:
        check_plane(machine, vectors.attrs.get("disc_position"), name)
    found = [
        replace(sweep, changes=known_changes(machine, vectors.attrs.get("changes"), name))
        for name, vectors in opened
        for sweep in make_sweeps(vectors, name, machine.film is not None, role or str(vectors.attrs.get("role", "")))
    ]
    for sweep in found:
        check_ring(machine, sweep)
    return list(found)


def diagnose_trials(
    machine: Machine, trials: Sequence[Trial], effects: Iterable[str] | None, tolerance: float, progress: Progress,
    models: CompiledModels | None = None, threads: int = THREADS, cache: Cache | None = None,
    allow: tuple[str, ...] | None = None,
) -> Diagnosis:  # fmt: skip
    """Diagnosis of prepared trials, with the next experiment among those that `allow` names."""
    trials, hum = without_hum(trials)
    trials, drifting = without_probe_drift(trials)
    by_role = {role: [t for t in trials if t.role == role] for role in ("fit", "held_out", "untouched")}
    if not by_role["fit"]:
        raise DataError("diagnose: no records to fit; give some, or set the attribute role")
    forms = candidates(Twin(machine, GRID, STEP) if models is None else models.twin, effects)
    forms, left_out = for_probes(by_probe(forms, trials), trials)
    models = models or CompiledModels.of(machine, None if effects is None else {f.effect for f in forms}, progress)
    parts = {role: TwinComparison(models.twin, own, threads, cache=cache) for role, own in by_role.items() if own}
    found = DiagnosisRun(machine, models, parts, forms, trials, tolerance, progress, allow).run()
    return replace(found, notes=(*found.notes, *left_out, *hum, *drifting))


def by_probe(forms: tuple[Form, ...], trials: Sequence[Trial]) -> tuple[Form, ...]:
    """Forms with those of the sensors for every probe, or every plane, of several planes: each errs by itself."""
    planes = {t.changes.get(PLANE, MAIN): t.names for t in trials}
    if len(planes) < 2:
        return forms
    out: list[Form] = []
    for form in forms:
        own = REGISTRY[form.effect].port == "sensor"
        for z, names in planes.items() if own else ():
            axis = form.parameters[0].key.partition("~")[0].rpartition(".")[2].rpartition("_")[2]
            if axis in ("x", "y") and len(names) == 1:
                continue
            where = names["xy".index(axis)] if axis in ("x", "y") and names else _plane_of(z, names)
            label, _, shape = form.label.partition(" @ ")
            label = f"{label} of {where}" + (f" @ {shape}" if shape else "")
            own_sizes, shapes = (tuple(replace(k, plane=z) for k in part) for part in (form.parameters, form.refine))
            out.append(replace(form, label=label, parameters=own_sizes, refine=shapes))
        out += [] if own else [form]
    return tuple(sorted(out, key=lambda f: f.label))


def _plane_of(z: float, names: tuple[str, ...]) -> str:
    """The probes of a plane as text."""
    return " and ".join(names) or ("the probes of the disc" if z == MAIN else f"the probes at {1e3 * z:.6g} mm")


def for_probes(forms: tuple[Form, ...], trials: Sequence[Trial]) -> tuple[tuple[Form, ...], list[str]]:
    """Forms that can be candidates with the trials' probes, and a sentence on the others."""
    others = sorted({f.key for f in forms if f.axes_only})
    if not others or not any(t.off_axes for t in trials):
        return forms, []
    sentence = f"one probe that stands neither along x nor along y: {', '.join(others)} cannot be candidates"
    kept = tuple(f for f in forms if not f.axes_only)
    if not kept:
        raise DataError(f"diagnose: {sentence}; give other effects")
    return kept, [sentence]


def _most_probable(
    best: Hypothesis | None, verdict: SearchVerdict, odds: Sequence[Explanation]
) -> Hypothesis | None:  # fmt: skip
    """The hypothesis with the largest probability among the one that a search accepts and all that were fitted."""
    if best is None:
        return None
    fitted = [h for h in verdict.fitted if not h.failed and h.excess <= best.excess + MORE]
    return max([best, *fitted], key=lambda h: (probability_of(h.keys, odds), -h.fit.cost))


def _at_input(best: Hypothesis | None) -> bool:
    """Whether a hypothesis acts at the input of the injectors: on references, amplifiers or piezos."""
    return best is not None and all(REGISTRY[f.effect].port in OF_INPUT for f in best.forms)


def refused(name: str, gone: float, sentence: str = NO_LAW, ended: Sequence[str] = ()) -> str:
    """Sentence on the law that came nearest, with the share of the misfit that it takes, and why it is not given.

    The share is NaN where no group is beyond the floor; `ended` has the numbers of its shape that are at a limit.
    """
    reason = AT_END.format(" and ".join(ended)) if ended else LITTLE if gone < ENOUGH else NOT_BORNE_OUT
    taken = TOGETHER if np.isnan(gone) else TAKEN.format(int(100 * max(gone, 0.0)))
    return sentence.format(name=name, taken=taken, reason=reason)


def at_end(law: Hypothesis) -> tuple[str, ...]:
    """Numbers of a law's shape that its fit leaves at a limit: a spring with no reach is dry friction."""
    shapes = [k for form in law.forms for k in form.refine]
    return tuple(k.key.rpartition(".")[2] for k in shapes if not k.low < law.fit.point.values.get(k, 0.0) < k.high)


@dataclass(eq=False)
class DiagnosisRun:
    """Run of a diagnosis: locate the misfit, calibrate, search, judge, report."""

    machine: Machine
    models: CompiledModels
    parts: dict[str, TwinComparison]
    forms: tuple[Form, ...]
    trials: Sequence[Trial]
    tolerance: float
    progress: Progress
    allow: tuple[str, ...] | None = None
    large: tuple[str, ...] = field(default=(), init=False)
    """Sentences on calibrated numbers that are far from the machine file."""
    far_bearings: tuple[int, ...] = field(default=(), init=False)
    """Numbers of the bearings that those sentences are about."""
    place: str | None = field(default=None, init=False)
    """Number of the far bearing as text, empty for none; None where the records leave open which it is."""
    unclear: str = field(default="", init=False)
    """Sentence on a calibration far from the machine file without a number that clearly is."""
    converged: tuple[ParameterFit, ParameterFit, np.ndarray] | None = field(default=None, init=False, repr=False)
    """A calibration without an effect, the same converged, and the covariance (k, k) of that."""
    late: LateProbes | None = field(default=None, init=False)
    """Late probes with which the records fit better."""
    tried: tuple[Hypothesis, ...] = field(default=(), init=False, repr=False)
    """Hypotheses that were fitted."""
    growing: str = field(default="", init=False)
    """Sentence on 1X that changes within the records, or on a harmonic that comes with the vibration."""
    contradiction: str = field(default="", init=False)
    """Sentence on a stated accuracy that contradicts the records."""
    unexplained_places: tuple[ObservedPlaces, ParameterFit] | None = field(default=None, init=False, repr=False)
    """Observed places, and their calibration, of groups that no effect and no law explains."""
    seen_from: dict[str, str] = field(default_factory=dict, init=False)
    """Sizes from which the records would have shown candidates."""
    force_held: bool = False
    """Whether sampled forces have been turned into held ones."""
    from_file: bool = True
    """Whether effects are fitted from the machine file's own numbers too, where the calibration is not believed."""
    laws: tuple[ProposedLaw, ...] | None = None
    """Laws that the candidates are, where they come from the records and not from the catalogue."""

    @property
    def fitted(self) -> TwinComparison:
        """Comparison of the records to fit."""
        return self.parts["fit"]

    def run(self) -> Diagnosis:
        """All steps of the diagnosis in order."""
        self.progress("check")
        check_before(self.fitted, self.fitted.predict(ParameterPoint()))
        # resonances that a run-up passes are strongly nonlinear in what is calibrated
        sweeps = any(t.orders for t in self.fitted.trials)
        repeats, enough = (SWEEP_REPEATS, 0.99) if sweeps else (MOST_REPEATS, 0.95)
        step = self._steps("calibrate", most_simulations(calibration(self.fitted.twin), repeats))
        models = self.models
        base = recalibrate(self.fitted, models.fine, self.tolerance, step, models.law)
        fitted = self.fitted.measured - base.residual * self.fitted.sigma
        notes = [*self._notes_on_records(), *check_after(self.fitted, fitted)]
        for _ in range(repeats):
            if not flagged(table(self.fitted, base.residual)):
                break
            last, base = base.cost, relinearised(self.fitted, base, step)
            if base.cost > enough * last:
                break
        if not self.force_held and flagged(table(self.fitted, base.residual)) and force_is_sampled(self.fitted, base):
            return self._with_held_force()
        base = self._placed(base, step)
        beyond = strained(base)
        notes += [STRAINED.format(", ".join(beyond))] if beyond else []
        quiet = not flagged(table(self.fitted, base.residual))
        if quiet:
            self._settle(base)
        if not quiet or self.large or self.unclear:
            nominal = self.fitted.stored.columns(ParameterPoint(), base.parameters)
            self.late = check_alternatives(self.fitted, base, nominal)
        assert self.fitted.scatter is not None
        blocks, groups = self.fitted.apart(base.point), table(self.fitted, base.residual)
        self.growing = self._changing(base, blocks)
        apart = unsteady(self.fitted.trials, blocks, self.fitted.scatter[0])
        flags = flagged(groups) + apart
        for role in ("held_out", "untouched"):
            if role in self.parts:
                self.progress("prove")
                self.parts[role].set_floor(base.point, models.fine, self.tolerance, *(models.law or ()))
        try:
            verdict, search = self._name(base, flags, apart)
        except NoAnswerError:
            verdict, search = SearchVerdict("unknown"), None
            notes.append(NO_ANSWER)
        judgement = self._judged(base, flags, verdict, search, unexplained(self.fitted, fitted))
        if self.late is not None and judgement.verdict.status in ("unknown", "partial") and not self._acts_late():
            check_late(self.parts.values(), self.late)
        self.contradiction = self._contradicted(base, judgement, blocks, [*groups, *apart])
        notes += [*judgement.notes, *([self.contradiction] if self.contradiction else [])]
        if judgement.verdict.best is not None and not flags:
            notes.append(FAINT.format(base.cost - judgement.verdict.best.fit.cost))
        if judgement.verdict.status == "unknown" and not flags:
            notes += self._hints(base)
        other = None if self.laws is not None else self._beyond_catalogue(base, flags, apart, judgement, notes)
        if other is not None:
            return other
        if judgement.verdict.status in ("no_disagreement", "recalibrated") and self.seen_from:
            shown = [f"{key} {size}" for key, size in self.seen_from.items()]
            more = [f"and {len(shown) - MOST_SEEN} more"] if len(shown) > MOST_SEEN else []
            notes.append(SEEN_FROM.format("; ".join([*shown[:MOST_SEEN], *more])))
        return self._result(base, flags, judgement, search, notes)

    def _contradicted(
        self, base: ParameterFit, judgement: Judgement, blocks: list[np.ndarray], groups: Sequence[Misfit]
    ) -> str:  # fmt: skip
        """Sentence on a stated accuracy that contradicts the records; empty where it does not."""
        accuracy = max(t.accuracy for t in self.fitted.trials)
        scatter = max(own_scatter(self.fitted.trials, blocks), scatter_of_repeats(self.fitted.trials))
        answered = judgement.verdict.status not in ("unknown", "partial")
        best = base if judgement.verdict.best is None else judgement.verdict.best.fit
        others = [f for part in self.parts.values() if part is not self.fitted
                  for f in table(part, part.residual(best.point))]  # fmt: skip
        return next(iter(accuracy_notes(accuracy, scatter, [*groups, *others], answered)), "")

    def _steps(self, stage: str, most: int) -> Callable[[], None]:
        """Progress of a stage by its steps, with their largest number."""
        return partial(self.progress, stage, most)

    def _placed(self, base: ParameterFit, step: Callable[[], None]) -> ParameterFit:
        """The calibration, or that with one bearing far off where it explains the records better; sets what is far."""
        far = far_places(self.fitted, base, step) or [("", base)]
        self.place = far[0][0] if len(far) == 1 else None
        self._set_far(far)
        return far[0][1]

    def _set_far(self, fits: Sequence[tuple[str, ParameterFit]], V: np.ndarray | None = None) -> None:
        """Set the numbers of fits that are far from the machine file, or that none clearly is; as for `_large`."""
        self.large, self.far_bearings = self._large(fits, V)
        if self.large and not any(self._clearly_off(*one) for one in fits):
            self.unclear = UNCLEAR.format("; ".join(self.large))
            self.large, self.far_bearings, self.place = (), (), None

    def _settle(self, base: ParameterFit) -> None:
        """Set what is far by the converged calibration: headline and tables state the same numbers.

        What is far before it has converged alone stays a finding.
        """
        if self.place is None:
            return
        fit, V = self._converged(base)
        if self._large([(self.place, fit)], V)[0]:
            self._set_far([(self.place, fit)], V)

    def _converged(self, base: ParameterFit) -> tuple[ParameterFit, np.ndarray]:
        """A calibration without an effect as it is reported, and its covariance (k, k); found once for each."""
        if self.converged is None or self.converged[0] is not base:
            self.converged = base, *self._measured(base, self.fitted, base, "calibrate")
        return self.converged[1:]

    def _notes_on_records(self) -> list[str]:
        """Notes on what the records are, before anything is found in them."""
        notes = limits(self.fitted.trials, self.machine.film is not None)
        if not self.fitted.scatter_known:
            source = " and ".join(unknown_sources(self.fitted.trials))
            notes.append(f"no repeats and no periods: the floor comes from {source}")
        named = {t.names for t in self.fitted.trials if len(t.names) == 2 and not t.other_plane}
        notes += [NAMED_PROBES.format(*names) for names in sorted(named)]
        notes += notes_on_changes({t.name: t.stated_changes for t in self.trials})
        notes += [COMMON_DELAY] if any(t.clock for t in self.trials) else []
        return notes if "untouched" in self.parts else [*notes, UNTESTED]

    def _changing(self, base: ParameterFit, blocks: list[np.ndarray]) -> str:
        """Sentence on a motion that is not steady, or not linear; none with a gas film, which may remember."""
        if self.machine.film is not None:
            return ""
        answers, trials = partial(probe_answers, self.fitted.twin, base.point), self.fitted.trials
        return growing(trials, blocks) or with_vibration(trials, blocks, answers)

    def _with_held_force(self) -> Diagnosis:
        """Diagnosis of the same records with forces that are held from sample to sample; it is turned to once."""
        parts = {role: TwinComparison(part.twin, [held(t) for t in part.trials], part.threads, cache=part.cache)
                 for role, part in self.parts.items()}  # fmt: skip
        trials = [t for part in parts.values() for t in part.trials]
        found = replace(self, parts=parts, trials=trials, force_held=True).run()
        return replace(found, notes=(SAMPLED, *found.notes))

    def _beyond_catalogue(
        self, base: ParameterFit, flags: list[Misfit], apart: list[Misfit], judgement: Judgement, notes: list[str]
    ) -> Diagnosis | None:  # fmt: skip
        """Diagnosis with a law that no effect of the catalogue is, or with what does not repeat; None for neither.

        A law has to explain the records clearly better than the best effects of the catalogue, both next to a
        calibration that has converged: one that has not makes any further term look good. It is not looked for where a
        group of lines shows a calibration, or next to a film the name of a force or a film. A verdict that no group
        shows, and a tie that leaves groups beyond the floor where it was not fitted, are not given where such a law is
        not borne out, nor peace where a constant force is there. What does not repeat is the verdict where nothing else
        is open, and else a note; so is a random force next to a drift.
        """
        status = judgement.verdict.status
        lacking = cannot_tell(self.fitted.trials)
        unanswered = status in ("unknown", "partial")
        faint = not (unanswered or flags)
        named = status == "named" and (self.machine.film is None or _at_input(judgement.verdict.best))
        if not (unanswered or faint or named or status in ("tie", "no_disagreement")):
            return None
        if lacking:
            notes += [lacking] if unanswered else []
            return None
        self.progress("discover")
        rivals = [h for h in judgement.verdict.fitted if not h.failed]
        answered = named or status == "tie" or (self.machine.film is not None and not unanswered)
        try:
            best = judgement.verdict.best
            doubtful = faint and best is not None and self.machine.film is None
            if answered and not (doubtful or self._law_promises(base, rivals)):
                return None
            rough, base = base, self._with_shear(base)
            seen = {role: self._seen(part, base) for role, part in self.parts.items() if role != "untouched"}
            own = [note for note in notes if note not in judgement.notes]  # those are about the catalogue's verdict
            other = NotRepeated(base, seen["fit"])
            found = self._discovered(base, flags, apart, seen, own, rivals, other)
            if found and unanswered and flags and self.machine.film is None:
                found = self._or_with_memory(found, base, flags, apart, seen, own, rivals)
            if isinstance(found, Diagnosis):
                return found
            notes += [NOT_IDENTIFIABLE if found is None else found or NONE_CLEAR] if found != "" or unanswered else []
            self.unexplained_places = (seen["fit"], base) if unanswered and flags else None
            found = "" if found == OF_FILM else found
            if found and (faint or (status == "tie" and judgement.left)):
                return self._without_name(base, flags, judgement, notes)
            if doubtful and best is not None and self._needless(best, rough, base):
                return self._without_name(base, flags, judgement, notes, NEEDLESS)
            if found is None and faint and (named or status == "tie"):
                return self._without_name(base, flags, judgement, notes)
            if named or status == "tie" or (faint and status != "no_disagreement"):
                return None
        except NoAnswerError:
            return None
        if self.machine.film is not None:
            return None
        if not other.found:
            constant = found is None and faint
            return self._without_name(base, flags, judgement, notes) if constant else None
        refuted = bool(found) and status != "unknown"
        open_still = status == "partial" or refuted or other.repeating
        notes += [NOT_REPEATED.format(one.sentence) for one in other.found[0 if open_still else 1 :]]
        if open_still:
            return None
        elsewhere = [ObservedPlaces.of(part, base, part.residual(base.point), np.zeros((len(part.measured), 0)))
                     for role, part in self.parts.items() if role != "fit"]  # fmt: skip
        left = sum(len(other.repeating_in(one)) for one in elsewhere)
        nothing = Judgement(SearchVerdict("unknown"), judgement.odds, (), left, judgement.worse)
        self.unexplained_places = None
        given = self._result(base, flags, nothing, None, [note for note in notes if note not in judgement.notes])
        return replace(given, status="stochastic", stochastic=other.found[0])

    def _law_promises(self, base: ParameterFit, rivals: Sequence[Hypothesis]) -> bool:
        """Whether a law next to a calibration as it stands promises half of what makes it clearly better than rivals.

        None of them has converged, which makes the law look better than it is.
        """
        seen = ObservedPlaces.of(self.fitted, base, base.residual, base.J)
        law = laws_of(seen, None, base, self.machine.film is not None)[0]
        return min([base.cost, *map(priced, rivals)]) - law.priced >= CLEAR / 2

    def _with_shear(self, fit: ParameterFit, wanted: float = np.inf) -> ParameterFit:
        """A fit that has converged with the shaft's shear among its numbers: what a beam leaves is not for a law.

        It has not where a sum of squares that is `wanted` is out of reach, or after a few rounds where groups are
        beyond the floor; where none is, what further rounds take would pass for a law that all records together show.

        The shear of a thick shaft, whose stiffness is not linear in it, stays that of the machine file.
        """
        own = () if Mesh(self.machine).shear_share > THICK else (SHEAR,)
        fit = replace(fit, parameters=(*fit.parameters, *own))
        for _ in range(MOST_ROUNDS):
            last = fit
            fit = finished(self.fitted, fit, lambda: self.progress("discover"), central=False, wanted=wanted)
            done = np.isfinite(wanted) or min(last.cost - fit.cost, fall(fit)) < AS_FAR
            if done or flagged(table(self.fitted, fit.residual)):
                break
        return fit

    def _rivals_converged(self, rivals: Sequence[Hypothesis], law: float) -> list[Hypothesis]:
        """Two rivals of a law after they have converged: the nearest to the records, and the one that may come nearest.

        Sensitivities foretell how near each comes. The second one ends where those at its own point, the shaft's shear
        among them, do not promise half of the way to the priced sum of squares of the `law`.
        """
        near = sorted(rivals, key=priced)[:1]
        others = sorted((h for h in rivals if h not in near), key=lambda h: priced(h) - fall(h.fit))[:1]
        wanted = [np.inf] * len(near) + [law + CLEAR - priced(h) + h.fit.cost for h in others]
        pairs = zip([*near, *others], wanted, strict=True)
        return [replace(h, fit=self._with_shear(h.fit, end)) for h, end in pairs]

    def _rival(
        self, base: ParameterFit, rivals: Sequence[Hypothesis], law: float
    ) -> tuple[Hypothesis | None, float]:  # fmt: skip
        """The best rival of a law that leaves so much of records to fit, and the least total without a law."""
        best = min(self._rivals_converged(rivals, law), key=self._total, default=None)
        bare = base.cost + self._held(base)
        return best, bare if best is None else min(bare, self._total(best))

    def _total(self, one: Hypothesis) -> float:
        """Priced sum of squares over records to fit and held-out ones, by which effects and laws compete everywhere."""
        return priced(one) + self._held(one.fit)

    def _held(self, fit: ParameterFit) -> float:
        """Sum of squares that the numbers of a fit leave of held-out records."""
        part = self.parts.get("held_out")
        return 0.0 if part is None else float(np.sum(part.residual(fit.point) ** 2))

    def _needless(self, best: Hypothesis, rough: ParameterFit, base: ParameterFit) -> bool:
        """Whether an effect that was found next to a `rough` calibration helps little next to the converged one."""
        least = min(CLEAR, (rough.cost - priced(best)) / 2)
        if base.cost - priced(best) > least:
            return False
        return base.cost - priced(replace(best, fit=self._with_shear(best.fit))) < least

    def _without_name(
        self, base: ParameterFit, flags: list[Misfit], judgement: Judgement, notes: list[str], reason: str = WITHDRAWN
    ) -> Diagnosis:  # fmt: skip
        """Diagnosis without a tie or a verdict that no group shows: something else is better, or is as good."""
        best, rivals = judgement.verdict.best, judgement.verdict.rivals
        names = [" with ".join(h.keys) for h in (best, *rivals) if h is not None]
        notes += [reason.format(" or ".join(names)) if names else NO_PEACE] if NOT_IDENTIFIABLE not in notes else []
        return self._result(base, flags, withdrawn(judgement), None, notes)

    def _seen(self, part: TwinComparison, base: ParameterFit) -> ObservedPlaces:
        """Observed places of the records of a role, about the calibration."""
        J = base.J if part is self.fitted else part.jacobian(base.point, base.parameters)
        return ObservedPlaces.of(part, base, part.residual(base.point), J)

    def _discovered(
        self, base: ParameterFit, flags: list[Misfit], apart: list[Misfit], seen: dict[str, ObservedPlaces],
        notes: list[str], rivals: Sequence[Hypothesis], other: NotRepeated,
    ) -> Diagnosis | str | None:  # fmt: skip
        """Diagnosis with a law that is fitted and judged as any candidate; a sentence on one that is not borne out.

        None for one that no group shows and that may be an error of the model's form, which never has a resonance of
        its own, also where that is less clear but more likely than the effects' best. None is fitted where more than a
        law may leave does not repeat from period to period.

        Its sum of squares over records to fit and held-out ones, with the price of its coefficients, has to be clearly
        below that of the calibration and that of the best effects of the catalogue, its `rivals`, be they on the shaft
        or at an input; the sentence is empty where no law's is. Each law's has to be so next to what does not repeat
        (`other`) too: records that were made in the order of their speeds look like a law of the speed where something
        drifts.
        """
        laws = laws_of(seen["fit"], seen.get("held_out"), base, self.machine.film is not None)
        bare = base.cost + self._held(base)
        if bare - laws[0].total >= CLEAR:
            laws = [one for one in laws if self._beyond_drift(one, other)]
        if not laws or bare - laws[0].total < CLEAR:
            return ""
        law = laws[0]
        rival, known = self._rival(base, rivals, law.priced)
        # an effect that explains nearly all may leave a share of its own response by its form
        of_form = 0.0 if rival is None or rival.gone < ENOUGH else TIE * (bare - known)
        if known - law.total < max(CLEAR, of_form):
            # a name that no group shows is not given where a constant force, which it is not, is more likely
            faint = rival is not None and not flags and self.machine.film is None
            return None if faint and law.constant and law.probability(known) > LIKELY else ""
        # next to a film the plant may bear out more than the linear model does; it runs no law with a memory
        more = BY_PLANT if self.machine.film is not None and not law.remembers else 0.0
        if self._as_error_of_form(law, flags, seen["fit"], base, law.cost - more):
            return None if self.machine.film is None else OF_FILM
        if apart and sum(f.excess for f in apart) > (1 - ENOUGH) * sum(f.excess for f in flags):
            return TOO_UNSTEADY.format(law.names)
        if law.remembers:
            return self._of_memory(base, flags, laws, known, notes)
        # next to a film the linear model adds terms for what the film's own bending makes: laws of one term come first
        first = [one for one in laws if self.machine.film is not None and len(one.terms) == 1]
        found = self._fitted_laws(base, flags, apart, seen, notes, (rival, known), first, laws) if first else ""
        if isinstance(found, Diagnosis):
            return found
        return self._fitted_laws(base, flags, apart, seen, notes, (rival, known), laws)

    def _fitted_laws(
        self, base: ParameterFit, flags: list[Misfit], apart: list[Misfit], seen: dict[str, ObservedPlaces],
        notes: list[str], without: tuple[Hypothesis | None, float], laws: Sequence[ProposedLaw],
        further: Sequence[ProposedLaw] = (),
    ) -> Diagnosis | str | None:  # fmt: skip
        """Diagnosis with a law that the plant and other records bear out; as `_discovered` for none.

        `without` has the best effects of the catalogue and the least total without a law. With laws of
        `further` terms to come, one has to be believed next to a calibration that is, fitted from there alone, and none
        of those may promise to be clearly better.
        """
        (rival, known), law = without, (further or laws)[0]
        with candidate_laws(laws, self.models.twin) as forms:
            models = CompiledModels.of(self.machine, {key.split(".")[0] for form in forms for key in form.fixed})
            own = replace(self, models=models, forms=forms, laws=tuple(laws), allow=None, from_file=not further,
                          progress=lambda stage, most=0: self.progress("laws"),
                          parts={role: part.with_twin(models.twin) for role, part in self.parts.items()})  # fmt: skip
            own.large, own.far_bearings = self.large, self.far_bearings
            own.late, own.growing = self.late, self.growing
            verdict, search = own._name(base, flags, apart)
            judgement = own._judged(base, flags, verdict, search, 0.0)
            best, keys = judgement.verdict.best, {f.key for f in forms}
            less = 0.0 if rival is None else self._total(rival)
            odds = with_rival(judgement.odds, judgement.verdict.fitted, rival, lambda one: own._total(one) - less)
            odds = after_choice(odds, [*keys], law.tried)
            best = _most_probable(best, judgement.verdict, odds)
            others = [] if best is None else [e.name for e in odds if e.effects and not e.beyond
                                              and e.effects != best.keys and e.probability > EXCLUDED]  # fmt: skip
            p = 0.0 if best is None else probability_of(best.keys, odds)
            sure = p + sum(probability_of((name,), odds) for name in others if name in keys) >= SURE
            holds = best is not None and judgement.verdict.status != "partial" and len(best.forms) == 1
            ahead = 0.0 if best is None else known - own._total(best)
            if best is None or not (holds and sure and ahead > CLEAR):
                if best and rival and holds and 0 < ahead <= CLEAR and self._total(rival) == known:
                    return AS_NEAR.format(*(" with ".join(one.keys) for one in (best, rival)))
                near = min((h for h in judgement.verdict.fitted if not h.failed), key=priced, default=None)
                name, gone = (law.names, 0.0) if near is None else (" with ".join(near.keys), near.gone)
                return refused(name, gone if flags else np.nan)
            if ended := at_end(best):
                return refused(" with ".join(best.keys), best.gone if flags else np.nan, ended=ended)
            [proposal] = [one for one in laws if one.names == best.keys[0]]
            if further and (strained(best.fit) or promised_fall(further, seen["fit"], best.fit) >= CLEAR):
                return ""
            if self._as_error_of_form(proposal, flags, seen["fit"], base, best.fit.cost):
                return None if self.machine.film is None else OF_FILM
            best, exact = own._as_exact_as_shown(best)
            verdict = replace(judgement.verdict, best=best)
            notes = [*notes, *judgement.notes, *exact]
            # one floor for the sums of squares with the law and without it
            before = base
            base = replace(base, residual=own.fitted.residual(base.point)) if exact else base
            found = own._result(base, flags, replace(judgement, verdict=verdict, odds=odds), search, notes)
            law_found = discovered(
                proposal, found.effects[0], p, not_excluded(proposal, laws, others), seen["fit"],
                best.fit.residual * own.fitted.sigma, stability_of(proposal, laws, seen["fit"], before),
            )  # fmt: skip
        return replace(
            found, status="discovered", effects=(), ties=(), planner=None, seen_from=self.seen_from,
            discovered=law_found,
        )  # fmt: skip

    def _or_with_memory(self, found: Diagnosis | str, *given: Any) -> Diagnosis | str:
        """The finding, or a law with a memory: in place of none, and of several terms that leave more of the gap.

        Held-out records decide, as untouched ones choose nothing: several terms nearly make the loop of a spring behind
        dry friction.
        """
        single = isinstance(found, Diagnosis) and (found.discovered is None or len(found.discovered.kinds) == 1)
        other = "" if single else self._with_memory(*given)
        if isinstance(found, Diagnosis):
            gone = [reduction(one.gap, "held_out") for one in (found, other) if isinstance(one, Diagnosis)]
            return other if isinstance(other, Diagnosis) and gone[1] > gone[0] else found
        return other if isinstance(other, Diagnosis) else "; ".join(filter(None, (found, other)))

    def _with_memory(
        self, base: ParameterFit, flags: list[Misfit], apart: list[Misfit], seen: dict[str, ObservedPlaces],
        notes: list[str], rivals: Sequence[Hypothesis],
    ) -> Diagnosis | str:  # fmt: skip
        """Diagnosis with a law of one term with a memory, where no other law holds; a sentence on one not borne out.

        A spring behind dry friction is fitted to the plant, unless another form explains the records as well. Where the
        plant leaves more than one law may, the linear model judges it, whose motion is that of the records.
        """
        self.progress("remember")
        others, laws = (choose(seen["fit"], seen.get("held_out"), base) for choose in (laws_of, remembering))
        laws = sorted((replace(one, tried=one.tried + others[0].tried) for one in laws), key=lambda one: one.score)
        rival, known = self._rival(base, rivals, min(one.priced for one in laws))
        springs = [one for one in laws if not one.remembers]
        if all(one in springs or one.score >= laws[0].score + TIE_LEAST for one in (*laws, *others)):
            found = self._fitted_laws(base, flags, apart, seen, notes, (rival, known), springs[:MOST_LAWS])
            if isinstance(found, Diagnosis):
                return found
        return self._of_memory(base, flags, laws, known, notes, others)

    def _as_error_of_form(
        self, law: ProposedLaw, flags: list[Misfit], seen: ObservedPlaces, base: ParameterFit, cost: float
    ) -> bool:  # fmt: skip
        """Whether a law with this sum of squares may be an error of the model's form.

        A constant one is that no group shows, or that is late, and that stiffness, damping and mass nearly make; with
        a gas film any that linear forces, which change with the speed, nearly make.
        """
        if self.machine.film is not None:
            return not beyond_film(law, seen, base, cost)
        return law.constant and not ((flags and not law.late) or beyond_steady(law, seen, base))

    def _beyond_drift(self, law: ProposedLaw, other: NotRepeated) -> bool:
        """Whether a law explains clearly more than a drift does."""
        return other.beyond_drift(law.columns(other.seen)) - PRICE * len(law.coefficients) >= CLEAR

    def _of_memory(
        self, base: ParameterFit, flags: list[Misfit], laws: Sequence[ProposedLaw], known: float, notes: list[str],
        others: Sequence[ProposedLaw] = (),
    ) -> Diagnosis | str:  # fmt: skip
        """Diagnosis with the best of laws with a memory, by the linear model; a sentence where it is not borne out.

        A hidden mass is fitted to the plant. The plant cannot run the others: the calibration moves as each has it, and
        the law is solved once more from there. The better of both solutions counts, with its calibration. None of the
        `others`, whose forms are not these, may explain the records as well.
        """
        before = {role: part.residual(base.point) for role, part in self.parts.items()}
        solutions = list[SolvedLaw]()
        for law in laws:
            own = in_plant(law, base, self.parts, lambda: self.progress("laws"))
            both = [] if own is not None else [(law, base), self._moved_by(law, base)]
            seen = [(one, fit, {role: self._seen(part, fit) for role, part in self.parts.items()}) for one, fit in both]
            linear = [by_linear_model(*one) for one in seen]
            solutions.append(own or min(linear, key=lambda one: one.law.score))
        solutions.sort(key=lambda one: one.law.score)
        first, rivals = solutions[0], [one.law for one in solutions]
        if not borne_out(first, (*rivals, *others), self.parts, before, known):
            gone = share_gone(first.law.left, excess(table(self.fitted, before["fit"]))) if flags else np.nan
            return refused(first.law.names, gone, NO_MEMORY if others else NO_LAW)
        found = self._result(base, flags, Judgement(SearchVerdict("unknown"), ()), None, notes)
        gap = found.gap.copy(deep=True)
        gap["gap"].values[:, :, 2] = np.concatenate(
            [rms(part, first.left[role] * part.sigma) for role, part in self.parts.items()]
        )
        chosen = stability_of(first.law, rivals, self._seen(self.fitted, first.base), first.base)
        V = covariance(first.fit, self.fitted.layout.record)
        return replace(
            found, status="discovered", unknown={}, gap=gap, planner=None,
            discovered=law_with_memory(first, rivals, known, law_places(self.machine)[first.law.place], V, chosen),
            calibration=calibration_of(first.fit, V, first.base.parameters) | self._clocks(first.fit.point),
            related=related_of(first.fit, V),
        )  # fmt: skip

    def _moved_by(self, law: ProposedLaw, base: ParameterFit) -> tuple[ProposedLaw, ParameterFit]:
        """A law solved from the calibration that goes with it, and that calibration."""
        there = going_with(law, base)
        J = self.fitted.jacobian(there, base.parameters)
        moved = replace(base, point=there, residual=self.fitted.residual(there), J=J)
        parts = {role: self._seen(part, moved) for role, part in self.parts.items() if role != "untouched"}
        again = solved(parts["fit"], parts.get("held_out"), moved, law.place, law.terms)
        return replace(again, tried=law.tried), moved

    def _as_exact_as_shown(self, best: Hypothesis) -> tuple[Hypothesis, list[str]]:
        """A borne-out hypothesis, fitted with the tolerance that the records show with it; a note where it is finer.

        The floor of all records has that tolerance from then on.
        """
        parts, fit = self._with_tolerance(best.fit, 0.0)
        tolerance = self.fitted.tolerance_shown(fit.point, fit.residual * parts["fit"].sigma)
        if tolerance > (1 - FINER) * self.tolerance:
            return best, []
        self.parts, fit = self._with_tolerance(best.fit, tolerance)
        return replace(best, fit=fit), [EXACT.format(100 * tolerance, 100 * self.tolerance)]

    def _with_tolerance(
        self, fit: ParameterFit, tolerance: float
    ) -> tuple[dict[str, TwinComparison], ParameterFit]:  # fmt: skip
        """Comparisons by role with another tolerance of the model, and a fit under their floor by its own chord."""
        parts = {role: part.with_tolerance(fit.point, tolerance) for role, part in self.parts.items()}
        own, J = parts["fit"], fit.J * (self.fitted.sigma / parts["fit"].sigma)[:, None]
        return parts, fit_parameters(own, fit.point, fit.parameters, J, steps=3, progress=lambda: self.progress("show"))

    def _judged(
        self, base: ParameterFit, flags: list[Misfit], verdict: SearchVerdict, search: EffectSearch | None, share: float
    ) -> Judgement:
        """The verdict of the judge on all evidence; `share` of the response stays unexplained."""
        odds, known, tried = self._odds(base, flags, verdict, search), frozenset[str](), verdict.tried
        if search is not None:
            odds, known = joined_classes(odds, verdict), frozenset(f.key for f in search.forms)
            verdict = one_of_each_class(verdict, base, known)
        expected = by_odds(verdict, odds, known)
        best = expected.best
        if expected.status == "no_disagreement":
            self._settle(base)
        point = base.point if best is None else best.fit.point
        gone, left, of_form = None, list[Misfit](), list[Misfit]()
        worse, alone = tuple[str, ...](), tuple[str, ...]()
        others = {role: part for role, part in self.parts.items() if role != "fit"}
        groups = list[Misfit]()
        if not flags:
            groups = table(self.fitted, base.residual)
            groups += [f for part in others.values() for f in table(part, part.residual(base.point))]
        for role, part in others.items():
            after = part.residual(point)
            left += (here := beyond_floor(part, after))
            if best is not None and here:
                against = beyond_form_error(part, part.residual(base.point), after)
                of_form += [f for f in here if f not in against]
            if role == "untouched":
                given = part.residual(ParameterPoint())
                calibrated = after if best is None else part.residual(base.point)
                gone = None if best is None else untouched_gone(part, calibrated, after)
                worse, alone = (worse_than(part, given, there) for there in (after, calibrated))
        by_fitted = "untouched" not in others
        if by_fitted and best is not None:
            gone = fitted_gone(self.fitted, self.fitted.residual(base.point), self.fitted.residual(point))
        scatter = self.fitted.scatter_known
        # a law is fitted next to losses that it resembles: those of the shaft may end at their limits
        names = {k.name for k in base.parameters if self.laws is None or k.key.startswith("bearing.")}
        astray = () if best is None else tuple(name for name in strained(best.fit) if name in names)
        late = "" if self.late is None else self.late.sentence
        found = judged(
            AllEvidence(
                verdict, odds, known, tuple(left), tuple(of_form), gone, worse, alone, self.large, share, scatter, late,
                seen_together(groups), astray, self.growing, self.unclear, bool(flags), self._faint(base),
                by_fitted,
            )
        )  # fmt: skip
        named = joined_classes(found.odds, found.verdict)
        return replace(found, verdict=replace(found.verdict, tried=tried), odds=named)

    def _faint(self, base: ParameterFit) -> tuple[Hypothesis, ...]:
        """Single effects below what a name takes that are alike, the best first: all records agree with each of them.

        None where late probes explain the records better.
        """
        if self.laws is not None or (self.late is not None and not self._acts_late()):
            return ()
        able = (h for h in self.tried if not h.failed and len(h.forms) == 1)
        best: dict[tuple[str, ...], Hypothesis] = {}
        for h in sorted(able, key=lambda h: h.fit.cost):
            best.setdefault(h.keys, h)
        alike = [h for h in best.values() if h.fit.cost < next(iter(best.values())).fit.cost + AS_FAR]
        alike = [h for h in alike if self._agrees(h.fit, base)]
        clear = alike and self._unfitted(base) - self._unfitted(alike[0].fit) > -2 * TEMPERATURE * np.log(1 - SURE)
        return tuple(alike) if clear else ()

    def _unfitted(self, fit: ParameterFit) -> float:
        """Sum of squares of the vibration at points that were not fitted, with the numbers of a fit."""
        others = (part for role, part in self.parts.items() if role != "fit")
        return sum(float(np.sum(part.residual(fit.point)[part.layout.frequency > 0] ** 2)) for part in others)

    def _agrees(self, fit: ParameterFit, base: ParameterFit) -> bool:
        """Whether no group of lines is beyond its floor with a fit, alone or with all others, and it is believed.

        A number at a limit, where the calibration alone has it too, speaks neither for the effect nor against it.
        """
        if set(strained(fit)) - set(strained(base)):
            return False
        left = {role: part.residual(fit.point) for role, part in self.parts.items()}
        groups = [f for role, part in self.parts.items() for f in table(part, left[role])]
        worse = "untouched" in left and worse_than(
            self.parts["untouched"], self.parts["untouched"].residual(ParameterPoint()), left["untouched"]
        )
        return not (worse or seen_together(groups) or any(f.group != "slow" for f in flagged(groups)))

    def _large(
        self, fits: Sequence[tuple[str, ParameterFit]], V: np.ndarray | None = None
    ) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Sentences on calibrated numbers that are far from the machine file, and the numbers of the bearings in them.

        Several far bearings are all in one sentence. V (k, k) is the covariance of a fit that is finished.

        Every fit with a far bearing has a sentence: none would pass for a machine that agrees with its file. Numbers
        within two standard deviations of the file are left out where others are not.
        """
        found = []
        for number, fit in fits:
            spread = covariance(fit, self.fitted.layout.record) if V is None else V
            own = calibration_of(fit, spread, fit.parameters)
            far = far_off_file(fit, number)
            far = [name for name in far if abs(own[name][0]) > 2 * own[name][1]] or far
            found.append(far_off(self.machine, own, related_of(fit, spread), [*strained(fit), *far]))
        bearings = {int(key.split(".")[1]) for own in found for key in own if key.startswith("bearing.")}
        if len(found) < 2:
            return tuple(found[0].values()), tuple(sorted(bearings))
        return (ONE_OF.format(" or ".join(", ".join(own.values()) for own in found)),), tuple(sorted(bearings))

    def _clearly_off(self, number: str, fit: ParameterFit) -> bool:
        """Whether a number of a fit with a far bearing is off the file by two standard deviations more than is near.

        Where the scatter is not known that holds with a floor of `FLOORS` times its size too.
        """
        clear = 2 if self.fitted.scatter_known else 2 * FLOORS
        own = calibration_of(fit, covariance(fit, self.fitted.layout.record), fit.parameters)
        names = {*strained(fit), *far_off_file(fit, number)}
        near = {name: NEAR if name.startswith("bearing.") and ".k" in name else 0.0 for name in names}
        return not names or any(abs(own[name][0]) > near[name] + clear * own[name][1] for name in names)

    def _acts_late(self) -> bool:
        """Whether an effect of the machine that was fitted explains the records better than late probes do.

        Where no effect was fitted, as calibration alone leaves nothing beyond the floor, a seal may act alike.
        """
        assert self.late is not None
        machine = [h.fit.cost for h in self.tried if not h.failed and REGISTRY[h.forms[0].effect].port != "sensor"]
        return not self.tried or min(machine, default=np.inf) < self.late.fit.cost

    def _hints(self, base: ParameterFit) -> list[str]:
        """Sentence on the effects whose fits are clearly better than the calibration and alike, though no name."""
        fits = sorted((h for h in self.tried if not h.failed and len(h.forms) == 1), key=lambda h: h.fit.cost)
        if not fits or base.cost - fits[0].fit.cost < FAINT_HINT:
            return []
        names = " or ".join(dict.fromkeys(h.keys[0] for h in fits if h.fit.cost < fits[0].fit.cost + AS_FAR))
        return [HINT.format(names=names, fall=base.cost - fits[0].fit.cost, least=CLEAR)]

    def _name(
        self, base: ParameterFit, flags: list[Misfit], apart: list[Misfit]
    ) -> tuple[SearchVerdict, EffectSearch | None]:
        """The verdict; where no group is flagged an effect may still show in all of them, or in what is calibrated.

        Half of what a name takes is promised there: a tie of faint effects takes less. A law has shown so in the linear
        model, at the calibration.
        """
        search = self._search(base, flags, apart)
        quiet = SearchVerdict("unknown" if apart else "no_disagreement")
        promising = self.laws is not None or search.promise() >= CLEAR / 2 or strained(base)
        if len(flags) == len(apart) and (apart or not promising):
            return quiet, search
        verdict = judge(search)
        self.tried = verdict.fitted
        return (
            verdict if flags or verdict.status in ("named", "tie") else replace(quiet, tried=verdict.fitted)
        ), search

    def _search(self, base: ParameterFit, flags: list[Misfit], apart: list[Misfit]) -> EffectSearch:
        raw: dict[str, np.ndarray] = {}
        usable: list[Form] = []
        origin, store = ParameterPoint(), self.fitted.stored
        step = self._steps("screen", sum(1 + len(form.parameters) for form in self.forms))
        astray = strained(base, natural=0.0)  # no damping at all is believed, but may be the work of a seal
        films = None if astray or self.laws is not None else LinearColumns.of(store.rough)
        linear = set[str]()
        for form in self.forms:
            step()
            own = None if films is None else films.columns(form)
            linear |= set() if own is None else {form.label}
            own = store.columns(origin.holding(form.fixed), form.parameters, step) if own is None else own
            if form.has_response(own):
                usable.append(form)
                raw[form.label] = own / self.fitted.sigma[:, None]
        nominal = replace(base, J=store.columns(origin, base.parameters) / self.fitted.sigma[:, None])
        while doubtful := not_sure(nominal, usable, raw, linear):
            for form in doubtful:
                own = store.columns(origin.holding(form.fixed), form.parameters, step)
                raw[form.label] = own / self.fitted.sigma[:, None]
                linear.discard(form.label)
        held = self.parts.get("held_out")
        held_excess = 0.0 if held is None else excess(table(held, held.residual(base.point)))
        found = EffectSearch(self.fitted, held, base, tuple(usable), raw, sum(f.excess for f in flags),
                       held_excess, lambda: self.progress("name"),
                       # laws are few: all have those of the calibrated point, and those of the file's in `before`
                       nominal=nominal if self.laws is None else None,
                       unsteady=sum(f.excess for f in apart))  # fmt: skip
        self.seen_from = found.seen_from()
        if self.from_file and astray:
            residual = self.fitted.residual(origin)
            start = replace(nominal, point=origin, residual=residual, cost=float(residual @ residual))
            # its sensitivities are of that point already
            found.before = replace(found, base=start, nominal=start, columns=dict(raw), updated={*raw})
        return found

    def _result(
        self, base: ParameterFit, flags: list[Misfit], judgement: Judgement, search: EffectSearch | None,
        notes: list[str],
    ) -> Diagnosis:  # fmt: skip
        self.progress("show")
        verdict, odds, best = judgement.verdict, judgement.odds, judgement.verdict.best
        final = base if best is None else best.fit
        comparison, again = self._proven(final) if best is not None else (self.fitted, final)
        proven, V = self._converged(base) if best is None else self._measured(final, comparison, again)
        # what is not written into the machine file must not have turned its calibration either
        written = self._converged(base) if verdict.status == "partial" else (proven, V)
        unexplained, unknown = verdict.status in ("unknown", "partial"), dict[str, Any]()
        if unexplained:
            left = flagged(table(self.fitted, final.residual)) + [f for f in flags if f.group == UNSTEADY]
            unknown = equivalent_force(self.fitted, final.point, final.residual, left or flags)
        shown_at = None if best is None else best.fit.point if self.laws is None else proven.point
        stages: list[ParameterPoint | None] = [ParameterPoint(), base.point, shown_at]
        gap = gap_dataset({role: (part, gap_of(part, stages)) for role, part in self.parts.items()})
        shown = {role: spectra_of(part, stages) for role, part in self.parts.items()}
        model = "the re-calibrated model" if best is None else f"the model with {' and '.join(best.keys)}"
        moved = self._moved_by_solver(comparison)
        unsettled = [NOT_SETTLED.format(" and ".join(best.keys), moved)] if best and moved > UNSETTLED else []
        planner = self._planner(base, verdict, search, odds)
        peaceful, point = verdict.status in ("no_disagreement", "recalibrated"), None if best is None else final.point
        return Diagnosis(
            status=verdict.status,
            machine=self.machine,
            localisation=tuple(flags),
            effects=self._found(verdict, proven, V),
            ties=tuple(r.keys for r in verdict.rivals),
            unknown=unknown,
            inputs=() if peaceful else equivalent_inputs(self.fitted, base, point),
            gap=gap,
            notes=(
                *notes,
                *unsettled,
                *([] if unexplained else virtual_readings(comparison, proven, V)),
                *missed_bands((one for part in shown.values() for one in part), model),
                *(null_sentence(null, self.machine) for null in null_vectors(proven, base.parameters)),
            ),
            calibration=calibration_of(*written, base.parameters) | self._clocks(final.point),
            related=related_of(*written),
            evidence=evidence_of(base, best, search),
            explanations=odds,
            priors=prior_sizes(self.forms),
            seen_from=self.seen_from,
            at=acting_at(self.forms),
            planned=None if self.allow is None else planner(self.allow, np.inf, SURE),
            planner=planner,
            data_hash=data_hash(self.trials),
            spectra=shown,
            tried=tuple(h.as_dict() for h in verdict.tried),
            large=self.large,
            far_bearings=self.far_bearings,
            left=judgement.left,
            worse=judgement.worse,
            reason=judgement.reason,
            contradiction=self.contradiction,
            shape=shape_of(*self.unexplained_places) if unexplained and self.unexplained_places else None,
        )

    def _odds(
        self, base: ParameterFit, flags: list[Misfit], verdict: SearchVerdict, search: EffectSearch | None
    ) -> tuple[Explanation, ...]:  # fmt: skip
        """Probabilities of the explanations; none where their evidence has no number."""
        excess_of_unsteady = sum(f.excess for f in flags if f.group == UNSTEADY)
        try:
            odds = explanation_odds(self.fitted, base, search, verdict.fitted, excess_of_unsteady)
        except NoAnswerError:
            return ()
        tried = {h.keys: h.fit for h in sorted(self.tried, key=lambda h: -h.fit.cost) if not h.failed}
        if tried and not (flags or self.laws is not None):
            before = self._unfitted(base)
            odds = with_more(odds, {keys: before - self._unfitted(fit) for keys, fit in tried.items()})
        reading = self._reading(base, verdict, odds)
        return odds if reading is None else with_other(odds, reading[0], OTHER_FORCE, reading[1])

    def _reading(
        self, base: ParameterFit, verdict: SearchVerdict, odds: Sequence[Explanation]
    ) -> tuple[tuple[str, ...], float] | None:
        """The most probable hypothesis, where it is an error of the sensors at an order, and the fall by a force.

        That is from its sum of squares to that of a force at this order at any place, constant or growing with the
        square of the speed, of which a catalogue does not have all. Where the receptance changes as little with the
        speed as a reading does, the records do not choose between them; a force that grows in any other way would make
        every motion. Neither pays for its numbers: where both do nearly as well the run-out is not named.

        None for another one, for the first order, at which a bow is such a force and unbalances are calibrated, and for
        records of which no place is observed.
        """
        fitted = [h for h in verdict.fitted if not h.failed]
        best = max(fitted, key=lambda h: (probability_of(h.keys, odds), -h.fit.cost), default=None)
        if best is None or self.laws is not None or not any(REGISTRY[f.effect].port == "sensor" for f in best.forms):
            return None
        taken = dict[str, float]()
        for f in table(self.fitted, base.residual - best.fit.residual):
            taken[f.group] = taken.get(f.group, 0.0) + f.chi2
        order = max(taken, key=lambda group: taken[group])
        n = next((n for n in HARMONICS if order == f"{n}X"), 0)
        if not n or any(t.orders or not (t.periodic or t.turning) for t in self.fitted.trials):
            return None
        forces = [LawTerm(term) for term in order_forces(n)]
        try:
            seen = self._seen(self.fitted, base)
            costs = [solved(seen, None, base, place, [one]).cost for place in seen.motions for one in forces]
        except NoAnswerError:
            return None
        return best.keys, best.fit.cost - min(costs)

    def _planner(
        self, base: ParameterFit, verdict: SearchVerdict, search: EffectSearch | None, odds: tuple[Explanation, ...]
    ) -> Planner:  # fmt: skip
        """Planner of the next experiment, by allowed changes, longest experiment [min] and probability that settles."""

        def planned(allow: Iterable[str], longest: float, sure: float) -> ExperimentPlan:
            from rotorsim.discrepancy.ranking import plan_next, rivals_of  # experiments load when they are planned

            fits = {h.keys: h.fit for h in sorted(verdict.fitted, key=lambda h: -h.fit.cost) if not h.failed} | {
                (): base
            }
            others = [e for e in rivals_of(odds) if len(e.effects) == 1 and e.effects not in fits]
            if search is not None and others:
                fits |= search.tangents(e.effects[0] for e in others if e.shown)
                fits |= search.not_moved(e.effects[0] for e in others if not e.shown)
            return plan_next(self.fitted, fits, odds, allow, lambda: self.progress("plan"), longest, sure)

        return planned

    def _clocks(self, point: ParameterPoint) -> dict[str, tuple[float, float]]:
        """Clock offset [s] and standard deviation of every record that states how far its clock may be off."""
        parts = [part.clock_offsets(point) for part in self.parts.values()]
        return {f"{CLOCK}{name}": value for part in parts for name, value in part.items()}

    def _found(self, verdict: SearchVerdict, proven: ParameterFit, V: np.ndarray) -> tuple[IdentifiedEffect, ...]:
        if verdict.best is None or verdict.status == "unknown":
            return ()
        best = verdict.best
        classes = dict(zip(best.keys, verdict.classes, strict=False))
        return tuple(found_of(self.models.twin, f, proven, V, classes.get(f.key, (f.key,))) for f in best.forms)

    def _moved_by_solver(self, comparison: TwinComparison) -> float:
        """Solver's error with the effects at work beyond that without them, in floors: root mean square."""
        moved = (comparison.correction - self.fitted.correction) / self.fitted.sigma
        return float(np.sqrt(np.mean(moved**2)))

    def _measured(
        self, fit: ParameterFit, comparison: TwinComparison, proven: ParameterFit, stage: str = "show"
    ) -> tuple[ParameterFit, np.ndarray]:
        """Fit whose numbers are reported, converged from `proven`, and their covariance (k, k)."""
        moved = SOLVER_LEFT * (proven.vector - fit.vector)
        # a law is fitted to linear bearings alone, where both sides are alike
        done = finished(comparison, proven, lambda: self.progress(stage), central=self.laws is None)
        return done, covariance(done, comparison.layout.record) + np.outer(moved, moved)

    def _proven(self, fit: ParameterFit) -> tuple[TwinComparison, ParameterFit]:
        """Comparison with the solver's error as it is with the effect at work, and the fit to it."""
        fine = self.models.fine
        if fine is None:
            return self.fitted, fit
        comparison = self.fitted.proven(fit.point, fine)
        again = fit_parameters(comparison, fit.point, fit.parameters, fit.J, progress=lambda: self.progress("show"))
        return comparison, again

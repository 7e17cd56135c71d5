"""Result of a diagnosis: verdict, effects with uncertainties and places, ties, unexplained part, gap, plan."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import combinations, count
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.display import Card, Reported, Shown
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint, lobes, sd_of_polar, wave
from rotorsim.discrepancy.candidates import Form
from rotorsim.discrepancy.changes import MAIN
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.decision import DecisionSteps, check_allowed
from rotorsim.discrepancy.discovery import NOT_IDENTIFIABLE, DiscoveredLaw
from rotorsim.discrepancy.equivalent_input import EquivalentInput
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.force_shape import ForceShape
from rotorsim.discrepancy.gap import reduction
from rotorsim.discrepancy.hypotheses import EffectSearch, Hypothesis
from rotorsim.discrepancy.judge import LEAST_NOTHING, LEFT, LIKELY, NO_ACCURACY, VERDICTS, VerdictText, text_of
from rotorsim.discrepancy.law_terms import law_places
from rotorsim.discrepancy.machine_file import UNBALANCE, Findings, IdentifiedEffect, extended, in_words
from rotorsim.discrepancy.records import MORE_SPEEDS, ONE_EXCITATION, ONE_SPEED_ALONE
from rotorsim.discrepancy.stochastic import StochasticForce
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import LEAST_SHOWN, NOT_IN_CATALOGUE, NOTHING, SURE, Explanation, entropy, shown_share
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.base import WHERE
from rotorsim.machine import Machine
from rotorsim.plant.locations import OF_HOUSING, Place, acting_places, bearing_place, force_plane, place_at, probes_at

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.discrepancy.ranking import ExperimentPlan

NOT_SURE = "Tie: the records show {effects}, but do not exclude: {others}."
WITHIN_FORM = (
    "No disagreement: that nothing is missing has {share}; groups of lines beyond the floor, but within the error "
    "of the model's form: {count}."
)
LEFT_OPEN = "These records leave open whether a bearing is far from its file: {}."
MOVED_FROM_FILE = "Numbers that differ from the file: {}."
CONTRADICTION = "One statement contradicts the data: {}."
CORRECT = "Check the accuracy that is stated, correct it, and diagnose again: the verdict depends on it."
RECORD_MORE = (
    "Use the re-calibrated machine file for what these records show; to know those bearings better, record speeds at "
    "which they move more, nearer to a critical speed."
)
RECORD_ALSO = {
    ONE_SPEED_ALONE: (
        "at this speed",
        f"Record {MORE_SPEEDS} more speeds and diagnose again: a force that grows with the speed cannot be "
        "distinguished from stiffness and damping at one speed.",
    ),
    ONE_EXCITATION: (
        "for motions as large as these",
        "Record the same points with half the excitation and diagnose again: dry friction, a dead zone or a rub cannot "
        "be distinguished from stiffness and damping at one amplitude.",
    ),
}
"""Limits within which a machine file that agrees holds, and sentences on what to record next, by notes on records."""
EXCLUDED = 0.01
"""Probability below which an explanation counts as excluded."""
Planner = Callable[[Iterable[str], float, float], "ExperimentPlan"]
"""Planner of experiments by allowed changes, longest experiment [min] and probability that settles."""
PLAN_NEXT = (
    "To rank the experiments that may separate the explanations, diagnose again with --plan-next (in Python: "
    "found.plan())."
)
NOTHING_BEYOND = (
    "Unknown: nothing disagrees beyond the scatter within the records, but how exact they are is not stated."
)
UNDECIDED = (
    "Unknown: groups of lines beyond the floor: {count}; that nothing is missing has {share}, less than the "
    "{sure:.0f} % that it takes."
)
CONSTANT_FORCE = (
    "Unknown: something is there that these records do not tell from stiffness and damping: no group of lines is "
    "beyond the floor, but all together agree clearly better with a constant force at a place."
)
RECORD_ELSEWHERE = (
    "Record with probes near the discs and supports where a force may act, at more speeds and with more excitation, "
    "and diagnose again: a force that is late, a mass and a spring differ in what they do over the frequency."
)
FREE_FORCE = (
    "Unknown: a force at {where} explains {gone} % of what is beyond the floor; its law is not known.",
    "Look at {where} for what may make this force: a joint that slips, a stop, a support that gives way. Record the "
    "same speeds with a third amplitude, twice the largest or half the smallest, and diagnose again: how a force grows "
    "shows its law. One that you know is an effect of your own.",
)
"""Headline and next step where a force of free shape explains what no effect and no law does."""
LEAST_EXPLAINED = 0.5
"""Share of the misfit from which a force of free shape stands in the headline."""
TESTED_ON = {
    "untouched": ", on untouched records too",
    "held_out": ", on held-out records too; no untouched record tests it",
    "fit": ", on the records that were fitted; no other record tests it",
}
"""Records on which a law holds, by the role of the records that took least part in finding it."""
LAW_FILE = "discovered_law.py"
"""File of a discovered law in the folder of a diagnosis."""
LAW_APART = (
    "The new machine file does not hold the law{numbers}: that is the effect of " + LAW_FILE + ".",
    f"In Python, `import {LAW_FILE.removesuffix('.py')}` in its folder before load_machine, and add the table at the "
    "top of that module to this file. The command line takes an effect from an installed package alone, under the "
    "entry point rotorsim.effects.",
)
"""Notes on a machine file without the law that was discovered, and on the use of the two together."""
WITH_LAW = ", with which its re-calibrated numbers were fitted"
"""Part of that where the file has them."""
LAW_ALONE = (
    "The new machine file does not hold the law{numbers}, and no file does: it is known by the linear model alone."
)
"""Note on a machine file without a law that is not compiled."""
NOT_TRUSTED = (
    "The new machine file has re-calibrated numbers that are not trusted, since much of the disagreement stays, and "
    "does not hold the effect."
)
"""Note on a machine file after a partial explanation."""
RECALIBRATED = "re-calibrated"
"""Label of a bearing far from the machine file."""
FORCE = "equivalent force"
"""Label of the force that would make the residual which no effect explains."""


def found_of(twin: Twin, form: Form, fit: ParameterFit, V: np.ndarray, tie_class: tuple[str, ...]) -> IdentifiedEffect:
    """Estimated parameters of a form with standard deviations, as in its table of the machine file."""
    own = {replace(k, plane=None): fit.point.values.get(k, 0.0) for k in (*form.parameters, *form.refine)}
    absolute = ParameterPoint(own, form.fixed).setting(twin)
    parameters = {key.split(".")[2]: value for key, value in absolute.items()}
    table = next(iter(absolute)).split(".")[1]
    for where in WHERE:
        place = getattr(twin.effect(form.effect, int(table)), where, None)
        parameters |= {} if place is None else {where: place}
    at = {k: i for i, k in enumerate(fit.parameters)}
    sd: dict[str, float] = {}
    if len(form.parameters) == 2 and "~" in form.parameters[0].key:
        i, j = (at[k] for k in form.parameters)
        path = form.parameters[0].key[:-2]
        pair = path.split(".")[2].split("~")
        name, table = path.split(".")[:2]
        effect = twin.effect(name, int(table))
        n = form.fixed.get(f"{name}.{table}.{pair[0]}_lobes", lobes(effect, pair[0]))
        c, s = (fit.point.values.get(k, 0.0) for k in form.parameters)
        own_wave = wave(effect, pair[0], pair[1], n)
        _, _, sd[pair[0]], sd[pair[1]] = sd_of_polar(c, s, V[np.ix_([i, j], [i, j])], own_wave)
        sd[pair[1]] /= n
    for parameter in (*form.parameters, *form.refine):
        if "~" not in parameter.key and parameter in at:
            sd[parameter.key.split(".")[2]] = float(np.sqrt(V[at[parameter], at[parameter]]))
    in_file = form.parameters[0].plane in (None, MAIN)
    return IdentifiedEffect(form.effect, form.key, parameters, sd, tie_class, in_file)


def calibration_of(
    fit: ParameterFit, V: np.ndarray, parameters: Sequence[FitParameter]
) -> dict[str, tuple[float, float]]:
    """Calibration parameters and standard deviations by name; V (k, k) is the covariance of all parameters."""
    at = {k: i for i, k in enumerate(fit.parameters)}
    return {k.name: (fit.point.values.get(k, 0.0), float(np.sqrt(V[at[k], at[k]]))) for k in parameters}


def related_of(fit: ParameterFit, V: np.ndarray) -> dict[str, float]:
    """Correlations out of the fit's covariance V (k, k): of each bearing's compliance and loss, by the key of the loss;
    of two parts of unbalances, by both keys.
    """
    at = {k.name: i for i, k in enumerate(fit.parameters)}
    pairs = {key: (at[key.replace(".c", ".k")], i) for key, i in at.items()
             if key.startswith("bearing.") and ".c" in key and key.replace(".c", ".k") in at}  # fmt: skip
    parts = [(key, i) for key, i in at.items() if key.startswith(UNBALANCE)]
    pairs |= {f"{a}, {b}": (i, j) for (a, i), (b, j) in combinations(parts, 2)}
    return {key: float(V[i, j] / max(np.sqrt(V[i, i] * V[j, j]), 1e-300)) for key, (i, j) in pairs.items()}


def evidence_of(base: ParameterFit, best: Hypothesis | None, search: EffectSearch | None) -> dict[str, float]:
    """Sums of squares and excess misfit before and with the effect."""
    evidence = {"chi2_calibrated": base.chi2, "numbers": float(len(base.residual))}
    if search is not None:
        evidence |= {"flagged_excess": search.base_excess, "held_out_excess": search.base_held}
    if best is not None:
        evidence |= {
            "chi2_with_effect": best.fit.chi2,
            "share_gone": best.gone,
            "held_out_excess_with_effect": best.held_out,
        }
    return evidence


def null_sentence(null: dict[str, float], machine: Machine) -> str:
    """Sentence about a combination of parameters that the records do not determine."""
    keys = sorted(null, key=lambda key: -abs(null[key]))
    rise, fall = (" and ".join(in_words(machine, [k for k in keys if sign * null[k] > 0])) for sign in (1, -1))
    change = f"a rise of {rise} with a fall of {fall}" if rise and fall else f"a change of {rise or fall}"
    return f"{change} leaves these records as they are: each is kept near to its value in the machine file"


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Shown, Findings, Reported):
    """Result of `diagnose`."""

    localisation: tuple[Misfit, ...]
    unknown: dict[str, Any]
    gap: xr.Dataset
    notes: tuple[str, ...]
    spectra: dict[str, Any] = field(default_factory=dict, repr=False)
    tried: tuple[dict[str, Any], ...] = ()
    explanations: tuple[Explanation, ...] = ()
    """Explanations with their probabilities and evidence, the most probable first."""
    priors: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Prior standard deviation of the size of every candidate, with its unit."""
    seen_from: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Size with its unit from which the records would have shown a candidate, wherever it acts."""
    at: Mapping[str, float] = field(default_factory=dict, repr=False)
    """Coordinates z [m] of candidates' forces and of the probes of other planes, by key."""
    planned: ExperimentPlan | None = None
    """The next experiments, where they were asked for."""
    planner: Planner | None = field(default=None, repr=False)
    """Planner of further experiments; a diagnosis that was stored has none."""
    steps: DecisionSteps | None = None
    """Odds after each step of a loop of diagnoses and experiments."""
    large: tuple[str, ...] = ()
    """Sentences on calibrated numbers that are far from the machine file."""
    far_bearings: tuple[int, ...] = ()
    """Numbers of the bearings that those sentences are about."""
    left: int = 0
    """Number of groups of lines beyond the floor at points that were not fitted."""
    reason: str = ""
    """Sentence on what refutes that nothing is missing where no group of lines is beyond its floor."""
    contradiction: str = ""
    """Sentence on a stated accuracy that contradicts the records."""
    inputs: tuple[EquivalentInput, ...] = field(default=(), repr=False)
    """Equivalent over commanded input of the injectors, where records drive them and something is missing."""
    discovered: DiscoveredLaw | None = None
    """The law that the records show and no effect of the catalogue is."""
    shape: ForceShape | None = None
    """The force of free shape that explains the records best, where neither an effect nor a law does."""
    stochastic: StochasticForce | None = None
    """The force or change that does not repeat, where the records show one."""

    @property
    def explained(self) -> bool:
        """Whether an effect or a law takes part of the gap."""
        return bool(self.effects) or self.discovered is not None

    @property
    def odds(self) -> dict[str, float]:
        """Probability of every explanation, of nothing missing and of something that is not in the catalogue."""
        out: dict[str, float] = {}
        for e in self.explanations:
            name = NOT_IN_CATALOGUE if e.beyond else e.name
            out[name] = out.get(name, 0.0) + e.probability
        return dict(sorted(out.items(), key=lambda one: -one[1]))

    @property
    def leading(self) -> tuple[Explanation, ...]:
        """Explanations; those with something beyond the catalogue are one where no effect is given."""
        beyond = [e for e in self.explanations if e.beyond]
        if self.status != "unknown" or len(beyond) < 2:
            return self.explanations
        one = Explanation((), True, np.nan, np.nan, False, sum(e.probability for e in beyond))
        return tuple(sorted([one, *(e for e in self.explanations if not e.beyond)], key=lambda e: -e.probability))

    @property
    def entropy(self) -> float:
        """Entropy [bit] of the odds."""
        return float(entropy(np.array(list(self.odds.values())))) if self.explanations else 0.0

    @property
    def unplanned(self) -> bool:
        """Whether the odds are not settled and no experiment was planned that may settle them."""
        settled = self.status in ("no_disagreement", "recalibrated", "named", "discovered")
        if settled or self.planned is not None or self.steps is not None:
            return False
        return bool(self.explanations) and (self.status == "tie" or max(self.odds.values()) < SURE)

    def plan(self, allow: Iterable[str] = (), budget: float = np.inf, sure: float = SURE) -> ExperimentPlan:
        """Experiments that may come next, the best first.

        Parameters
        ----------
        allow : names
            What may differ from the records (`decision.ALLOWED`); all that the machine can do for none.
        budget : float
            Minutes of rig time that an experiment may take.
        sure : float
            Probability at which an explanation is settled.

        Raises
        ------
        DataError
            For a diagnosis that was read from files, and where nothing that is allowed can be done.

        Examples
        --------
        >>> import rotorsim as rs
        >>> found = rs.diagnose("dtu_gas_bearing", "puzzle/records")  # doctest: +SKIP
        >>> found.plan(allow=["speed"], budget=10.0).sentence  # doctest: +SKIP
        """
        if self.planner is None:
            raise DataError("plan: a stored diagnosis has no plant; diagnose the records again with plan_next")
        return self.planner(check_allowed(allow), budget, sure)

    def card(self) -> Card:
        """Verdict, sizes of the effects, plan."""
        rows = [
            (found.form, ", ".join(f"{name} = {value}{f' +- {sd}' if sd else ''}" for name, value, sd in found.sizes()))
            for found in self.effects
        ]
        rows += [] if self.discovered is None else [("law", self.discovered.sentence)]
        rows += [("indistinguishable", "; ".join(" with ".join(tie) for tie in self.ties))] if self.ties else []
        rows += [("probability", f"{shown_share(e.probability)} {e.name}") for e in self.leading[:3]]
        if self.planned is not None:
            rows.append(("plan", self.planned.sentence))
        rows.append(("machine", self.machine.name))
        return Card(f"Diagnosis: {self.sentence}", rows)

    @property
    def exit_code(self) -> int:
        """Exit code of the verdict, from 0 for no disagreement to 15 for what does not repeat."""
        return VERDICTS[self.status].exit_code

    @property
    def texts(self) -> VerdictText:
        """Headline, meaning and next step of the verdict."""
        force = bool(self.unknown.get("lines"))
        text = text_of(self.status, self.left, NO_ACCURACY not in self.notes, force)
        if self.status == "discovered":
            tested = next((words for role, words in TESTED_ON.items() if role in self.roles), "")
            return replace(text, meaning=text.meaning.format(tested=tested, form=self._law_form))
        if self.free_force is None:
            return text
        given = {"where": " or ".join(self.free_force.places), "gone": int(100 * self.free_force.gone)}
        sentence, following = (one.format(**given) for one in FREE_FORCE)
        return replace(text, sentence=sentence, meaning=self.free_force.sentence, next=following)

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the records, each once: fit, held_out, untouched."""
        return tuple(dict.fromkeys(map(str, self.gap["role"].values)))

    @property
    def _law_form(self) -> str:
        """Sentence on what the discovered law is as a file; empty where it is none."""
        if self.discovered is None:
            return ""
        if self.discovered.bearing:
            return " It is a hidden mass, which is a bearing of the new machine file."
        return " It is an effect of your own, written as a file." if self.discovered.source else ""

    @property
    def free_force(self) -> ForceShape | None:
        """The force of free shape, where it explains most of what neither an effect nor a law does."""
        enough = self.status == "unknown" and self.shape is not None and self.shape.gone >= LEAST_EXPLAINED
        return self.shape if enough else None

    @property
    def sentence(self) -> str:
        """The verdict in one sentence, and one on a stated accuracy that contradicts the records."""
        more = f" {CONTRADICTION.format(self.contradiction)}" if self.contradiction else ""
        return self._verdict + more

    @property
    def _verdict(self) -> str:
        """The verdict in one sentence."""
        if self.status == "unknown" and NO_ACCURACY in self.notes and not self.localisation:
            return NOTHING_BEYOND
        if self._constant_force:
            return CONSTANT_FORCE
        effects = " with ".join(f.form for f in self.effects)
        alike = [key for found in self.effects for key in found.tie_class if key != found.form]
        rivals = [*alike, *(" with ".join(t) for t in self.ties)]
        if self.status == "tie" and not rivals:
            others = [f"{name} {shown_share(p)}" for name, p in self.odds.items() if name != effects and p >= EXCLUDED]
            return NOT_SURE.format(effects=effects, others="; ".join(others[:3]) or "others")
        if self.status == "no_disagreement" and self.localisation and self.explanations:
            share = shown_share(self.odds.get(NOTHING, 0.0))
            more = f" {LEFT.format(count=self.left)}" if self.left else ""
            return WITHIN_FORM.format(share=share, count=len(self.localisation)) + more + self._moved + self._open
        if self.status == "no_disagreement":
            return self.texts.sentence + self._moved + self._open
        nothing = self.odds.get(NOTHING, 0.0)
        if self.status == "unknown" and nothing > LIKELY and not self.left:
            least = 100 * (SURE if self.localisation else LEAST_NOTHING)
            if 100 * nothing < least:
                return UNDECIDED.format(count=len(self.localisation), share=shown_share(nothing), sure=least)
        if self.status == "unknown" and self.reason:
            return f"Unknown: {self.reason}."
        if self.free_force is not None:
            return self.texts.sentence
        law = "" if self.discovered is None else self.discovered.sentence
        force = "" if self.stochastic is None else self.stochastic.sentence
        return self.texts.sentence.format(
            effects=effects, rivals="; ".join(rivals), changes="; ".join(self.large), law=law, force=force
        )

    @property
    def _constant_force(self) -> bool:
        """Whether the records show no more than a force that they do not tell from stiffness and damping."""
        return self.status == "unknown" and NOT_IDENTIFIABLE in self.notes and not self.localisation

    @property
    def _moved(self) -> str:
        """Sentence on numbers that a peaceful calibration has changed clearly; empty for none."""
        return f" {MOVED_FROM_FILE.format('; '.join(self.moved))}" if self.moved else ""

    @property
    def _open(self) -> str:
        """Sentence on bearings whose stiffness these records leave open; empty for none."""
        return f" {LEFT_OPEN.format('; '.join(self.left_open))}" if self.left_open else ""

    @property
    def next_step(self) -> str:
        """The plan's sentence, else the step that follows from the verdict, with how to get a plan."""
        if self.planned is not None and self.planned.as_dict().get("proposals"):
            return self.planned.sentence
        if self.status == "unknown" and NO_ACCURACY in self.notes and not self.localisation:
            return f"{NO_ACCURACY[:1].upper()}{NO_ACCURACY[1:]}."
        if self.contradiction and self.status in ("no_disagreement", "unknown", "partial"):
            return CORRECT
        if self._constant_force:
            return RECORD_ELSEWHERE
        names = dict.fromkeys(place.name for one in located(self) if one.label != FORCE for place in one.places)
        refuted, step = "" if self.discovered is None else self.discovered.refuted_by, self.texts.next
        if self.free_force is None:
            step = step.format(places=" and ".join(names) or "the machine", refuted=refuted)
        limited = [own for note, own in RECORD_ALSO.items() if note in self.notes]
        if self.status in ("named", "tie", "partial", "unknown"):
            step = " ".join([step, *(record for _, record in limited)])
        elif self.status == "no_disagreement" and self._open:
            step = RECORD_MORE
        elif self.status == "no_disagreement" and not self.left:
            use = " and ".join(only for only, _ in limited)
            step = " ".join([f"Use the re-calibrated machine file {use}.", *(r for _, r in limited)]) if use else step
        if self.planned is not None:
            return f"{self.planned.sentence} {step}"
        return f"{step} {PLAN_NEXT}" if self.unplanned else step

    @property
    def file_notes(self) -> tuple[str, ...]:
        """Sentences on what the new machine file has and has not, then on its use; none where it has all."""
        written = bool(self.calibration) and not self.worse
        if self.status == "partial" and written:
            return (NOT_TRUSTED,)
        if self.discovered is None or self.discovered.bearing:
            return ()
        notes = LAW_APART if self.discovered.source else (LAW_ALONE,)
        return notes[0].format(numbers=WITH_LAW * written), *notes[1:]

    @property
    def added_bearing(self) -> dict[str, Any]:
        """Table of the bearing that a hidden mass is; empty where there is none."""
        return {} if self.discovered is None else self.discovered.bearing

    def apply(self) -> Machine:
        """The machine with the new calibration, effects that are named or tied, and the bearing of a hidden mass."""
        return extended(self)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        return {
            "status": self.status,
            "verdict": self.sentence,
            "next_step": self.next_step,
            "effects": [
                {"effect": f.effect, "form": f.form, "parameters": f.parameters, "sd": f.sd, "class": list(f.tie_class)}
                for f in self.effects
            ],
            "ties": [list(t) for t in self.ties],
            "unknown": self.unknown,
            "inputs": [one.as_dict() for one in self.inputs],
            "flags": [
                {
                    "record": f.record, "point": f.point, "channel": f.channel, "group": f.group,
                    "um": f.rms * TO_UM, "floor_um": f.floor * TO_UM, "excess": f.excess,
                }
                | ({"rpm": f.speed * TO_RPM, "largest_um": f.largest * TO_UM} if f.speed else {})
                for f in self.localisation
            ],
            "gap_reduction_untouched": _number(reduction(self.gap)),
            "gap_reduction_fit": _number(reduction(self.gap, "fit")),
            "calibration": {k: {"value": v, "sd": s} for k, (v, s) in self.calibration.items()},
            "recalibration": [
                {"path": r.path, "value": r.value, "sd": r.sd, "before": r.before} for r in self.recalibration
            ],
            "large": list(self.large),
            "groups_left_where_not_fitted": self.left,
            "made_worse": list(self.worse),
            "evidence": self.evidence,
            "notes": list(self.notes),
            "odds": self.odds,
            "explanations": [
                {
                    "effects": list(e.effects), "beyond_catalogue": e.beyond, "name": e.name,
                    "probability": e.probability, "log_evidence": e.evidence, "form_error": e.error,
                    "refitted": e.refitted,
                    "alike": [list(keys) for keys in e.alike],
                    "unseen": {one.name: one.probability for one in e.unseen},
                }
                for e in self.explanations if e.probability >= LEAST_SHOWN
            ],
            "prior_sizes": dict(self.priors),
            "seen_from": dict(self.seen_from),
            **({} if self.discovered is None else {"discovered": self.discovered.as_dict()}),
            **({} if self.shape is None else {"shape": self.shape.as_dict()}),
            **({} if self.stochastic is None else {"stochastic": asdict(self.stochastic)}),
            **({} if self.planned is None else {"plan": self.planned.as_dict()}),
            **({} if self.steps is None else {"steps": self.steps.as_dict()}),
            "tried": list(self.tried),
            "data_hash": self.data_hash,
        }  # fmt: skip


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value


@dataclass(frozen=True)
class LocatedEffect:
    """An effect with the places where it acts; `role` is 'found', 'rival' or 'force'."""

    label: str
    role: str
    places: tuple[Place, ...]

    @property
    def sentence(self) -> str:
        """Sentence on the places, with the bearing and the injector once."""
        return f"{self.label.partition(' of ')[0]}: {' and '.join(place.name for place in self.places)}"


def located(diagnosis: Diagnosis) -> tuple[LocatedEffect, ...]:
    """Places of the identified effects, of their rivals, of bearings far from the machine file, and of the equivalent
    force of an unexplained residual."""
    machine, effects = diagnosis.machine, diagnosis.effects
    out = [LocatedEffect(f.form, "found", _places(diagnosis, f.form, effect_of(f))) for f in effects]
    keys = [key for found in effects for key in found.tie_class] + [key for tie in diagnosis.ties for key in tie]
    others = [key for key in dict.fromkeys(keys) if key not in {found.form for found in effects}]
    rivals = [(key, effect) for key in others if (effect := effect_of_key(machine, key, diagnosis.at)) is not None]
    out += [LocatedEffect(key, "rival", _places(diagnosis, key, effect)) for key, effect in rivals]
    if diagnosis.status == "recalibrated":
        out += [LocatedEffect(RECALIBRATED, "found", (bearing_place(machine, i),)) for i in diagnosis.far_bearings]
    if (law := diagnosis.discovered) is not None:
        at = dict(law.places) or {law.place: law.position}
        out.append(LocatedEffect(" with ".join(law.kinds), "found", _at(machine, at)))
    if diagnosis.free_force is not None:
        out.append(LocatedEffect(FORCE, "force", _at(machine, diagnosis.free_force.places)))
    elif (random := diagnosis.stochastic) is not None:
        out.append(LocatedEffect(random.kind, "found", _at(machine, (random.place, *random.others))))
    elif diagnosis.unknown.get("lines"):
        out.append(LocatedEffect(FORCE, "force", (force_plane(machine),)))
    return tuple(one for one in out if one.places)


def _at(machine: Machine, names: Iterable[str]) -> tuple[Place, ...]:
    """Places of a law by their names, bearings by theirs; a name that is none has no place."""
    known, bearings = law_places(machine), dict(zip(machine.bearings_in_words, count(), strict=False))
    own = {name: name.removeprefix(OF_HOUSING) for name in names if name in known}
    return tuple(bearing_place(machine, bearings[bearing], bearing != name) if bearing in bearings
                 else place_at(machine, known[name]) for name, bearing in own.items())  # fmt: skip


def _places(diagnosis: Diagnosis, key: str, effect: Effect) -> tuple[Place, ...]:
    """Places where a candidate acts: of an effect of the sensors the plane of the probes that it is about."""
    if effect.port == "sensor" and key in diagnosis.at:
        return (probes_at(diagnosis.at[key]),)
    return acting_places(diagnosis.machine, effect)


def effect_of(found: IdentifiedEffect) -> Effect:
    """Effect with the identified parameters."""
    kind = REGISTRY[found.effect]
    return kind(**{f.name: found.parameters[f.name] for f in fields(kind) if f.name in found.parameters})


def effect_of_key(machine: Machine, key: str, at: Mapping[str, float]) -> Effect | None:
    """A neutral effect at the place that a candidate's key names; None for an effect that is not known.

    `at` has the coordinates [m] of those that act elsewhere than usual.

    A key is 'weak_injector.blocked of injector 3 of front', see `rotorsim.discrepancy.candidates`.
    """
    kind = REGISTRY.get(key.partition(".")[0])
    if kind is None:
        return None
    known, values = {f.name for f in fields(kind)}, {}
    if "injector" in known and (number := re.search(r" of injector (\d+)", key)):
        values["injector"] = float(number[1])
    named = [i for i, name in enumerate(machine.bearing_names) if key.endswith(f" of {name}")]
    if "position" in known and key in at:
        values["position"] = at[key]
    if "bearing" in known and named:
        values["bearing"] = float(named[0])
    return replace(kind.neutral(machine, 0), **values)

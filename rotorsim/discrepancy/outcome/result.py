"""Result of a diagnosis: verdict, effects with uncertainties, ties, unexplained part, gap, plan."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.base.display import Card, Reported, Shown
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.loop.steps import Steps
from rotorsim.discrepancy.odds.explanation import (
    LEAST_SHOWN,
    NOT_IN_CATALOGUE,
    NOTHING,
    SURE,
    Explanation,
    shown_share,
)
from rotorsim.discrepancy.outcome.findings import Findings
from rotorsim.discrepancy.outcome.gap import reduction
from rotorsim.discrepancy.outcome.machine_file import extended
from rotorsim.discrepancy.plan.allowed import check_allowed
from rotorsim.discrepancy.plan.expected import entropy
from rotorsim.discrepancy.plan.plan import Plan
from rotorsim.discrepancy.residuals.localise import Flag
from rotorsim.machine import Machine

if TYPE_CHECKING:
    import xarray as xr

EXIT_CODES = {"no_disagreement": 0, "named": 10, "tie": 11, "partial": 11, "unknown": 12}
WORDS = {
    "no_disagreement": "No disagreement: after re-calibration every group of lines is within the floor.",
    "named": "Named: {effects}.",
    "tie": "Tie: the records show {effects}, or, indistinguishable from it: {rivals}.",
    "partial": "Partial: {effects} helps, but much of the disagreement stays; this is not a name.",
    "unknown": "Unknown: no effect of the catalogue explains the disagreement; see the equivalent force.",
}

NOT_SURE = "Tie: the records show {effects}, but do not exclude: {others}."
WITHIN_FORM = (
    "No disagreement: that nothing is missing has {share}; {count} groups of lines are beyond the floor, but within "
    "the error of the model's form."
)
EXCLUDED = 0.01
"""Probability below which an explanation counts as excluded."""
Planner = Callable[[Iterable[str], float, float], Plan]
"""Plans experiments by what may change and the minutes that one may take."""
NO_ACCURACY = (
    "nothing states how exact the records are: they may agree or be too coarse to disagree; give accuracy (a "
    "displacement), or record one operating point twice"
)
PLAN_NEXT = (
    "To rank the experiments that may separate the explanations, diagnose again with --plan-next (in Python: "
    "found.plan())."
)
NOTHING_BEYOND = (
    "Unknown: nothing disagrees beyond the scatter within the records, but how exact they are is not stated."
)


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Shown, Findings, Reported):
    """Result of `diagnose`."""

    localisation: tuple[Flag, ...]
    unknown: dict[str, Any]
    gap: xr.Dataset
    notes: tuple[str, ...]
    spectra: dict[str, Any] = field(default_factory=dict, repr=False)
    tried: tuple[dict[str, Any], ...] = ()
    explanations: tuple[Explanation, ...] = ()
    """Explanations with their probabilities and evidence, the most probable first."""
    priors: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Prior standard deviation of the size of every candidate, with its unit."""
    planned: Plan | None = None
    """The next experiments, where they were asked for."""
    planner: Planner | None = field(default=None, repr=False)
    """What plans further experiments; a diagnosis that was stored has none."""
    steps: Steps | None = None
    """Odds after each step of a loop of diagnoses and experiments."""

    @property
    def odds(self) -> dict[str, float]:
        """Probability of every explanation, of nothing missing and of something that is not in the catalogue."""
        out: dict[str, float] = {}
        for e in self.explanations:
            name = NOT_IN_CATALOGUE if e.beyond else e.name
            out[name] = out.get(name, 0.0) + e.probability
        return dict(sorted(out.items(), key=lambda one: -one[1]))

    @property
    def entropy(self) -> float:
        """Entropy [bit] of the odds."""
        return float(entropy(np.array(list(self.odds.values())))) if self.explanations else 0.0

    @property
    def unplanned(self) -> bool:
        """Whether the odds are not settled and no experiment was planned that may settle them."""
        if self.status in ("no_disagreement", "named") or self.planned is not None or self.steps is not None:
            return False
        return bool(self.explanations) and (self.status == "tie" or max(self.odds.values()) < SURE)

    def plan(self, allow: Iterable[str] = (), budget: float = np.inf, sure: float = SURE) -> Plan:
        """Experiments that may come next, the best first.

        Parameters
        ----------
        allow : names
            What may differ from the records (`plan.allowed.ALLOWED`); all that the machine can do for none.
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
        rows += [("indistinguishable", "; ".join(" with ".join(tie) for tie in self.ties))] if self.ties else []
        rows += [("probability", f"{shown_share(e.probability)} {e.name}") for e in self.explanations[:3]]
        if self.planned is not None:
            rows.append(("plan", self.planned.sentence))
        rows.append(("machine", self.machine.name))
        return Card(f"Diagnosis: {self.sentence}", rows)

    @property
    def exit_code(self) -> int:
        """0 no disagreement, 10 named, 11 tie or partial, 12 unknown."""
        return EXIT_CODES[self.status]

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if self.status == "unknown" and NO_ACCURACY in self.notes and not self.localisation:
            return NOTHING_BEYOND
        effects = " with ".join(f.form for f in self.effects)
        alike = [key for found in self.effects for key in found.tie_class if key != found.form]
        rivals = [*alike, *(" with ".join(t) for t in self.ties)]
        if self.status == "tie" and not rivals:
            others = [f"{name} {shown_share(p)}" for name, p in self.odds.items() if name != effects and p >= EXCLUDED]
            return NOT_SURE.format(effects=effects, others="; ".join(others[:3]) or "others")
        if self.status == "no_disagreement" and self.localisation and self.explanations:
            share = shown_share(self.odds.get(NOTHING, 0.0))
            return WITHIN_FORM.format(share=share, count=len(self.localisation))
        return WORDS[self.status].format(effects=effects, rivals="; ".join(rivals))

    def apply(self) -> Machine:
        """The machine with the new calibration, and the effects where they are named or tied."""
        return extended(self)

    def as_dict(self) -> dict[str, Any]:
        """As plain numbers and text, for JSON."""
        return {
            "status": self.status,
            "verdict": self.sentence,
            "effects": [
                {"effect": f.effect, "form": f.form, "parameters": f.parameters, "sd": f.sd, "class": list(f.tie_class)}
                for f in self.effects
            ],
            "ties": [list(t) for t in self.ties],
            "unknown": self.unknown,
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
            **({} if self.planned is None else {"plan": self.planned.as_dict()}),
            **({} if self.steps is None else {"steps": self.steps.as_dict()}),
            "tried": list(self.tried),
            "data_hash": self.data_hash,
        }  # fmt: skip


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value

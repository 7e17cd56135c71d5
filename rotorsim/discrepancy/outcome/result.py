"""Result of a diagnosis: verdict, effects with uncertainties, ties, unexplained part, gap, next experiment."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.base.exchange.notebook import Card, Shown
from rotorsim.base.reported import Reported
from rotorsim.discrepancy.odds.explanation import LEAST_SHOWN, Explanation, shown_share
from rotorsim.discrepancy.outcome.findings import Findings
from rotorsim.discrepancy.outcome.gap import reduction
from rotorsim.discrepancy.outcome.machine_file import extended
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

NO_ACCURACY = (
    "nothing states how exact the records are: they may agree or be too coarse to disagree; give accuracy (a "
    "displacement), or record one operating point twice"
)
NOTHING_BEYOND = (
    "Unknown: nothing disagrees beyond the scatter within the records, but how exact they are is not stated."
)


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Shown, Findings, Reported):
    """Result of `diagnose`."""

    localisation: tuple[Flag, ...]
    unknown: dict[str, Any]
    next_experiment: dict[str, Any]
    gap: xr.Dataset
    notes: tuple[str, ...]
    spectra: dict[str, Any] = field(default_factory=dict, repr=False)
    tried: tuple[dict[str, Any], ...] = ()
    odds: tuple[Explanation, ...] = ()
    """Explanations with their probabilities, the most probable first."""
    plan: Plan | None = None
    """The next experiments, where they were asked for."""

    def card(self) -> Card:
        """Verdict, sizes of the effects, next experiment."""
        rows = [
            (found.form, ", ".join(f"{name} = {value}{f' +- {sd}' if sd else ''}" for name, value, sd in found.sizes()))
            for found in self.effects
        ]
        rows += [("indistinguishable", "; ".join(" with ".join(tie) for tie in self.ties))] if self.ties else []
        rows += [("probability", f"{shown_share(e.probability)} {e.name}") for e in self.odds[:3]]
        if self.next_experiment:
            rows.append(("next experiment", str(self.next_experiment["experiment"])))
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
        rivals = "; ".join([*alike, *(" with ".join(t) for t in self.ties)])
        return WORDS[self.status].format(effects=effects, rivals=rivals)

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
            "next_experiment": self.next_experiment,
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
            "odds": [
                {
                    "effects": list(e.effects), "beyond_catalogue": e.beyond, "name": e.name,
                    "probability": e.probability, "log_evidence": e.evidence, "form_error": e.error,
                    "refitted": e.refitted,
                    "alike": [list(keys) for keys in e.alike],
                }
                for e in self.odds if e.probability >= LEAST_SHOWN
            ],
            **({} if self.plan is None else {"plan": self.plan.as_dict()}),
            "tried": list(self.tried),
            "data_hash": self.data_hash,
        }  # fmt: skip


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value

"""Result of a diagnosis: verdict, effects with uncertainties, ties, unexplained part, gap, next experiment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from importlib import import_module
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.discrepancy.outcome.gap import reduction
from rotorsim.discrepancy.outcome.machine_file import extended
from rotorsim.discrepancy.residuals.localise import Flag
from rotorsim.effects import REGISTRY

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine import Machine

EXIT_CODES = {"no_disagreement": 0, "named": 10, "tie": 11, "partial": 11, "unknown": 12}
WORDS = {
    "no_disagreement": "No disagreement: after re-calibration every group of lines is within the floor.",
    "named": "Named: {effects}.",
    "tie": "Tie: the records show {effects}, or, indistinguishable from it: {rivals}.",
    "partial": "Partial: {effects} helps, but much of the disagreement stays; this is not a name.",
    "unknown": "Unknown: no effect of the catalogue explains the disagreement; see the equivalent force.",
}


@dataclass(frozen=True)
class Found:
    """Identified effect: name, form, table of parameters for the machine file (SI), standard deviations."""

    effect: str
    form: str
    parameters: dict[str, float]
    sd: dict[str, float]
    tie_class: tuple[str, ...]

    def sizes(self) -> Iterator[tuple[str, str, str]]:
        """Parameter, value and standard deviation in display units; no standard deviation where it was held."""
        units = {f.name: f.metadata.get("unit", "") for f in fields(REGISTRY[self.effect])}
        for name, value in self.parameters.items():
            sd = _with_unit(self.sd[name], units[name], 2) if name in self.sd else ""
            yield name, _with_unit(value, units[name], 4), sd


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Result of `diagnose`."""

    status: str
    machine: Machine
    localisation: tuple[Flag, ...]
    effects: tuple[Found, ...]
    ties: tuple[tuple[str, ...], ...]
    unknown: dict[str, Any]
    next_experiment: dict[str, Any]
    gap: xr.Dataset
    notes: tuple[str, ...]
    calibration: dict[str, tuple[float, float]]
    evidence: dict[str, float]
    data_hash: str
    spectra: dict[str, Any] = field(default_factory=dict, repr=False)
    tried: tuple[dict[str, Any], ...] = ()

    @property
    def exit_code(self) -> int:
        """0 no disagreement, 10 named, 11 tie or partial, 12 unknown."""
        return EXIT_CODES[self.status]

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        effects = " with ".join(f.form for f in self.effects)
        rivals = "; ".join(" with ".join(t) for t in self.ties)
        return WORDS[self.status].format(effects=effects, rivals=rivals)

    def apply(self) -> Machine:
        """The machine with the effects found and the new calibration; the machine itself where none was found."""
        return extended(self)

    def report(self, path: str | Path) -> None:
        """Write the HTML report."""
        import_module("rotorsim.report.pages.diagnosis").write_diagnosis(self, Path(path))

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
                    "um": f.rms * 1e6, "floor_um": f.floor * 1e6, "excess": f.excess,
                }
                for f in self.localisation
            ],
            "gap_reduction_untouched": _number(reduction(self.gap)),
            "gap_reduction_fit": _number(reduction(self.gap, "fit")),
            "calibration": {k: {"value": v, "sd": s} for k, (v, s) in self.calibration.items()},
            "evidence": self.evidence,
            "notes": list(self.notes),
            "tried": list(self.tried),
            "data_hash": self.data_hash,
        }  # fmt: skip


def _with_unit(value: float, unit: str, digits: int) -> str:
    """A number of SI with its unit; lengths in micrometres, angles in degrees."""
    factor, shown = {"m": (1e6, "um"), "rad": (180 / pi, "deg"), "1": (1.0, "")}.get(unit, (1.0, unit))
    return f"{value * factor:.{digits}g} {shown}".rstrip()


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value

"""Identifiability of effects: which ones a campaign cannot distinguish, and what survives re-calibration.

Signatures are those of a machine at its nominal point under a campaign's inputs (its own, or the standard one), with
the calibration projected out. Two effects whose signatures make a cosine above 0.95 are aliases.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification import make_record
from rotorsim.discrepancy.data.intake import make_trial, make_trials, open_records
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.fit import ParameterFit, singular_directions
from rotorsim.discrepancy.plan.experiments import campaign
from rotorsim.discrepancy.residuals.comparison import SensitivityColumns, TwinComparison, columns
from rotorsim.discrepancy.search.candidates import candidates, class_of, resembles, screen
from rotorsim.discrepancy.twin.compiled_models import GRID, STEP
from rotorsim.discrepancy.twin.parameters import ParameterPoint, calibration
from rotorsim.discrepancy.twin.plant import Twin
from rotorsim.machine import Machine, load_machine

ALIAS = 0.95
"""Cosine of two signatures above which their effects are aliases."""
NOISE = 5e-9
"""Floor [m] of a line where no record gives one."""


@dataclass(frozen=True, eq=False)
class AliasMatrix:
    """Effect names, cosines of signatures (k, k), surviving fractions, steps that make a chi-square of 50."""

    names: tuple[str, ...]
    likeness: np.ndarray
    survives: np.ndarray
    detectable: np.ndarray
    null: list[dict[str, float]]

    def aliases(self) -> list[tuple[str, ...]]:
        """Classes of effects that are alike, exact ones joined to those measured."""
        left, out = set(self.names), []
        for i, name in enumerate(self.names):
            if name not in left:
                continue
            near = {self.names[j] for j in np.flatnonzero(self.likeness[i] > ALIAS)} | set(class_of(name, self.names))
            near &= left | {name}
            left -= near
            if len(near) > 1:
                out.append(tuple(sorted(near)))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Plain lists of names, cosines, shares and classes, for JSON."""
        return {
            "names": list(self.names), "likeness": self.likeness.round(4).tolist(),
            "survives": self.survives.round(5).tolist(), "detectable_steps": self.detectable.tolist(),
            "aliases": [list(a) for a in self.aliases()], "null_vectors": self.null,
        }  # fmt: skip


def standard_trials(machine: Machine) -> list[Trial]:
    """Inputs of the standard campaign's records for the fit, without measured data."""
    trials = []
    for planned in campaign(machine):
        if planned.role != "fit" or planned.name.endswith("repeat"):
            continue
        rows = planned.experiment.rows(0, planned.experiment.samples)
        values = {"disc_measured": np.zeros((len(rows), 2)), "speed": rows[:, 0], "pressure": rows[:, 1],
                  "disc_force": rows[:, 4:6]}  # fmt: skip
        if machine.film is not None:
            values["reference"] = rows[:, 2:4]
        record = make_record(np.arange(len(rows)) * 2e-4, values, {"role": "fit", "record": planned.name})
        trials.append(make_trial(record, "fit", planned.name))
    return trials


def alias_matrix(
    machine: Machine | str | Path,
    records: Iterable[Any] | None = None,
    mapping: Any = None,
    progress: Callable[[str], None] = lambda stage: None,
) -> AliasMatrix:
    """Alias matrix of a machine for the inputs of records or of the standard campaign.

    Examples
    --------
    >>> import rotorsim as rs
    >>> matrix = rs.discrepancy.alias_matrix("dtu_gas_bearing")  # doctest: +SKIP
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    trials = standard_trials(machine)
    if records is not None:
        trials = [t for t in make_trials(machine, open_records(records, mapping), None) if t.role == "fit"]
    comparison = TwinComparison(Twin(machine, GRID, STEP), trials)
    comparison.sigma = np.full_like(comparison.measured, NOISE)
    parameters = calibration(comparison.twin, len(trials))
    start = ParameterPoint()
    J = columns(comparison, start, parameters, lambda: progress("calibrate")) / NOISE
    base = ParameterFit(parameters, start, np.zeros(len(J)), J, 0.0)
    forms, S, store = [], [], SensitivityColumns(comparison)
    for form in candidates(comparison.twin):
        progress("screen")
        own = store.columns(start.holding(form.fixed), form.parameters)
        if form.has_response(own):
            forms.append(form)
            S.append(own / NOISE)
    view = screen(base, forms, S)
    best: dict[str, int] = {}
    for i, form in enumerate(forms):
        if form.key not in best or view.size(i) > view.size(best[form.key]):
            best[form.key] = i
    chosen = sorted(best.items())
    seen = [(k, i) for k, i in chosen if view.size(i) > 0]
    likeness = np.array([[view.likeness(i, j) for _, j in seen] for _, i in seen])
    size = np.array([view.size(i) for _, i in seen])
    free = [i for i, k in enumerate(parameters) if not k.trend]
    null = singular_directions(J[:, free], [parameters[i] for i in free])
    survives = np.array([view.survives(i) for _, i in seen])
    return AliasMatrix(tuple(k for k, _ in seen), likeness, survives, np.sqrt(50) / size, null)


def markdown(matrix: AliasMatrix) -> str:
    """Alias matrix as a Markdown table: every effect with its nearest alias, and the classes.

    Examples
    --------
    >>> import rotorsim as rs
    >>> text = rs.discrepancy.markdown(rs.discrepancy.alias_matrix("dtu_gas_bearing"))  # doctest: +SKIP
    """
    rows = ["| effect | survives re-calibration | like it (cosine) | also |", "|---|---|---|---|"]
    for i, name in enumerate(matrix.names):
        others = np.argsort(-matrix.likeness[i])
        near = [f"{matrix.names[j]} ({matrix.likeness[i, j]:.2f})" for j in others if j != i][:3]
        rows.append(f"| {name} | {100 * matrix.survives[i]:.3g} % | {', '.join(near)} | {resembles(name)} |")
    classes = [f"- {', '.join(a)}" for a in matrix.aliases()]
    lines = ["", "Indistinguishable in this campaign:", *(classes or ["- none"])]
    for null in matrix.null:
        lines += ["", "Null vector of the calibration: " + ", ".join(f"{v:+.2f} {k}" for k, v in null.items())]
    return "\n".join([*rows, *lines])

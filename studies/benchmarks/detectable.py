"""Detection limits of a diagnosis: smallest size of each effect that rises above the noise floor.

A size is detectable whose projected signature makes a chi-square of 50 in the records to fit of a machine in which
nothing is hidden. What is smaller can only be met with silence; flags want two to five times as much.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from rotorsim.discrepancy.calibration import CompiledModels
from rotorsim.discrepancy.candidates import Screening, candidates, screen
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.fit import recalibrate, relinearised
from rotorsim.discrepancy.hidden_machine import HiddenTruth, hide
from rotorsim.discrepancy.records import make_trials, open_records
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import Machine

CHI2 = 50.0


@dataclass(frozen=True, eq=False)
class Detectable:
    """Projected signatures of all forms; `place` finds a form by its label."""

    view: Screening
    place: dict[str, int]

    @classmethod
    def of(cls, machine: Machine, truth_plant: Twin, models: CompiledModels, seed: int = 0) -> Detectable:
        """From records of the campaign in which nothing is hidden."""
        records = hide(machine, (), seed, twin=truth_plant, tiled=True)
        trials = [t for t in make_trials(machine, open_records(records, None), None) if t.role == "fit"]
        comparison = TwinComparison(models.twin, trials, threads=1)
        base = relinearised(comparison, recalibrate(comparison, models.fine, law=models.law))
        base = replace(base, J=comparison.jacobian(base.point, base.parameters))
        forms, here = candidates(models.twin), comparison.predict(base.point)
        columns = [comparison.jacobian(base.point.holding(f.fixed), f.parameters, here) for f in forms]
        return cls(screen(base, forms, columns), {f.label: i for i, f in enumerate(forms)})

    def times(self, truth: HiddenTruth) -> float:
        """Size of the least hidden effect over its detectable size; infinite where nothing is hidden."""
        found = inf
        for form, amplitude in zip(truth.forms, truth.amplitudes, strict=True):
            if form.label not in self.place:
                return 0.0
            own = self.view.where[self.place[form.label]]
            steps = np.array(amplitude) / [k.step for k in form.parameters]
            found = min(found, sqrt(max(float(steps @ self.view.gram[own, own] @ steps), 0.0) / CHI2))
        return found

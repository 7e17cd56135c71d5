"""Reference outputs of the Python plant for a unit's inputs, at the unit's communication points.

The plant writes what it is BEFORE a sample with that sample's inputs already held; a unit shows what it is at the END
of a step. So row k + 1 of the plant is what the unit shows after step k, but for what follows a held input at once
(supply pressure, and pins without actuators): there the rows at which that input has just changed are left out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fmu.model import PlantUnit
from fmu.variables import ROW
from rotorsim.plant.simulation import Simulation

AT_ONCE = {
    "injection.line_pressure": ("injection.pressure",),
    "meas.pressure": ("injection.pressure",),
    "piezo.position": ("piezo.ref_x", "piezo.ref_y"),
}


def plant_rows(model: PlantUnit, inputs: Mapping[str, np.ndarray], step: float) -> np.ndarray:
    """Input rows (samples, 6) of the plant for rows of a unit that are held over `step` [s]; the speed is linear."""
    per = round(step / model.sample)
    n = len(inputs["drive.on"])
    rows = np.zeros((n * per, 6))
    for column, name in enumerate(ROW):
        if column and name in inputs:
            rows[:, column] = np.repeat(inputs[name], per)
    before = np.concatenate([[model.speed], inputs["shaft.speed_ref"][:-1]])
    for k in range(per):
        end = inputs["shaft.speed_ref"]
        rows[k::per, 0] = end if k + 1 == per else before + (end - before) * ((k + 1) / per)
    rows[np.repeat(inputs["drive.on"], per) == 0.0, 0] = np.nan
    return rows


def plant_outputs(
    model: PlantUnit, inputs: Mapping[str, np.ndarray], step: float, seed: int = 0
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """By output: values (n + 1,) at the communication points and which of them can be compared."""
    per = round(step / model.sample)
    rows = plant_rows(model, inputs, step)
    rows = np.vstack([rows, rows[-1:]])
    simulation = Simulation.at_equilibrium(model.assembly, model.speed, model.pressure, seed)
    table = simulation.advance(rows)
    found = {}
    for v in model.variables:
        if v.store == "output" and v.index < table.shape[1]:
            values = table[::per, v.index]
            if v.name == "film.touchdown":
                touched = table[1:, v.index].reshape(-1, per).max(axis=1)
                values = np.concatenate([table[:1, v.index], touched])
            found[v.name] = values, _comparable(model, v.name, inputs)
    return found


def _comparable(model: PlantUnit, name: str, inputs: Mapping[str, np.ndarray]) -> np.ndarray:
    n = len(inputs["drive.on"])
    good = np.ones(n + 1, bool)
    for start, causes in AT_ONCE.items():
        if name.startswith(start) and not (start.startswith("piezo") and model.assembly.rig.driven > 0):
            for cause in causes:
                changes = np.flatnonzero(np.diff(inputs[cause]) != 0) + 1
                good[changes] = False
    # what the first row of the plant holds of the first inputs, the unit has only after its first step
    first = any(inputs[c][0] != start for c, start in _starts(model).items())
    good[0] = good[0] and not (first and any(name.startswith(s) for s in AT_ONCE))
    return good


def _starts(model: PlantUnit) -> dict[str, float]:
    return {v.name: float(v.start or 0.0) for v in model.variables if v.store == "input" and v.kind == "real"}

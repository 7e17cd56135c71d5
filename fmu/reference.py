"""Reference run stored in a unit: inputs and outputs that `check` compares with the Python plant."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmu.importer import ImportedUnit
from fmu.law_unit import LawUnit
from fmu.model import PlantUnit, Unit
from fmu.variables import UnitVariable
from rotorsim.base.errors import DataError

SAMPLES = 5
"""Samples in a step of the stored run."""
ROWS = 300
FORCE, VOLTS, PRESSURE_STEP, ACCELERATION = 20.0, 0.5, 0.02e6, 50.0
"""Force on the disc [N], at most; reference [V], step of the pressure [Pa], acceleration of the shaft [rad/s^2]."""
LIGHT = 6.0
"""Force on the disc [m/s^2] over the mass of the rotor, at most."""


@dataclass(frozen=True)
class Reference:
    """Input rows (n, inputs) and outputs (n + 1, outputs) every `step` [s], under the names of the variables."""

    step: float
    inputs: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]


def input_variables(model: Unit) -> list[UnitVariable]:
    """Inputs that a run is made of."""
    return [v for v in model.variables if v.store == "input"]


def reference_inputs(model: Unit, n: int, step: float) -> dict[str, np.ndarray]:
    """A run-up with a pressure step, a step of the reference and a hit on the disc, all within n steps."""
    if isinstance(model, LawUnit):
        return model.stimuli(n, step)
    rows = {v.name: np.full(n, float(v.start or 0.0)) for v in input_variables(model)}
    k = np.arange(n)
    rows["shaft.speed_ref"] += ACCELERATION * step * (k + 1)
    if "injection.pressure" in rows:
        rows["injection.pressure"][n // 3 :] += PRESSURE_STEP
    if "piezo.ref_x" in rows:
        rows["piezo.ref_x"][n // 2 :] = VOLTS
        rows["piezo.ref_y"][2 * n // 3 :] = -VOLTS
    if "disc.force_x" in rows:
        rows["disc.force_x"][3 * n // 4 : 3 * n // 4 + 1] = _hit(model)
    return {v.name: np.clip(rows[v.name], v.low, v.high) for v in input_variables(model)}


def _hit(model: Unit) -> float:
    """Force [N] that the disc of a heavy and of a light rotor survives."""
    return min(FORCE, LIGHT * model.plant.machine.mass) if isinstance(model, PlantUnit) else FORCE


def make_reference(model: Unit, path: Path) -> Reference:
    """Run the unit at `path`, which has a binary for this computer."""
    step = SAMPLES * model.sample
    inputs = reference_inputs(model, ROWS, step)
    with ImportedUnit(path) as unit:
        names = unit.names("output")
        instance = unit.instance("reference")
        try:
            instance.initialise()
            rows = instance.run(inputs, step, names)
        except Exception as error:  # FMPy has several
            raise DataError("; ".join(instance.messages) or str(error)) from error
        instance.close()
    return Reference(step, inputs, dict(zip(names, rows.T, strict=True)))


def table(columns: dict[str, np.ndarray], step: float) -> str:
    """CSV with time first; numbers read back to the last bit."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time", *columns])
    for k, row in enumerate(zip(*columns.values(), strict=True)):
        writer.writerow([repr(round(k * step, 9)), *(repr(float(x)) for x in row)])
    return stream.getvalue()

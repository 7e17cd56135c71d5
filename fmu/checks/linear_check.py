"""Checks of an identified model's unit: trajectory against `LpvModel.simulate`, exact derivatives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fmu.checks.importer import ImportedUnit, fmi2_callbacks
from fmu.linear_model import LinearUnit

POINTS = 5


def simulated(model: LinearUnit, inputs: dict[str, np.ndarray], step: float) -> np.ndarray:
    """Outputs (n + 1, 2) [m] of the model in Python for input rows of a unit held over `step` [s]."""
    per = round(step / model.sample)
    held = {name: np.repeat(values, per) for name, values in inputs.items()}
    u = np.stack([held["piezo.ref_x"], held["piezo.ref_y"]], axis=1)
    speed, pressure = (np.append(v, v[-1]) for v in (held["shaft.speed_ref"], held["injection.pressure"]))
    y = model.lpv.simulate(np.vstack([u, u[-1]]), speed, pressure, model.sample, tolerance=0.0)
    return np.asarray(y[::per])


def moving_inputs(model: LinearUnit, n: int) -> dict[str, np.ndarray]:
    """References that step and an operating point that moves through the range; it stays where C moves with it."""
    s = np.linspace(0.0, 1.0, n)
    moves = 0.0 if model.lpv.kind == "blackbox" else 1.0
    low, high = model.lpv.low, model.lpv.high
    return {
        "piezo.ref_x": np.where(s > 0.1, 0.5, 0.0),
        "piezo.ref_y": np.where(s > 0.5, -0.5, 0.0),
        "shaft.speed_ref": low[0] + (high[0] - low[0]) * moves * np.round(20 * s) / 20,
        "injection.pressure": low[1] + (high[1] - low[1]) * moves * np.round(10 * s) / 10,
    }


def model_exchange(unit: ImportedUnit, stop: float | None = None) -> Any:
    """An instance for model exchange, in continuous-time mode at t = 0; `stop` [s] is the end of the run."""
    d = unit.description
    common = {
        "guid": d.guid, "unzipDirectory": unit.folder, "modelIdentifier": d.modelExchange.modelIdentifier,
        "instanceName": "exchange",
    }  # fmt: skip
    if unit.is_3:
        from fmpy.fmi3 import FMU3Model

        instance: Any = FMU3Model(**common)
        instance.instantiate()
    else:
        from fmpy.fmi2 import FMU2Model

        instance = FMU2Model(**common)
        instance.instantiate(callbacks=fmi2_callbacks(print))
        instance.setupExperiment(stopTime=stop)
    instance.enterInitializationMode(**({"stopTime": stop} if unit.is_3 else {}))
    instance.exitInitializationMode()
    if not unit.is_3:
        instance.newDiscreteStates()
    else:
        instance.updateDiscreteStates()
    instance.enterContinuousTimeMode()
    return instance


def jacobian(unit: ImportedUnit, instance: Any, unknowns: list[str], knowns: list[str]) -> np.ndarray:
    """Directional derivatives (unknowns, knowns), column by column."""
    refs = {name: v.valueReference for name, v in unit.variables.items()}
    rows = [refs[name] for name in unknowns]
    columns = [instance.getDirectionalDerivative(rows, [refs[known]], [1.0]) for known in knowns]
    return np.array(columns, float).T


def names(model: LinearUnit) -> tuple[list[str], list[str]]:
    """Unknowns and knowns in the order of [A B; C D]."""
    states = [f"x[{k + 1}]" for k in range(model.order)]
    inputs = ["piezo.ref_x", "piezo.ref_y"]
    return [f"der({s})" for s in states] + ["disc.x", "disc.y"], states + inputs


def derivative_error(unit: ImportedUnit, model: LinearUnit) -> float:
    """Largest deviation of the directional derivatives from A, B, C, D at random points, over the largest element."""
    rng, worst = np.random.default_rng(0), 0.0
    instance = model_exchange(unit)
    set_real = instance.setFloat64 if unit.is_3 else instance.setReal
    refs = [unit.variables[name].valueReference for name in ("shaft.speed_ref", "injection.pressure")]
    for _ in range(POINTS):
        q = rng.uniform(model.lpv.low, model.lpv.high)
        set_real(refs, q.tolist())
        found = jacobian(unit, instance, *names(model))
        m = model.lpv.at(*q)
        wanted = np.block([[m.A, m.B], [m.C, m.D]])
        worst = max(worst, float(np.abs(found - wanted).max() / np.abs(wanted).max()))
    instance.terminate()
    instance.freeInstance()
    return worst


def linear_checks(unit: ImportedUnit, model: LinearUnit, n: int) -> Iterator[tuple[str, str, bool]]:
    """Name, value, passed of each check."""
    inputs = moving_inputs(model, n)
    truth = simulated(model, inputs, model.sample)
    instance = unit.instance()
    instance.initialise({name: float(values[0]) for name, values in inputs.items()})
    rows = instance.run(inputs, model.sample, ["disc.x", "disc.y"])
    instance.close()
    worst = float(np.abs(rows - truth).max() / np.abs(truth).max())
    yield f"{n * model.sample:g} s against the Python model", f"relative deviation {worst:.2g}", worst < 1e-9
    if model.continuous:
        error = derivative_error(unit, model)
        yield "directional derivatives against A, B, C, D", f"relative deviation {error:.2g}", error < 1e-12

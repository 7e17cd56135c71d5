"""Test cases of the diagnosis benchmark: hidden effects, disturbances and their records."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.discrepancy import hide
from rotorsim.discrepancy.calibration import REFERENCE_PRESSURE, FitParameter, flow_key
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.experiments import PlannedRecord
from rotorsim.discrepancy.hidden_machine import HiddenTruth, draw
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import Machine

KINDS = ("none", "single", "single", "pair", "foreign", "single", "left_out", "law", "noise", "single")
"""Kinds of cases, in turn."""
NOT_DRAWN = (
    "actuator_delay", "actuator_gain", "amplifier_lag", "asymmetric_shaft", "base_vibration", "creep", "gas_heating",
    "labyrinth_seal", "rub", "slip", "supply_droop", "torque_ripple", "unbalance",
)  # fmt: skip
"""Effects that no case hides: an excitation without mean cannot show them, their shape is not varied by a draw, the
gauge at the injectors shows them, or they are younger than stored cases, whose numbers draw among all others."""
MOST_DRAWS, AGAIN = 20, 10_000_000
"""Most draws of a machine, and the step between their seeds."""


def foreign(kind: int) -> Callable[[np.ndarray, PlannedRecord], np.ndarray]:
    """A disturbance of the inputs that no effect of the catalogue makes."""

    def disturb(rows: np.ndarray, planned: PlannedRecord) -> np.ndarray:
        t = np.arange(len(rows)) * 2e-4
        angle = rows[0, 0] * t
        if kind == 0:
            rows[:, 4] += 0.6 * np.sin(2 * np.pi * 136.25 * t)
        elif kind == 1:
            rows[:, 4] += 0.5 * np.cos(4 * angle)
            rows[:, 5] += 0.5 * np.sin(4 * angle)
        elif kind == 2:
            rows[:, 5] += 0.8 * np.cos(0.5 * angle)
        elif kind == 3:
            rows[:, 1] *= 1 + 0.03 * np.sin(2 * np.pi * 31.25 * t)
        else:
            slow = 1 + 0.8 * np.cos(2 * np.pi * 6.25 * t)
            rows[:, 4] += 1.5 * slow * np.cos(angle)
            rows[:, 5] += 1.5 * slow * np.sin(angle)
        return rows

    return disturb


@dataclass(frozen=True)
class Bent(FitParameter):
    """Fit parameter whose trend follows another power of the pressure than the calibration's."""

    power: float = 0.0

    def share(self, speed: float, pressure: float) -> float:
        """1 at 1 MPa, 0 at the reference pressure."""
        return float(((pressure / REFERENCE_PRESSURE) ** self.power - 1) / (2**self.power - 1))


def law_error(truth: HiddenTruth, twin: Twin, rng: np.random.Generator) -> HiddenTruth:
    """Another pressure law of the pins: 5 % more or less flow when the pressure doubles, by some power of it."""
    parameter = Bent(flow_key(twin), 0.02, trend="pressure", power=float(rng.choice([-1.0, 0.5, 2.0])))
    values = {**truth.point.values, parameter: float(rng.choice([-0.05, 0.05]))}
    return replace(truth, point=replace(truth.point, values=values))


def hidden_case(
    number: int, kind: str, machine: Machine, truth_plant: Twin
) -> tuple[list[str], HiddenTruth, list[Any]]:
    """Effects, truth and records of a case; a machine that does not lift off is drawn again."""
    rng = np.random.default_rng([number, 11])
    pool = pool_of(truth_plant)
    count = {"single": 1, "left_out": 1, "pair": 2}.get(kind, 0)
    for attempt in range(MOST_DRAWS):
        seed = number + attempt * AGAIN
        picked = pick(pool, count, rng)
        truth = draw(truth_plant, picked, seed)
        disturb = foreign(int(rng.integers(5))) if kind == "foreign" else None
        if kind == "law":
            truth = law_error(truth, truth_plant, rng)
        if kind == "noise":
            values = {**truth.point.values, FitParameter("noise.0.sigma", 1e-7): 0.66e-6}
            truth = replace(truth, point=replace(truth.point, values=values))
        with suppress(DataError):
            records = hide(machine, picked, seed, truth=truth, disturb=disturb, twin=truth_plant, tiled=True)
            return picked, truth, records
    raise DataError(f"bench: case {number} has no machine that lifts off; begin with another seed")


def pool_of(truth_plant: Twin) -> list[str]:
    """Keys of the effects that a case may hide."""
    return sorted({f.key for f in candidates(truth_plant) if f.effect not in NOT_DRAWN})


def pick(pool: list[str], count: int, rng: np.random.Generator) -> list[str]:
    """Keys of different effects."""
    while True:
        picked = [pool[i] for i in rng.choice(len(pool), count, replace=False)]
        if len({p.split(".")[0] for p in picked}) == count:
            return picked


def scaled(truth: HiddenTruth, factor: float) -> HiddenTruth:
    """Same truth with the amplitudes of the hidden effects multiplied by a factor."""
    values = dict(truth.point.values)
    for form in truth.forms:
        for parameter in form.parameters:
            values[parameter] *= factor
    return replace(truth, point=replace(truth.point, values=values))

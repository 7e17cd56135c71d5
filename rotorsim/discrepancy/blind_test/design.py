"""Standard measurement campaign for a diagnosis, which `hide` also records.

Six operating points to fit, four held out, four untouched, at two amplitudes. A multisine's period holds whole
revolutions and its lines miss every order: lines are at odd multiples of 2.5 Hz, speeds at even ones. A
rotor without actuators is hit by a hammer instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.base.constants import MPA
from rotorsim.experiments import Experiment, Impact, Multisine
from rotorsim.machine import Machine

PERIOD, PERIODS, SPACING, LOW, HIGH = 0.8, 3, 4, 2.5, 250.0
POINTS = {
    "fit": ((20, 0.30, 1.0), (40, 0.50, 0.5), (55, 0.70, 1.0), (70, 0.40, 0.5), (85, 0.60, 1.0), (100, 0.50, 0.5)),
    "held_out": ((30, 0.60, 1.0), (50, 0.35, 0.5), (65, 0.55, 1.0), (90, 0.45, 0.5)),
    "untouched": ((25, 0.45, 0.5), (45, 0.65, 1.0), (75, 0.50, 0.5), (95, 0.35, 1.0)),
}
"""Speed [Hz], pressure [MPa], amplitude [1 V, or 20 N of a hammer] by role."""
REPEATED = (1, 4)
"""Which records to fit are made twice."""


@dataclass(frozen=True)
class PlannedRecord:
    """Planned record: file name, role, experiment, noise seed number."""

    name: str
    role: str
    experiment: Experiment
    noise: int


def campaign(machine: Machine) -> tuple[PlannedRecord, ...]:
    """Planned records of the standard campaign for a machine."""
    plan: list[PlannedRecord] = []
    for role, points in POINTS.items():
        for i, (hertz, pressure, amplitude) in enumerate(points):
            one = _experiment(machine, hertz, pressure, amplitude, len(plan))
            plan.append(PlannedRecord(f"{role}_{i + 1}", role, one, len(plan)))
    repeats = [
        PlannedRecord(f"{plan[i].name}_repeat", "fit", plan[i].experiment, len(plan) + k)
        for k, i in enumerate(REPEATED)
    ]
    return (*plan, *repeats)


def _experiment(machine: Machine, hertz: float, pressure: float, amplitude: float, number: int) -> Experiment:
    speed = 2 * np.pi * hertz
    if machine.film is not None and machine.injectors:
        return Multisine(speed, pressure * MPA, amplitude, LOW, HIGH, PERIOD, PERIODS, SPACING, sequence=number)
    angle = float(np.deg2rad(35 + 20 * (number % 3)))
    return Impact(speed, 0.0, 20 * amplitude, 2e-3, angle, 2, 1.0, 0.4)

"""Numbers for claim I13: hysteresis opening and creep drift of the actuators."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.base.units import RIG_SAMPLE, TO_UM
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import COLUMNS

QUARTER = 4000
"""Samples of a quarter of the slow triangle of +-5 V."""
PRESSURE = 0.3e6
PEAKS = {"voltage": 5.0, "reference": 2.0}
"""Amplitude [V] of the triangle, and the step, on the amplifier and on the controlled stack."""
SETTLED, LATE = 0.1, 10.0
"""Times [s] after a step between which the drift is taken."""


def hysteresis(machine: str) -> dict[str, Any]:
    """Opening and travel [m] of a pin over a slow triangle and drift over step, without and with control of travel."""
    found = {}
    for mode, peak in PEAKS.items():
        plant = Plant(Machine.from_text(machine).replace("actuators.mode", mode))
        reference, step = triangle(peak), np.full(round(LATE / RIG_SAMPLE), peak)
        found[mode] = (*opening(reference, _pin(plant, reference)), drift(_pin(plant, step)))
    return found


def hysteresis_numbers(found: dict[str, Any]) -> dict[str, float]:
    """Figures of claim I13."""
    (open_, travel, free), (held, moved, kept) = (found[mode] for mode in PEAKS)
    share = open_ / travel
    return {"opening": TO_UM * open_, "share": 100 * share, "left": held / moved / share, "creep": kept / free}


def _pin(plant: Plant, reference: np.ndarray) -> np.ndarray:
    """Travel [m] of the first pin from rest under a reference in y [V]."""
    inputs = np.zeros((len(reference), 6))
    inputs[:, 1], inputs[:, 3] = PRESSURE, reference
    return np.asarray(plant.start(0.0, PRESSURE).advance(inputs)[:, len(COLUMNS)])


def triangle(peak: float) -> np.ndarray:
    """Up to the peak [V], then two full cycles."""
    up, down = np.linspace(-peak, peak, 2 * QUARTER), np.linspace(peak, -peak, 2 * QUARTER)
    return np.concatenate([np.linspace(0, peak, QUARTER), down, up, down, up])


def opening(reference: np.ndarray, travel: np.ndarray) -> tuple[float, float]:
    """Distance of the falling and the rising branch of the last cycle in the middle, and the travel."""
    falling, rising = slice(5 * QUARTER, 7 * QUARTER), slice(7 * QUARTER, 9 * QUARTER)
    down = np.interp(0.0, -reference[falling], travel[falling])
    up = np.interp(0.0, reference[rising], travel[rising])
    return abs(float(down - up)), float(np.ptp(travel[5 * QUARTER :]))


def drift(travel: np.ndarray) -> float:
    """Change from `SETTLED` to the end of a step's response over its first part."""
    settled = travel[round(SETTLED / RIG_SAMPLE)] - travel[0]
    return abs(float((travel[-1] - travel[0] - settled) / settled))

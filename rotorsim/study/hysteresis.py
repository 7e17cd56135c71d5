"""Claim I13 on the actuators alone: how far a stack's loop opens, and what the control of its travel leaves of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.columns import COLUMNS
from rotorsim.study.claims import Claim

QUARTER = 4000
"""Samples of a quarter of the slow triangle of +-5 V."""
PRESSURE = 0.3e6


def hysteresis(machine: str) -> dict[str, Any]:
    """Opening and travel [m] of a pin over a slow triangle, without and with control of its travel."""
    told = {}
    for mode, peak in (("voltage", 5.0), ("reference", 2.0)):
        changed = Machine.from_text(machine).replace("actuators.mode", mode)
        reference = triangle(peak)
        inputs = np.zeros((len(reference), 6))
        inputs[:, 1], inputs[:, 3] = PRESSURE, reference
        pin = Plant(changed).start(0.0, PRESSURE).advance(inputs)[:, len(COLUMNS)]
        told[mode] = opening(reference, pin)
    return told


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


def hysteresis_claim(told: dict[str, Any]) -> Claim:
    """Row I13."""
    (open_, travel), (held, moved) = told["voltage"], told["reference"]
    ours = (
        f"{1e6 * open_:.2f} of {1e6 * travel:.1f} um ({100 * open_ / travel:.0f} %); "
        f"travel controlled {1e6 * held:.2f} of {1e6 * moved:.1f} um"
    )
    shares = open_ / travel, held / moved
    met = abs(open_ / 8.4e-6 - 1) < 0.1 and shares[1] < 0.1 * shares[0]
    why = "a slow triangle of +-5 V on the amplifier, and of +-2 V on the controlled stack"
    return Claim("I13", "hysteresis; PD control removes it", "15 %, 8.4 um", ours, "met" if met else "near", why)

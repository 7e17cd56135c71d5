r"""Damping from the last hammer blow, as a test engineer reads it, beside the eigenvalue of the linear plant.

What the rotor does at 1X, 2X and 3X is fitted to the samples from 0.4 to 0.8 s after the blow and taken away from those
before; the logarithmic decrement of what is left along the blow's axis gives zeta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.live.frame import AT
from rotorsim.machine.numerics import SAMPLE

RING, WAIT = 2000, 4000
"""Samples that ring, and samples after a blow until the reading can be taken."""
LEAD = 10
ORDERS = (1, 2, 3)


@dataclass(frozen=True)
class Reading:
    """Frequency [Hz] and damping ratio of a ring-down, or the reason why there is none."""

    axis: str
    frequency: float = 0.0
    zeta: float = 0.0
    why: str = ""


def read_ringdown(rows: np.ndarray, axis: int) -> Reading:
    """Reading from the rows (WAIT, columns + 6) that follow a blow along x (0) or y (1)."""
    from rotorsim.report.compute.decay import decay_of
    from rotorsim.report.compute.missing import MissingError

    name = "xy"[axis]
    signal = rows[:, AT[f"disc_{name}"]]
    turning = _orders(rows[:, AT["angle"]])
    turning[:, 1:] *= abs(float(rows[-1, AT["speed"]])) > 1.0
    steady = np.linalg.lstsq(turning[RING:], signal[RING:], rcond=None)[0]
    free = (signal - turning @ steady)[LEAD:RING]
    try:
        found = decay_of(np.arange(len(free)) * SAMPLE, free)
    except MissingError as error:
        return Reading(name, why=str(error))
    return Reading(name, found.frequency, found.zeta)


def _orders(angle: np.ndarray) -> np.ndarray:
    waves = [wave(order * angle) for order in ORDERS for wave in (np.cos, np.sin)]
    return np.stack([np.ones_like(angle), *waves], axis=1)

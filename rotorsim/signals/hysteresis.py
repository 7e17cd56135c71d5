"""Hysteresis loops of the actuators: pin position over reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.signals.holds import Holds
from rotorsim.signals.static_gain import Branches, branch_distance

STILL = 1e-9
"""Pins that travel less [m] are left out."""


@dataclass(frozen=True)
class Loop:
    """Rests of one pin (`injector` from 1): `pin` (step,) [m] over `reference` (step,) [V] of `axis`, its `travel` [m]
    and its `opening` [m], the largest distance of its branches at one reference (NaN without two branches)."""

    injector: int
    axis: int
    reference: np.ndarray
    pin: np.ndarray
    rising: np.ndarray
    travel: float
    opening: float


def loops(holds: Holds, gains: list[Branches]) -> list[Loop]:
    """The loop of every pin that moves, over the input that moves it most."""
    if holds.pin is None:
        return []
    found = []
    for k in range(holds.pin.shape[1]):
        best = max((_loop(holds, g, k) for g in gains), key=lambda loop: loop.travel, default=None)
        if best is not None and best.travel > STILL:
            found.append(best)
    return found


def _loop(holds: Holds, gain: Branches, k: int) -> Loop:
    assert holds.pin is not None
    pin = holds.pin[gain.steps, k]
    opening = float(branch_distance(gain.reference, pin[:, None])[0])
    return Loop(k + 1, gain.axis, gain.reference, pin, gain.rising, float(np.ptp(pin)), opening)

"""Drive of the shaft on a live rig: speed held with limited acceleration, torque, or free."""

from __future__ import annotations

from typing import Any

import numpy as np

BREAKAWAY = 1e-3
"""Speed [rad/s] from which the plant's own friction takes over when a torque starts the shaft."""


def ramp(speed: float, target: float, acceleration: float, samples: int, Ts: float) -> np.ndarray:
    """Speeds [rad/s] at the ends of the next samples of Ts [s] on a ramp from `speed` to `target`."""
    reach = acceleration * Ts * np.arange(1, samples + 1)
    return speed + np.clip(target - speed, -reach, reach)


def torque_rows(speed: float, torque: float, drag: float, samples: int) -> np.ndarray:
    """Speed inputs under torque control: NaN (free shaft); a standing shaft first needs more than the drag."""
    rows = np.full(samples, np.nan)
    if speed == 0.0 and abs(torque) > drag:
        rows[0] = np.copysign(BREAKAWAY, torque)
    return rows


def lay_on(parameters: Any, drag: float, torque: float, speed: float) -> None:
    """Apply a torque [N m], positive from x to y, to a shaft at `speed` [rad/s] in addition to the dry drag [N m]."""
    parameters.dry_drag = drag - torque * float(np.copysign(1.0, speed or torque))

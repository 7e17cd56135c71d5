"""Drive of the shaft on a live rig: speed held with limited acceleration."""

from __future__ import annotations

import numpy as np


def ramp(speed: float, target: float, acceleration: float, samples: int, Ts: float) -> np.ndarray:
    """Speeds [rad/s] at the ends of the next samples of Ts [s] on a ramp from `speed` to `target`."""
    reach = acceleration * Ts * np.arange(1, samples + 1)
    return speed + np.clip(target - speed, -reach, reach)

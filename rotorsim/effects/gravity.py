"""Weight of shaft and discs: every mass is accelerated by g in the direction `direction`.

The modal force is g times the modal participation Phi' M 1, so the whole mass distribution counts.
"""

import math
from dataclasses import dataclass

from reynolds.jit import inlined
from rotorsim.effects.base import Effect, param, register


@inlined
def gravity(t, angle, speed, acceleration, p):
    """Acceleration (ax, ay) [m/s^2] of the whole rotor."""
    return p.acceleration * math.cos(p.direction), p.acceleration * math.sin(p.direction)


@register
@dataclass(frozen=True)
class Gravity(Effect):
    """Weight of the rotor."""

    name = "gravity"
    port = "force"
    kernel = gravity
    influence = "mass"
    steady = True
    acceleration: float = param("m/s^2", bounds=(0.0, 100.0), doc="Magnitude of the gravitational acceleration.")
    direction: float = param(
        "rad", default=-math.pi / 2, bounds=(-7.0, 7.0), doc="Its direction, from x towards y; -90 deg is down."
    )

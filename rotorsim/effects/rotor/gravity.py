r"""Weight of shaft and discs: every mass is accelerated by g in one direction.

.. math:: f = M\,g\,(\cos\gamma, \sin\gamma)

The modal force is g times the modal participation Phi' M 1, so the whole mass distribution counts. Source: Newton's
law; the weight of the pedestal of a gas bearing is taken out by its alignment.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, Effect, param, register


@inlined
def gravity(t, angle, speed, acceleration, p):
    """Acceleration (ax, ay) [m/s^2] of the whole rotor."""
    return p.acceleration * math.cos(p.direction), p.acceleration * math.sin(p.direction)


@register
class Gravity(Effect):
    """Weight of the rotor."""

    port = "force"
    kernel = gravity
    cites = ("friswell_2010",)
    influence = "mass"
    steady = True
    role = "known"
    acceleration: float = param("m/s^2", bounds=(0.0, 100.0), doc="Magnitude of the gravitational acceleration.")
    direction: float = param(
        "rad", default=-math.pi / 2, bounds=(-TURN, TURN), doc="Its direction, from x towards y; -90 deg is down."
    )

r"""Sensor ring: both displacement probes on one ring, which is turned about the shaft.

.. math:: s_1 = x \cos a + y \sin a, \quad s_2 = y \cos a - x \sin a

The probes read along a and a + 90 deg, counted from x towards y. Gains, lags, delays and offsets stay with the
probes, so this comes before all other effects on the readings, wherever the machine file has it.

The runout that a probe reads is that of the surface under its new place. The keyphasor and the encoder stay where
they are.

Source: rotation of the axes; API 670 for two probes 90 deg apart.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, Effect, param, register


@inlined
def sensor_ring(w, reading, state, seed, sample, p):
    """Turn the displacements read into the axes of the ring, and state its angle to what follows."""
    if p.angle != 0.0:
        x, y = w[reading], w[reading + 1]
        c, s = math.cos(p.angle), math.sin(p.angle)
        w[reading] = c * x + s * y
        w[reading + 1] = c * y - s * x
        w[reading + 5] = p.angle


@register
class SensorRing(Effect):
    """Angle of the ring that holds the displacement probes."""

    port = "sensor"
    kernel = sensor_ring
    cites = ("api_670",)
    single = True
    role = "set"
    begins_chain = True
    angle: float = param("rad", bounds=(-TURN, TURN), doc="Angle of the first probe from x towards y.")

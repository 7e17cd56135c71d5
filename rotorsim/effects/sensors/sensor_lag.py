r"""First-order lag of the displacement sensors.

.. math:: T\,\dot s + s = x

exact for a displacement linear between samples. Source: any text on signals; eddy-current probes reach 10 kHz.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import SampledEffect, param, register
from rotorsim.effects.sensors.sensor_delay import late


@inlined
def sensor_lag(w, reading, state, seed, sample, p):
    """Change the displacements read; states: last input and output of both axes, and whether there are any."""
    if p.time == 0.0:
        return
    keep = math.exp(-p.interval / p.time)
    mean = (1.0 - keep) * p.time / p.interval
    for axis in range(2):
        s = state + 2 * axis
        value = w[reading + axis]
        if w[state + 4] > 0.0:
            w[reading + axis] = keep * w[s + 1] + (mean - keep) * w[s] + (1.0 - mean) * value
        w[s], w[s + 1] = value, w[reading + axis]
    w[state + 4] = 1.0


@register
class SensorLag(SampledEffect):
    """Lag of the displacement sensors."""

    port = "sensor"
    kernel = sensor_lag
    cites = ("astrom_1997",)
    states = 5
    memory = "short"
    forms = (late("time"),)
    time: float = param("s", bounds=(0.0, 1.0), doc="Time constant.")

r"""Pressure transducer: gain and zero errors, noise.

.. math:: P_m = (1 + g)\,P + P_0 + \sigma\,n_i

on the gauge injection pressure. Source: data sheets give 0.25 % of full scale.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import Effect, param, register
from rotorsim.effects.sensors import normal


@inlined
def pressure_transducer(w, reading, state, seed, sample, p):
    """Change the pressure read."""
    pressure = w[reading + 4]
    error = p.gain * pressure + p.zero
    if p.sigma > 0.0:
        error += p.sigma * normal(seed, 4.0, sample)
    w[reading + 4] = pressure + error


@register
class PressureTransducer(Effect):
    """Errors of the injection pressure's transducer."""

    port = "sensor"
    kernel = pressure_transducer
    single = True
    role = "scatter"
    random_part = "sigma"
    gain: float = param("1", bounds=(-0.5, 0.5), doc="Relative gain error.")
    zero: float = param("Pa", bounds=(-1e6, 1e6), doc="Zero error.")
    sigma: float = param("Pa", bounds=(0.0, 1e6), doc="Standard deviation of the noise.")

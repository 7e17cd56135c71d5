r"""Speed wander: the drive does not hold its speed exactly, as a turbine's, but wanders slowly about it.

.. math:: \Omega = \Omega_c\,(1 + \sigma\,\xi), \qquad
          \mathrm{E}[\xi(t)\,\xi(t + \tau)] = (1 + |\tau|/T)\,e^{-|\tau|/T}

.. math:: z_{k+1} = r z_k + (1 - r^2)^{1/2}\,n_k, \quad \xi_{k+1} = r \xi_k + \frac{1 - r^2}{(1 + r^2)^{1/2}} z_{k+1},
          \quad r = e^{-T_s/T}

xi has variance 1 and is white noise behind two equal low-passes: the acceleration of the shaft is finite, sigma Omega /
T in the rms.

The first sample of a run takes the shaft from the set speed to one off by a deviation of its own, so that two records
of one speed and two seeds are not of one speed. Ramps wander about their speed; a shaft that coasts does not. Shaft
angle and encoder follow the true speed.

n depends on (seed of the run, number of the sample) alone.

Source: the thesis' rig is driven by a turbine (1.3); Rasmussen & Williams (2006), section 4.2, for the autocorrelation
(Matérn, 3/2).
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import SampledEffect, param, register
from rotorsim.effects.sensors import normal

CHANNEL = 100.0
"""Channel of the random numbers; the next one is that of the start."""


@inlined
def speed_wander(w, state, seed, sample, speed, p):
    """Speed [rad/s] to which the drive goes for the one that is set; states: noise and deviation."""
    if p.sd == 0.0:
        return speed
    span = p.interval / p.time
    keep, lost = math.exp(-span), -math.expm1(-2.0 * span)
    draw = normal(seed, CHANNEL, sample)
    if sample == 0.0:
        w[state] = draw
        w[state + 1] = (draw + keep * normal(seed, CHANNEL + 1.0, sample)) / math.sqrt(2.0 - lost)
    else:
        w[state] = keep * w[state] + math.sqrt(lost) * draw
        w[state + 1] = keep * w[state + 1] + lost / math.sqrt(2.0 - lost) * w[state]
    return speed * (1.0 + p.sd * w[state + 1])


@register
class SpeedWander(SampledEffect):
    """Wander of the speed about the one that is set."""

    port = "drive"
    kernel = speed_wander
    cites = ("rasmussen_2006", "thesis")
    states = 2
    single = True
    memory = "short"
    role = "scatter"
    random_part = "sd"
    sd: float = param("1", bounds=(0.0, 0.1), doc="Standard deviation of the speed over the set speed; 0.01 is 1 %.")
    time: float = param("s", default=1.0, bounds=(1e-2, 1e3), doc="Correlation time T.")

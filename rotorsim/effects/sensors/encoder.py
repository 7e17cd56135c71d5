r"""Encoder: the shaft angle in whole counts, and the speed estimated from them.

.. math:: \varphi_m = \frac{2\pi}{N}\lfloor \tfrac{N\varphi}{2\pi} \rfloor, \qquad
          \Omega_m(t) = \frac{\varphi_m(t) - \varphi_m(t - m T_s)}{m T_s}

so the speed is off by less than one count in m samples, 2 pi / (N m T_s), from its mean over them. Source: thesis C.2
(2000 counts a turn); Brown, Schneider & Mulligan (1992) for the estimate.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import SampledEffect, param, register

LENGTH = 512
"""Samples kept."""


@inlined
def encoder(w, reading, state, seed, sample, p):
    """Change angle and speed read; states: a ring of angles, how many there are."""
    if p.counts == 0.0:
        return
    count = 2.0 * math.pi / p.counts
    angle = count * math.floor(w[reading + 2] / count)
    now = int(sample) % LENGTH
    known = int(w[state + LENGTH])
    back = min(known, int(p.window))
    if back > 0:
        w[reading + 3] = (angle - w[state + (now - back) % LENGTH]) / (back * p.interval)
    w[reading + 2] = angle
    w[state + now] = angle
    w[state + LENGTH] = min(known + 1.0, LENGTH - 1.0)


@register
class Encoder(SampledEffect):
    """Encoder on the shaft."""

    port = "sensor"
    kernel = encoder
    cites = ("brown_1992", "thesis")
    states = LENGTH + 1
    single = True
    role = "scatter"
    ends_chain = True
    memory = "short"
    counts: float = param("1", bounds=(0.0, 1e6), whole=True, doc="Counts a turn; 0 reads the true angle and speed.")
    window: float = param(
        "1", default=50.0, bounds=(1.0, 511.0), whole=True, doc="Samples over which the speed is estimated."
    )

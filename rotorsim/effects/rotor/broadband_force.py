r"""Broadband force on the shaft whose spectrum grows with the speed: non-synchronous vibration.

.. math:: G(f) = G_0 \left|\frac{\Omega}{\Omega_0}\right|^n \frac{1}{1 + (f/f_c)^2}

.. math:: F_{k+1} = A(\Omega)\,z_{k+1}, \quad z_{k+1} = r z_k + (1 - r^2)^{1/2}\,n_k, \quad r = e^{-2\pi f_c T_s}, \quad
          A^2 = \frac{G_0}{2 T_s}\left|\frac{\Omega}{\Omega_0}\right|^n \frac{1 - r}{1 + r}

along x and y alike and independent: a low-pass of first order with the one-sided density G at low frequencies, exact at
the samples; between two of them the force is straight.

n depends on (seed of the run, number `sequence` of the effect, number of the sample) alone. A run begins without force.

A mode of mass m, stiffness k and damping c far below f_c gets the variance G / (4 k c).

Source: thesis C.4, whose orbits round 4 krpm are not steady; Crandall & Mark (1963) for the variance. Flow in seals and
wheels gives exponents of 2 to 4.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, SampledEffect, param, register
from rotorsim.effects.sensors import normal

CHANNELS = 128.0
"""Channel of random numbers of the sequence 0 along x."""


@inlined
def broadband_force(w, state, seed, sample, speed, p):
    """Move the force on by a sample; states: filter x, y, force [N] at the sample's start x, y and at its end x, y."""
    if p.density == 0.0:
        for axis in range(4):
            w[state + 2 + axis] = 0.0
        return
    turned = p.corner * p.interval
    keep = math.exp(-turned)
    size = math.sqrt(0.5 * p.density / p.interval * math.tanh(0.5 * turned))
    size *= (abs(speed) / p.speed) ** (0.5 * p.exponent)
    for axis in range(2):
        draw = normal(seed, CHANNELS + 2.0 * p.sequence + axis, sample)
        w[state + axis] = keep * w[state + axis] + math.sqrt(-math.expm1(-2.0 * turned)) * draw
        w[state + 2 + axis] = w[state + 4 + axis]
        w[state + 4 + axis] = size * w[state + axis]


@inlined
def force_between(w, state, share, p):
    """Force (fx, fy) [N] after a `share` of the sample."""
    x, y = w[state + 2], w[state + 3]
    return x + share * (w[state + 4] - x), y + share * (w[state + 5] - y)


@register
class BroadbandForce(SampledEffect):
    """Random force that grows with the speed, at the disc or at `position`."""

    port = "random_force"
    kernel = broadband_force
    between = force_between
    cites = ("crandall_1963", "thesis")
    states = 6
    memory = "short"
    role = "scatter"
    random_part = "density"
    density: float = param("N^2/Hz", bounds=(0.0, 1e4), doc="One-sided density of the force at the reference speed.")
    speed: float = param("rad/s", default=100 * TURN, bounds=(TURN, 1e4 * TURN), doc="Reference speed.")
    exponent: float = param("1", default=2.0, bounds=(0.0, 10.0), doc="Power of the speed by which it grows.")
    corner: float = param("rad/s", default=500 * TURN, bounds=(TURN, 1e5 * TURN), doc="Corner of the low-pass.")
    sequence: float = param(
        "1", default=1.0, bounds=(0.0, 1e6), whole=True, doc="Number of the random sequence, another for each table."
    )
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )

    def problems(self, machine: Any) -> dict[str, str]:
        """The corner is below half the sampling rate, and no other table has the same sequence."""
        if self.density == 0.0:
            return {}
        highest = 0.5 / machine.sampling_time
        if self.corner > TURN * highest:
            given = f"{self.corner / TURN:g} Hz"
            return {"corner": f"{given} is above half the sampling rate; write at most '{highest:g} Hz'"}
        tables = machine.effects.get(self.name, ())
        above = tables[: next((i for i, one in enumerate(tables) if one is self), 0)]
        if any(one.density > 0.0 and one.sequence == self.sequence for one in above):
            return {"sequence": f"{self.sequence:g} is that of a table above, whose force is the same; write another"}
        return {}

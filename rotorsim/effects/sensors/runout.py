r"""Runout: sensor reading from a disc surface that is not round or not electrically uniform.

.. math:: s_x = x + r(-\varphi), \quad s_y = y + r(\tfrac{\pi}{2} - \varphi), \qquad
          r(\alpha) = \sum_{n=1}^{3} a_n \cos(n\alpha + \psi_n)
          + b \sum_{n=4}^{24} \frac{\cos(n\alpha + \psi_n)}{(21/2)^{1/2}}

Both sensors look at one surface, a quarter turn apart; the angle of their ring (sensor_ring.py) adds to alpha.

The roughness b (rms) has phases psi_n = pi g n^2 (Schroeder's, which spread it over the turn) with g of its number
`surface`, so that it is the same in every run.

With a `drift` d the whole surface grows as 1 + d t from the start of each run, as rust or magnetism does, which a table
of runout taken before does not hold. The table's age does not enter: growth before the run is in the amplitudes.

The sensors see the true angle, so this comes before an encoder.

Source: thesis 2.6.2, Figs 2.12 and 2.13; API 670; Schroeder (1970).
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, SampledEffect, param, register

FIRST = 4
"""Lowest order of the rough surface."""
LAST = 24
"""Highest order of the rough surface."""
GOLDEN = 0.6180339887498949


@inlined
def roughness(a, surface):
    """Sum of cos(n a + pi g n^2) over the rough orders, by turning one pointer on and on."""
    g = 1.0 / (LAST - FIRST + 1) + GOLDEN * surface
    first = FIRST * a + math.pi * g * (FIRST * FIRST)
    step = a + math.pi * g * (2 * FIRST + 1)
    x, y = math.cos(first), math.sin(first)
    u, v = math.cos(step), math.sin(step)
    p, q = math.cos(2.0 * math.pi * g), math.sin(2.0 * math.pi * g)
    total = x
    for _ in range(LAST - FIRST):
        x, y = x * u - y * v, x * v + y * u
        u, v = u * p - v * q, u * q + v * p
        total += x
    return total


@inlined
def runout(w, reading, state, seed, sample, p):
    """Add the surface under each sensor to the displacements read."""
    for axis in range(2):
        a = axis * (0.5 * math.pi) + w[reading + 5] - w[reading + 2]
        r = p.amplitude_1x * math.cos(a + p.phase_1x)
        r += p.amplitude_2x * math.cos(2.0 * a + p.phase_2x) + p.amplitude_3x * math.cos(3.0 * a + p.phase_3x)
        if p.roughness > 0.0:
            r += p.roughness * roughness(a, p.surface) / math.sqrt(0.5 * (LAST - FIRST + 1))
        if p.drift != 0.0:
            r *= 1.0 + p.drift * p.interval * sample
        w[reading + axis] += r


@register
class SurfaceRunout(SampledEffect):
    """Mechanical and electrical runout of the disc's surface."""

    port = "sensor"
    kernel = runout
    cites = ("api_670", "schroeder_1970", "thesis")
    forms = (
        CandidateForm(
            "amplitude_1x", 2e-7, "phase_1x",
            signature="vector that turns with the shaft", resembles="an eccentric surface under the sensors",
        ),
        CandidateForm("amplitude_2x", 2e-7, "phase_2x", axes_only=True),
        CandidateForm("amplitude_3x", 2e-7, "phase_3x", axes_only=True),
        CandidateForm("roughness", 1e-7, signed=False, axes_only=True),
    )  # fmt: skip
    amplitude_1x: float = param("m", bounds=(0.0, 1e-3), doc="Amplitude at 1X, 0-pk.")
    phase_1x: float = param("rad", bounds=(-TURN, TURN), doc="Phase at 1X.")
    amplitude_2x: float = param("m", bounds=(0.0, 1e-3), doc="Amplitude at 2X, 0-pk.")
    phase_2x: float = param("rad", bounds=(-TURN, TURN), doc="Phase at 2X.")
    amplitude_3x: float = param("m", bounds=(0.0, 1e-3), doc="Amplitude at 3X, 0-pk.")
    phase_3x: float = param("rad", bounds=(-TURN, TURN), doc="Phase at 3X.")
    roughness: float = param("m", bounds=(0.0, 1e-4), doc="Rms of orders 4 to 24.")
    surface: float = param("1", default=1.0, bounds=(0.0, 1e6), whole=True, doc="Number of the rough surface.")

    drift: float = param("1/s", bounds=(-1.0, 1.0), doc="Relative growth of the whole surface with time.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The surface turns with the true angle."""
        found = {}
        order = list(machine.effects)
        ahead = "encoder" in order[: order.index(self.name)] and machine.effects["encoder"][0].counts > 0.0
        if ahead and max(self.amplitude_1x, self.amplitude_2x, self.amplitude_3x, self.roughness) > 0.0:
            found[""] = "turns with the true angle, but [effects.encoder] before it has rounded that; move it ahead"
        return found

r"""Residual bow of the shaft: a half sine wave between the bearings, which rotates with the shaft.

.. math:: M\ddot q + C\dot q + K_b q + K_s\,(q - u\,e^{i\varphi}) = f, \qquad u(z) = a \sin\frac{\pi(z-z_1)}{z_2-z_1}

K_s is the shaft's own stiffness, K_b its bearings'; the bow acts as the force K_s u, whose amplitude does not depend
on the speed: far below the first critical speed the shaft turns in its bent shape, indistinguishable from a runout.

The torque of the bow on the turning shaft, of second order, is left out.

Source: Nicholas, Gunter & Allaire (1976), Effect of residual shaft bow on unbalance response, Part I.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, Effect, param, register


@inlined
def shaft_bow(t, angle, speed, acceleration, p):
    """Deflection (x, y) [m] of the unloaded shaft half-way between its bearings."""
    return p.bow * math.cos(angle + p.phase), p.bow * math.sin(angle + p.phase)


@register
class ShaftBow(Effect):
    """Permanent bow of the shaft."""

    port = "force"
    kernel = shaft_bow
    cites = ("nicholas_1976",)
    influence = "bow"
    single = True
    forms = (CandidateForm("bow", 2e-7, "phase", signature="vector that turns with the shaft"),)
    bow: float = param("m", bounds=(0.0, 1e-3), doc="Deflection half-way between the outermost bearings, 0-pk.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Angular position on the shaft, from x towards y.")

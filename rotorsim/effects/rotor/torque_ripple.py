r"""Torque ripple of the drive: the speed oscillates about its set value.

.. math:: J\,\delta\dot\Omega = M \cos(n\varphi + \psi) - J\,\delta\Omega/T

with the moment of inertia J of the rotor and the time T in which the drive takes deviations back ([drive]): in the
mean the speed swings by M / (J n Omega).

Evaluated once a sample, so n Omega must stay well below half the rate.

Source: Holmes (1986) and any text on drives; turbines ripple at their blade number.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, Effect, param, register


@inlined
def torque_ripple(t, angle, speed, p):
    """Torque [N m] on the shaft."""
    return p.amplitude * math.cos(p.order * angle + p.phase)


@register
class TorqueRipple(Effect):
    """Ripple of the drive's torque at a whole order."""

    port = "torque"
    kernel = torque_ripple
    cites = ("holmes_1986",)
    forms = (CandidateForm("amplitude", 0.05, "phase", options=(("order", (1.0, 2.0)),)),)
    amplitude: float = param("N*m", bounds=(0.0, 1e3), doc="Amplitude of the torque, 0-pk.")
    order: float = param("1", default=1.0, bounds=(1.0, 60.0), whole=True, doc="Times a turn, a whole number.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Phase on the shaft angle.")

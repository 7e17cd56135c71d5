r"""Vibration of the foundation: every mass feels -a(t) in the frame of the housing, where displacement is measured.

.. math:: M\ddot q + \dots = f - M\,a\,\sin(2\pi f t + \psi)

Source: Newton's law in an accelerated frame; ISO 10816 for sizes.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, Effect, param, register


@inlined
def base_vibration(t, angle, speed, acceleration, p):
    """Acceleration (ax, ay) [m/s^2] that the whole rotor feels."""
    wave = math.sin(p.frequency * t + p.phase)
    return -p.x * wave, -p.y * wave


@inlined
def foundation_motion(t, p):
    """Displacement [m], velocity [m/s] and acceleration [m/s^2] of the foundation, without mean."""
    wave, rate = math.sin(p.frequency * t + p.phase), math.cos(p.frequency * t + p.phase)
    period = 1.0 / p.frequency if p.frequency > 0.0 else 0.0
    shift, pace = -wave * period * period, -rate * period
    return p.x * shift, p.y * shift, p.x * pace, p.y * pace, p.x * wave, p.y * wave


@register
class BaseVibration(Effect):
    """Harmonic vibration of the foundation; several tables for several frequencies."""

    port = "force"
    kernel = base_vibration
    foundation = foundation_motion
    cites = ("iso_10816",)
    influence = "mass"
    forms = (
        CandidateForm("x", 0.05, "phase", options=(("frequency", (TURN * 50, TURN * 60, TURN * 100)),)),
        CandidateForm("y", 0.05, "phase", options=(("frequency", (TURN * 50, TURN * 60, TURN * 100)),)),
    )
    x: float = param("m/s^2", bounds=(-100.0, 100.0), doc="Horizontal acceleration, 0-pk.")
    y: float = param("m/s^2", bounds=(-100.0, 100.0), doc="Vertical acceleration, 0-pk.")
    frequency: float = param("rad/s", default=50 * TURN, bounds=(0.0, 2500 * TURN), doc="Frequency, e.g. '50 Hz'.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Phase at the start.")

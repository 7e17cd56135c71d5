r"""Shaft with two lateral stiffnesses, which turn with it: a keyway, flats, a two-pole rotor.

.. math:: F = -\frac{\Delta k}{2} \begin{bmatrix} \cos 2\alpha & \sin 2\alpha \\ \sin 2\alpha & -\cos 2\alpha
          \end{bmatrix} \begin{bmatrix} x \\ y \end{bmatrix}, \qquad \alpha = \varphi + \psi

at one plane, whose stiffness is k + Delta k / 2 along the axis at alpha and k - Delta k / 2 across. With z = x + i y
the force is -(Delta k / 2) exp(2 i alpha) conj(z).

A static sag s makes the vibration z_2 at twice the speed,

.. math:: z_2 = -\frac{\Delta k}{2}\,\frac{\bar s\,e^{2 i \psi}}{k - 4 m \Omega^2 + 2 i c \Omega}

with a resonance at half the critical speed; an undamped rotor is unstable where k - Delta k / 2 < m Omega^2 < k +
Delta k / 2.

The deflected shaft is braked by the torque -dV/d phi of its energy V, y F_x - x F_y, which supplies what the
vibration takes up.

Source: Genta (2005), Dynamics of Rotating Systems, chapter 6; Friswell et al. (2010), chapter 7. Assumes: the
difference acts at one plane; that of a whole shaft is the same for its first mode.
"""

import math
from typing import ClassVar

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, Effect, param, register


@inlined
def asymmetric_shaft(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] of the turning part of the stiffness."""
    at = 2.0 * (angle + p.phase)
    c = 0.5 * p.difference * math.cos(at)
    s = 0.5 * p.difference * math.sin(at)
    return -c * x - s * y, -s * x + c * y


@inlined
def asymmetric_shaft_torque(t, angle, speed, x, y, vx, vy, p):
    """Torque [N m] on the turning shaft, against the moment of the force about the axis of rotation."""
    fx, fy = asymmetric_shaft(t, angle, speed, x, y, vx, vy, p)
    return y * fx - x * fy


@register
class AsymmetricShaft(Effect):
    """Shaft of two lateral stiffnesses, at the disc or at `position`."""

    port = "motion"
    kernel = asymmetric_shaft
    braking = asymmetric_shaft_torque
    cites = ("friswell_2010", "genta_2005")
    forms = (CandidateForm("difference", 1e4, "phase", with_weight="forward 2X", from_value=("difference", 0.0)),)
    difference_lobes: ClassVar[float] = 2.0
    difference: float = param("N/m", bounds=(0.0, 1e9), doc="Stiffer less softer direction, at its plane.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Stiffer direction on the shaft, from x towards y.")
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )

r"""Breathing transverse crack: the shaft is softer across the crack, which the weight opens and closes as it turns.

.. math:: F = \Delta k\,b(\varphi)\,(x \cdot n)\,n, \qquad b = \tfrac12\,(1 + \cos(\varphi + \alpha - \psi))

n, from the axis to the crack, turns with the shaft at the angle phi + alpha.

b is 1, the crack open, where n points along psi, the side that the weight stretches: the lower side between two
bearings, the upper one of an overhung shaft. Opposite it is closed, b = 0.

A loss Delta k at the crack's plane is taken out of the shaft's stiffness there.

A static sag s along psi makes a force Delta k s {1/4, 3/8, 1/4, 1/8} along psi and {0, 1/8, 1/4, 1/8} across at 0X,
1X, 2X, 3X; 2X resonates at half the critical speed.

The shaft is braked by the torque -dV/d phi of the energy V = -(Delta k / 2) b (x . n)^2. Breathing by the weight
supposes vibration small against the sag.

Source: Mayes & Davies (1984), J. Vib. Acoust. 106, 139; Gasch (1993), J. Sound Vib. 160, 313.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, Effect, param, register


@inlined
def crack(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] that the missing stiffness leaves on the shaft."""
    at = angle + p.phase
    nx = math.cos(at)
    ny = math.sin(at)
    open_share = 0.5 * (1.0 + math.cos(at - p.weight_direction))
    missing = p.loss * open_share * (x * nx + y * ny)
    return missing * nx, missing * ny


@inlined
def crack_torque(t, angle, speed, x, y, vx, vy, p):
    """Torque [N m] on the turning shaft: what opens and what turns the softer direction."""
    at = angle + p.phase
    nx = math.cos(at)
    ny = math.sin(at)
    along = x * nx + y * ny
    across = y * nx - x * ny
    open_share = 0.5 * (1.0 + math.cos(at - p.weight_direction))
    opening = -0.5 * math.sin(at - p.weight_direction)
    return p.loss * along * (0.5 * opening * along + open_share * across)


@register
class Crack(Effect):
    """Breathing crack, at the disc or at `position`."""

    port = "motion"
    kernel = crack
    braking = crack_torque
    cites = ("gasch_1993", "mayes_1984")
    forms = (
        CandidateForm(
            "loss", 1e4, options=(("phase", tuple(k * math.pi / 4 for k in range(8))),), refine=(("phase", 0.1),),
            signed=False, with_weight="forward 2X",  # its 1X and 3X tell it from the others
        ),
    )  # fmt: skip
    loss: float = param("N/m", bounds=(0.0, 1e9), doc="Stiffness lost across the open crack.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Angular position on the shaft, from x towards y.")
    weight_direction: float = param(
        "rad", default=-math.pi / 2, bounds=(-TURN, TURN), doc="Where the weight stretches the shaft; -90 deg is below."
    )
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )

    def problems(self, machine: Any) -> dict[str, str]:
        """There is a weight to open and close it."""
        weight = any(e.acceleration > 0.0 for e in machine.effects.get("gravity", ()))
        if self.loss == 0.0 or weight:
            return {}
        return {"": "the weight opens and closes a crack, but there is none; add [effects.gravity] or set loss to 0"}

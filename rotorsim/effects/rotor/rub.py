r"""Rub of the shaft against the stator, with friction, away from the gas bearing.

.. math:: N = k\,(e - g)_+\,(1 + d\,\dot e)_+, \qquad T = \mu N \tanh(v_t/v_0)

e is the distance from the stator's axis, which may lie off the rotor's; N inwards, T against the sliding surface, whose
speed is Omega R + v_t; R T brakes the shaft. Source: Hunt & Crossley (1975) for the factor of the approach; Muszynska
(2005), chapter 5.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def rub(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] of the stator on the shaft."""
    dx = x - p.offset_x
    dy = y - p.offset_y
    e = math.sqrt(dx * dx + dy * dy)
    if e <= p.gap or p.stiffness == 0.0:
        return 0.0, 0.0
    nx = dx / e
    ny = dy / e
    normal = p.stiffness * (e - p.gap) * max(1.0 + p.damping * (vx * nx + vy * ny), 0.0)
    slide = speed * p.radius + vy * nx - vx * ny
    along = p.friction * normal * math.tanh(slide / p.slip_speed)
    return -normal * nx + along * ny, -normal * ny - along * nx


@inlined
def rub_torque(t, angle, speed, x, y, vx, vy, p):
    """Torque [N m] of the force about the shaft's axis, at whose radius towards the stator it acts."""
    fx, fy = rub(t, angle, speed, x, y, vx, vy, p)
    dx = x - p.offset_x
    dy = y - p.offset_y
    e = math.sqrt(dx * dx + dy * dy)
    return p.radius * (dx * fy - dy * fx) / e if e > 0.0 else 0.0


@register
class Rub(Effect):
    """Rub against a stator, at the disc or at `position`."""

    port = "motion"
    kernel = rub
    braking = rub_torque
    cites = ("hunt_1975", "muszynska_2005")
    steady = True
    forms = (
        CandidateForm(
            "stiffness", 2e4, options=(("gap", (0.0, 5e-6, 1e-5)), ("friction", (0.15,))),
            refine=(("gap", 2e-7), ("friction", 0.02)), signed=False,
        ),
    )  # fmt: skip
    stiffness: float = param("N/m", bounds=(0.0, 1e9), doc="Stiffness of the stator; 0 switches it off.")
    gap: float = param("m", default=5e-5, bounds=(0.0, 1e-2), doc="Radial gap.")
    offset_x: float = param("m", bounds=(-1e-2, 1e-2), doc="Where the stator's axis lies, x.")
    offset_y: float = param("m", bounds=(-1e-2, 1e-2), doc="Where the stator's axis lies, y.")
    friction: float = param("1", default=0.15, bounds=(0.0, 1.0), doc="Coulomb friction coefficient.")
    damping: float = param("s/m", default=1.0, bounds=(0.0, 1e4), doc="Hunt-Crossley damping factor.")
    radius: float = param("m", default=0.0118, bounds=(0.0, 10.0), doc="Radius of the rubbing surface.")
    slip_speed: float = param(
        "m/s", default=1e-3, bounds=(1e-6, 10.0), doc="Speed at which friction is 76 % developed."
    )
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )

    def problems(self, machine: Any) -> dict[str, str]:
        """A rub in the gas film is the effect `contact`."""
        film = machine.film
        if film is None or self.position is None or abs(self.position - film.position) > film.length / 2:
            return {}
        return {"position": "is inside the gas film, where [effects.contact] describes the rub; move it or use that"}

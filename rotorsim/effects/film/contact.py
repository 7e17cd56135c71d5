r"""Contact of the journal with the sleeve, with Coulomb friction.

.. math:: N = k\,\delta\,(1 + d\,\dot\delta)_+, \qquad T = \mu N \tanh(v_t / v_0), \qquad \delta = e - (c - g)

delta is the penetration: e the radial displacement, c the clearance, g the gap at which the asperities meet. N acts
inwards, T against the sliding speed v_t of the surface. The factor of the approach leaves no sticking and no jump of
the force at first touch; tanh regularises Coulomb's law at v_0. Source: Hunt & Crossley (1975) for the factor.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.base.constants import TO_UM
from rotorsim.effects.base import FilmEffect, param, register


@inlined
def contact(clearance, x, y, vx, vy, surface_speed, p):
    """Force on the journal and its negative derivative after the displacement."""
    e = math.sqrt(x * x + y * y)
    depth = e - (clearance - p.asperity)
    if p.stiffness == 0.0 or depth <= 0.0 or e == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    nx = x / e
    ny = y / e
    hardening = max(1.0 + p.damping * (vx * nx + vy * ny), 0.0)
    normal = p.stiffness * depth * hardening
    slip = surface_speed + vy * nx - vx * ny
    ratio = p.friction * math.tanh(slip / p.slip_speed)
    bx = -nx + ratio * ny
    by = -ny - ratio * nx
    stiff = p.stiffness * hardening
    hoop = normal / e
    tx = -ny
    ty = nx
    # d(force) = b dN + N db;  dN = stiff n.dx,  db = (rotation of b) t.dx / e
    rx = -by
    ry = bx
    kxx = -(bx * stiff * nx + hoop * rx * tx)
    kxy = -(bx * stiff * ny + hoop * rx * ty)
    kyx = -(by * stiff * nx + hoop * ry * tx)
    kyy = -(by * stiff * ny + hoop * ry * ty)
    return normal * bx, normal * by, kxx, kxy, kyx, kyy


@register
class Contact(FilmEffect):
    """Rub of the journal in the gas bearing."""

    port = "contact"
    kernel = contact
    cites = ("hunt_1975",)
    role = "known"
    stiffness: float = param("N/m", bounds=(0.0, 1e10), doc="Stiffness of the contact; 0 switches it off.")
    damping: float = param("s/m", bounds=(0.0, 1e4), doc="Hunt-Crossley damping factor.")
    friction: float = param("1", bounds=(0.0, 1.0), doc="Coulomb friction coefficient.")
    slip_speed: float = param(
        "m/s", default=1e-3, bounds=(1e-6, 10.0), doc="Speed at which friction is 76 % developed."
    )
    asperity: float = param("m", default=2.5e-7, bounds=(0.0, 1e-4), doc="Film thickness at which surfaces touch.")

    def problems(self, machine: Any) -> dict[str, str]:
        """Surfaces do not touch at rest in the middle."""
        clearance = machine.film_of(self).clearance
        if self.asperity < clearance:
            return {}
        asperity, limit = self.asperity * TO_UM, clearance * TO_UM
        return {"asperity": f"'{asperity:g} um' is not below the clearance '{limit:g} um'; make it smaller"}

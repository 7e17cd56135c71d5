r"""Contact of the journal with the sleeve, with Coulomb friction.

.. math:: N = k\,\delta\,(1 + d\,\dot\delta)_+, \qquad T = \mu N \tanh(v_t / v_0), \qquad \delta = g - h

delta is the penetration at each angle where the gap h between the surfaces (`reynolds.film.closest_places`) has a
minimum, g the gap at which the asperities meet; in a plain sleeve h = c - e.

N acts inwards along the normal there, T against the sliding speed v_t of the surface, and R T brakes the shaft. The
factor of the approach leaves no sticking and no jump of the force at first touch; tanh regularises Coulomb's law at
v_0.

A displacement dx turns the place by dx . t / h'', t along the surface.

Source: Hunt & Crossley (1975) for the factor.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.base.units import TO_UM
from rotorsim.effects.base import FilmEffect, param, register


@inlined
def contact(clearance, reach, nx, ny, curvature, vx, vy, surface_speed, p):
    """Force on the journal at a place and its negative derivative after the displacement."""
    depth = reach - (clearance - p.asperity)
    if p.stiffness == 0.0 or depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    hardening = max(1.0 + p.damping * (vx * nx + vy * ny), 0.0)
    normal = p.stiffness * depth * hardening
    slip = surface_speed + vy * nx - vx * ny
    ratio = p.friction * math.tanh(slip / p.slip_speed)
    bx = -nx + ratio * ny
    by = -ny - ratio * nx
    stiff = p.stiffness * hardening
    hoop = normal / curvature
    tx = -ny
    ty = nx
    # d(force) = b dN + N db;  dN = stiff n.dx,  db = (rotation of b) t.dx / curvature
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

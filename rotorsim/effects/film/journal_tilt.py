r"""Tilt of the sleeve against the journal: the gap varies along the film.

.. math:: h = c - X\cos\theta - Y\sin\theta - z\,(a\cos\theta + b\sin\theta)

z from the film's middle, a = dX/dz and b = dY/dz of the journal against the sleeve. The whole film is solved then,
not half of it.

The rotor feels the change of the film's force, not the film's moment, which is small against the shaft's.

Source: San Andres (2012), Modern Lubrication Theory, notes 4.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import FilmEffect, param, register
from rotorsim.effects.film import closed_gap


@inlined
def journal_tilt(t, angle, speed, theta, p):
    """Change of the gap [m] and its slope along z [1]."""
    return 0.0, -(p.x * math.cos(theta) + p.y * math.sin(theta))


@register
class JournalTilt(FilmEffect):
    """Tilt of the journal in its sleeve."""

    port = "film"
    kernel = journal_tilt
    cites = ("san_andres_2012",)
    single = True
    role = "asymmetric"
    x: float = param("rad", bounds=(-2e-3, 2e-3), doc="Tilt towards x, dX/dz.")
    y: float = param("rad", bounds=(-2e-3, 2e-3), doc="Tilt towards y, dY/dz.")

    @property
    def symmetric(self) -> bool:
        """Whether there is no tilt."""
        return self.x == 0.0 and self.y == 0.0

    def problems(self, machine: Any) -> dict[str, str]:
        """The gap stays open at the film's edges."""
        return closed_gap(self, machine)

    def narrowing(self, machine: Any) -> float:
        """Reduction of the gap at an edge [m]."""
        return math.hypot(self.x, self.y) * float(machine.film_of(self).length) / 2

r"""Clearance change with speed (centrifugal growth) and temperature.

.. math:: \Delta c = a\,T - g\,(\Omega/\Omega_0)^2, \qquad \Omega_0 = 2\pi\,100\ \mathrm{rad/s}

A positive T is a housing warmer than the shaft, which widens the gap by a = alpha R; centrifugal growth g of the
journal at 100 Hz narrows it.

A solid cylinder has g = (1 - nu) rho Omega_0^2 R^3 / (4 E), 21 nm for a journal of steel of 40 mm; hollow journals,
sleeves and heat make more.

Source: Timoshenko & Goodier (1970), section 32.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CalibrationParameter, CandidateForm, FilmEffect, param, register
from rotorsim.effects.film import closed_gap

NOMINAL = 2 * math.pi * 100


@inlined
def clearance_growth(t, angle, speed, theta, p):
    """Change of the gap [m] and its slope along z [1]."""
    ratio = speed / NOMINAL
    return p.radial_expansion * p.temperature - p.growth * ratio * ratio, 0.0


@register
class ClearanceGrowth(FilmEffect):
    """Change of the clearance with speed and temperature."""

    port = "film"
    kernel = clearance_growth
    cites = ("timoshenko_1970",)
    single = True
    extra = ("radial_expansion",)
    forms = (CandidateForm("growth", 3e-7),)
    calibration = (CalibrationParameter("temperature", 1.0, 3.0, -15, 15),)
    growth: float = param("m", bounds=(-2e-5, 2e-5), doc="What the journal's radius grows by at 6000 rpm.")
    temperature: float = param("K", bounds=(-200.0, 200.0), doc="Housing above shaft.")
    expansion: float = param("1/K", default=1.15e-5, bounds=(0.0, 1e-4), doc="Thermal expansion of journal and sleeve.")

    def derived(self, machine: Any) -> dict[str, float]:
        """Expansion of the radius [m/K]."""
        return {"radial_expansion": self.expansion * machine.film_of(self).diameter / 2}

    def problems(self, machine: Any) -> dict[str, str]:
        """The gap stays open at 6000 rpm."""
        return closed_gap(self, machine)

    def narrowing(self, machine: Any) -> float:
        """Reduction of the gap at 6000 rpm [m]."""
        return self.growth - self.derived(machine)["radial_expansion"] * self.temperature

r"""Viscosity of a gas warmer than in the machine file.

.. math:: \frac{\mu}{\mu_0} = \tau^{3/2}\,\frac{T_0 + S}{\tau T_0 + S}, \qquad
          \tau = 1 + \frac{\Delta T + \Delta T_\Omega (\Omega/\Omega_0)^2}{T_0}, \quad
          \Omega_0 = 2\pi\,100\ \mathrm{rad/s}

with Sutherland's constant S of the gas, 110.4 K for air; Delta T_Omega is what the film's own friction adds at 100 Hz.
Density and injectors keep T_0: the film is thin and its walls hold the gas near their temperature. Source: Sutherland
(1893); White (2011), section 1.9.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, FilmEffect, param, register

NOMINAL = 2 * math.pi * 100


@inlined
def sutherland(warmer, s):
    """Factor on the viscosity of a gas warmer by a share `warmer`; s: Sutherland's constant, of its temperature."""
    tau = 1.0 + warmer
    return tau * math.sqrt(tau) * (1.0 + s) / (tau + s)


@inlined
def gas_heating(t, speed, p):
    """Factor on the viscosity and mean free path [m]."""
    ratio = speed / NOMINAL
    warmer = (p.rise + p.heating * ratio * ratio) / p.temperature
    return sutherland(warmer, p.sutherland), 0.0


@register
class GasHeating(FilmEffect):
    """Warmer gas: higher viscosity."""

    port = "gas"
    kernel = gas_heating
    cites = ("sutherland_1893", "white_2011")
    single = True
    extra = ("temperature", "sutherland")
    forms = (
        CandidateForm("rise", 20.0, signature="properties of the gas", resembles="the gas temperature"),
        CandidateForm("heating", 20.0, signed=False, signature="properties of the gas"),
    )
    rise: float = param("K", bounds=(-100.0, 300.0), doc="Gas above the temperature in [gas].")
    heating: float = param("K", bounds=(0.0, 100.0), doc="Rise by friction at 6000 rpm; grows with the square.")

    def derived(self, machine: Any) -> dict[str, float]:
        """Temperature [K] the viscosity in [gas] belongs to, and Sutherland's constant over it."""
        return {"temperature": machine.gas.temperature, "sutherland": machine.gas.S / machine.gas.temperature}

r"""Temperatures of gas, journal and sleeve of a film, lumped, with the clearance and the viscosity that follow.

.. math::
    P = \dot m c_p T_g + W (T_g - T_j) + W (T_g - T_s), \qquad W = 6\,\frac{k}{c}\,2 \pi R L, \\
    C_j \dot T_j = W (T_g - T_j) - G_j T_j, \qquad C_s \dot T_s = W (T_g - T_s) - G_s T_s, \\
    \Delta c = R\,(\alpha_s T_s - \alpha_j T_j)

T are rises [K] above the temperature in [gas], at which the gas enters and the surroundings are; P is the power of
the film's friction, torque times speed; the flow is what the injectors feed.

The gas stores no heat; 6 k / c carries it to a wall where heat is made evenly across a thin gap. Each sample is one
step of the implicit Euler method; at an equilibrium the temperatures rest too.

Density and injectors keep the temperature in [gas].

Source: Incropera et al. (2007), sections 2.3 and 5.1; viscosity as in `gas_heating`.
"""

from __future__ import annotations

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import FilmEffect, param, register
from rotorsim.effects.film.gas_heating import sutherland

STEEL = 1.15e-5
"""Thermal expansion of steel [1/K]."""


@inlined
def heat_balance(w, state, rate, power, flow, p):
    """Rises [K] of gas, journal, sleeve in w[state:] after a sample of 1/rate [s]; rate 0: where they rest."""
    share = p.wall / (2.0 * p.wall + flow * p.gas_capacity)
    heat = p.friction_share * power
    lost = p.wall * (1.0 - share)
    shared = p.wall * share
    journal = p.journal_capacity * rate
    sleeve = p.sleeve_capacity * rate
    a = journal + p.journal_conductance + lost
    b = sleeve + p.sleeve_conductance + lost
    f = journal * w[state + 1] + share * heat
    g = sleeve * w[state + 2] + share * heat
    determinant = a * b - shared * shared
    w[state + 1] = (b * f + shared * g) / determinant
    w[state + 2] = (a * g + shared * f) / determinant
    w[state] = share * (heat / p.wall + w[state + 1] + w[state + 2])


@inlined
def warmed(w, state, p):
    """Increase of the gap [m] and factor on the viscosity."""
    grown = p.radius * (p.sleeve_expansion * w[state + 2] - p.journal_expansion * w[state + 1])
    return grown, sutherland(w[state] / p.temperature, p.sutherland)


@register
class HeatBalance(FilmEffect):
    """Heat of the film's friction: temperatures of gas, journal and sleeve, clearance and viscosity with them."""

    port = "heat"
    kernel = heat_balance
    warmed = warmed
    cites = ("incropera_2007", "sutherland_1893")
    role = "known"
    single = True
    extra = ("wall", "gas_capacity", "radius", "temperature", "sutherland")
    friction_share: float = param(
        "1", bounds=(0.0, 1.0), doc="Share of the friction power that heats; 0: none, 1: all."
    )
    conductivity: float = param("W/(m*K)", default=0.026, bounds=(1e-3, 1.0), doc="Thermal conductivity of the gas.")
    journal_conductance: float = param("W/K", default=0.5, bounds=(1e-4, 1e4), doc="Journal to surroundings.")
    sleeve_conductance: float = param("W/K", default=2.0, bounds=(1e-4, 1e4), doc="Sleeve to surroundings.")
    journal_capacity: float = param("J/K", default=100.0, bounds=(0.0, 1e6), doc="Heat capacity of the journal.")
    sleeve_capacity: float = param("J/K", default=300.0, bounds=(0.0, 1e6), doc="Heat capacity of the sleeve.")
    journal_expansion: float = param("1/K", default=STEEL, bounds=(0.0, 1e-4), doc="Thermal expansion of the journal.")
    sleeve_expansion: float = param("1/K", default=STEEL, bounds=(0.0, 1e-4), doc="Thermal expansion of the sleeve.")

    def derived(self, machine: Any) -> dict[str, float]:
        """Conductance to a wall [W/K], heat capacity of the gas [J/(kg K)], radius [m], temperature [K], S / T_0."""
        film, gas = machine.film_of(self), machine.gas
        area = math.pi * film.diameter * film.length
        return {
            "wall": 6 * self.conductivity / film.clearance * area,
            "gas_capacity": gas.R * gas.kappa / (gas.kappa - 1),
            "radius": film.diameter / 2,
            "temperature": gas.temperature,
            "sutherland": gas.S / gas.temperature,
        }

    def problems(self, machine: Any) -> dict[str, str]:
        """A balance for all films only where they are alike."""
        sizes = {(film.diameter, film.length, film.clearance) for film in machine.films}
        if machine.film_number(self) is None and len(sizes) > 1:
            return {"bearing": "is missing, and the films differ in size; write one table with a bearing for each film"}
        return {}

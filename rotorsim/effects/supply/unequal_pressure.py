r"""Unequal injection pressure: one injector's line carries another pressure than the others.

.. math:: P_{s,k} \;\to\; P_{s,k}\,(1 + \delta)

on the absolute pressure. Source: the pin's flow is proportional to P_s (choked orifice) or to P_s^2 - P_k^2 (laminar),
so a choked seat is indistinguishable from a blocked one.
"""

from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, FilmEffect, param, register
from rotorsim.effects.supply.weak_injector import no_such_injector


@inlined
def unequal_pressure(t, k, opening, supply, p):
    """Opening [1] and supply pressure [Pa] of injector k."""
    if k + 1.0 != p.injector:
        return opening, supply
    return opening, supply * (1.0 + p.deviation)


@register
class UnequalPressure(FilmEffect):
    """Another supply pressure at one injector; several tables for several."""

    port = "injector"
    kernel = unequal_pressure
    cites = ("blackburn_1960",)
    forms = (CandidateForm("deviation", 0.04, signature="flow of one injector"),)
    injector: float = param("1", default=1.0, bounds=(1.0, 64.0), whole=True, doc="Number of the injector, from 1.")
    deviation: float = param("1", bounds=(-0.5, 0.5), doc="Relative deviation of its absolute supply pressure.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The injector exists."""
        return no_such_injector(self, self.injector, machine)

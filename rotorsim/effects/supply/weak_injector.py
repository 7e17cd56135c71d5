r"""Weak injector: its seat is partly blocked, or its pin sticks.

.. math:: \sigma_k \;\to\; (1 - b)\,\big[(1 - s)\,\sigma_k + s\,\sigma_\mathrm{stuck}\big]

sigma is the seat's opening, b the blocked share of its area; s = 1 is a pin that no longer moves, s between 0 and 1 one
that follows with less travel. Source: continuity through the seat's curtain, injector.py.
"""

from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, FilmEffect, param, register


@inlined
def weak_injector(t, k, opening, supply, p):
    """Opening [1] and supply pressure [Pa] of injector k."""
    if k + 1.0 != p.injector:
        return opening, supply
    return (1.0 - p.blocked) * (opening + p.stuck * (p.stuck_opening - opening)), supply


@register
class WeakInjector(FilmEffect):
    """A partly blocked injector, or one whose pin has stuck; several tables for several."""

    port = "injector"
    kernel = weak_injector
    cites = ("blackburn_1960",)
    forms = (
        CandidateForm("blocked", 0.04, signed=False, signature="flow of one injector"),
        CandidateForm("stuck", 0.2, signed=False, pinned=True),
    )
    places = 2
    injector: float = param("1", default=1.0, bounds=(1.0, 64.0), whole=True, doc="Number of the injector, from 1.")
    blocked: float = param("1", bounds=(0.0, 0.99), doc="Blocked share of the seat's area.")
    stuck: float = param("1", bounds=(0.0, 1.0), doc="Share of the travel that is lost; 1 is a pin that has stuck.")
    stuck_opening: float = param("1", default=0.44, bounds=(0.0, 1.0), doc="Opening at which the pin sticks.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The injector exists."""
        return no_such_injector(self, self.injector, machine)


def no_such_injector(effect: FilmEffect, number: float, machine: Any) -> dict[str, str]:
    """A sentence for an injector number that the effect's film has not."""
    count = machine.injector_count(effect)
    if number == int(number) and 1 <= number <= count:
        return {}
    return {"injector": f"{number:g} is none of the machine's injectors; write 1 to {count}"}

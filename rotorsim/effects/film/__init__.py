"""Effects on the gas film, its gap and its sleeve; those on the gap together take at most 9/10 of the clearance."""

from __future__ import annotations

from typing import Any

from rotorsim.base.units import TO_UM
from rotorsim.effects.base import Effect

ROOM = 0.1
"""Share of the clearance that must be left."""


def closed_gap(effect: Effect, machine: Any) -> dict[str, str]:
    """A sentence if the effects on the gap close it; `effect` is blamed where it takes the most."""
    if machine.film is None:
        return {}
    about = {None, machine.film_number(effect)}
    there = [e for es in machine.effects.values() for e in es if about == {None} or machine.film_number(e) in about]
    shares = {id(e): e.narrowing(machine) for e in there if hasattr(e, "narrowing")}
    total, clearance = sum(shares.values()), machine.film_of(effect).clearance
    if clearance - total >= ROOM * clearance or shares[id(effect)] < max(shares.values()):
        return {}
    return {
        "": f"with the other effects on the gap takes {total * TO_UM:.3g} um of a clearance of "
        f"{clearance * TO_UM:.3g} um; make them smaller"
    }

"""Units of the parameters that an experiment has written into a record's attributes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from rotorsim.base.quantity import Quantity
from rotorsim.base.units import show, split
from rotorsim.experiments import EXPERIMENTS, ProportionalLaw
from rotorsim.experiments.parameters import parameters
from rotorsim.report.export.display_units import quantity

EXCITATION = re.compile(r"(excitation_\d+_)experiment")
"""Attribute with the name of an excitation in a closed loop; its parameters begin with the same words."""
HARMONIC = re.compile(r"harmonic_\d+_[xy](_phase)?")
"""Attributes of harmonics of the speed next to a law."""
MAGNITUDE = Quantity("V", "Magnitude of a harmonic of the speed next to the law.")
PHASE = Quantity("rad", "Its phase.")
CENTRE = Quantity("m", "Position that asks the built-in law for no reference.")


def quantities(attrs: Mapping[Any, Any]) -> dict[str, Quantity]:
    """Quantity of every attribute that is a parameter of the experiment, its excitations, harmonics or built-in law."""
    found = _of(EXPERIMENTS.get(str(attrs.get("experiment"))))
    if attrs.get("controller") == ProportionalLaw.__name__:
        found |= _of(ProportionalLaw) | dict.fromkeys(("centre_x", "centre_y"), CENTRE)
    for key in map(str, attrs):
        if named := EXCITATION.fullmatch(key):
            own = _of(EXPERIMENTS.get(str(attrs[key])))
            found |= {f"{named[1]}{name}": quantity for name, quantity in own.items()}
        elif harmonic := HARMONIC.fullmatch(key):
            found[key] = PHASE if harmonic[1] else MAGNITUDE
    return found


def with_unit(value: float, unit: str) -> str:
    """A number in SI as a text of six digits in a unit that people use."""
    text, shown = split(show(float(value), unit))
    return quantity(float(text), shown, ".6g").strip()


def _of(kind: Any) -> dict[str, Quantity]:
    if kind is None:
        return {}
    return {known.attribute or entry.name: known for entry, known in parameters(kind)}

"""Findings of a diagnosis that a new machine file takes up: effects with uncertainties, ties, new calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

from rotorsim.base.constants import TO_UM
from rotorsim.base.quantity import quantities
from rotorsim.effects import REGISTRY
from rotorsim.machine import Machine

CLOCK = "clock of "
"""Beginning of the calibration's keys of clock offsets [s], before the name of a record."""


@dataclass(frozen=True)
class IdentifiedEffect:
    """Identified effect: name, form, table of parameters for the machine file (SI), standard deviations."""

    effect: str
    form: str
    parameters: dict[str, float]
    sd: dict[str, float]
    tie_class: tuple[str, ...]

    def sizes(self) -> Iterator[tuple[str, str, str]]:
        """Parameter, value and standard deviation in display units; no standard deviation where it was held."""
        units = {name: known.unit for name, known in quantities(REGISTRY[self.effect]).items()}
        for name, value in self.parameters.items():
            sd = _with_unit(self.sd[name], units[name], 2) if name in self.sd else ""
            yield name, _with_unit(value, units[name], 4), sd


@dataclass(frozen=True, eq=False)
class Findings:
    """Effects found in a machine and its new calibration, with the evidence."""

    status: str
    machine: Machine
    effects: tuple[IdentifiedEffect, ...]
    ties: tuple[tuple[str, ...], ...]
    calibration: dict[str, tuple[float, float]]
    evidence: dict[str, float]
    data_hash: str

    def changes(self) -> Iterator[tuple[str, str, str]]:
        """Calibrated parameter, its change and standard deviation in display units; relative where there is no unit."""
        for key, (value, sd) in self.calibration.items():
            unit = _unit_of(key)
            yield key, _with_unit(value, unit, 4), _with_unit(sd, unit, 2)


def _unit_of(key: str) -> str:
    """SI unit of a calibrated parameter such as 'unbalance.1.me~phase.c', '1' for a relative change."""
    if key in ("offset_x", "offset_y"):
        return "m"
    if key.startswith(CLOCK):
        return "s"
    effect, _, parameter = key.partition(" ")[0].partition("~")[0].rpartition(".")
    known = quantities(REGISTRY[effect.partition(".")[0]]) if effect.partition(".")[0] in REGISTRY else {}
    return known[parameter].unit if parameter in known else "1"


def _with_unit(value: float, unit: str, digits: int) -> str:
    """A number of SI with its unit; lengths in micrometres, angles in degrees, unbalances in g mm."""
    known = {"m": (TO_UM, "um"), "rad": (180 / pi, "deg"), "kg*m": (1e6, "g mm"), "1": (1.0, "")}
    factor, shown = known.get(unit, (1.0, unit))
    return f"{value * factor:.{digits}g} {shown}".rstrip()

"""Definition of a sweep, checked before anything is computed, and its cells.

Each analysis of `rotorsim.analysis.cases` is computed over those axes alone that change it: a lift-off pressure does
not depend on the supply pressure.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields as parameters_of
from itertools import product
from typing import Any

from rotorsim.analysis.axes import Field
from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.cases import Analysis
from rotorsim.analysis.sweeps.axes import POINTS, Over, read_over
from rotorsim.analysis.sweeps.quantities import SweepQuantity, read_quantities
from rotorsim.analysis.varied import with_fields
from rotorsim.base.constants import TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.base.units import parse, show
from rotorsim.machine.plausibility import ask_machine
from rotorsim.machine.running_limits import ask_rim_speed
from rotorsim.machine.schema import Machine
from rotorsim.plant.plant import Plant, as_plant

WHAT = ("lift_off", "onset", "flow")
"""Quantities when none are named."""


@dataclass(frozen=True)
class Sweep:
    """Definition of a sweep: machine, axes, quantities, and the point where speed and pressure are not axes."""

    machine: Machine
    fields: tuple[Field, ...]
    quantities: tuple[SweepQuantity, ...]
    speed: float
    pressure: float
    highest: float

    @property
    def kinds(self) -> tuple[type[Analysis], ...]:
        """Analyses that give the quantities."""
        return tuple(dict.fromkeys(quantity.kind for quantity in self.quantities))

    def axes_of(self, kind: type[Analysis]) -> tuple[Field, ...]:
        """The axes that change an analysis."""
        known = {entry.name for entry in parameters_of(kind)}
        return tuple(field for field in self.fields if field.path not in POINTS or field.path in known)

    def fixed(self, kind: type[Analysis]) -> dict[str, float]:
        """Parameters [SI] of an analysis that are not axes."""
        values = {"speed": self.speed, "pressure": self.pressure, "highest_speed": self.highest}
        axes = {field.path for field in self.fields}
        return {e.name: values[e.name] for e in parameters_of(kind) if e.name in values and e.name not in axes}

    def cells(self) -> Iterator[tuple[type[Analysis], tuple[int, ...]]]:
        """Every analysis with the place of each of its cells, machine by machine."""
        for kind in self.kinds:
            for place in product(*(range(len(field.values)) for field in self.axes_of(kind))):
                yield kind, place

    def case(self, kind: type[Analysis], place: tuple[int, ...]) -> tuple[Analysis, list[tuple[str, Any]]]:
        """Analysis of a cell, and the machine's values there by path."""
        chosen = {f.path: f.values[k] for f, k in zip(self.axes_of(kind), place, strict=True)}
        point = {name: parse(chosen.pop(name), unit) for name, unit in POINTS.items() if name in chosen}
        return kind(**self.fixed(kind), **point), list(chosen.items())


def make_sweep(
    machine: Plant | Machine | str,
    over: Over,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
) -> Sweep:
    """A sweep, checked before anything is computed; see `sweep`."""
    plant = as_plant(machine)
    ask_machine(plant.machine)
    fields = read_over(over, plant.machine)
    quantities = read_quantities(what, plant.machine)
    top = highest_of(plant) if highest_speed is None else _si("highest_speed", highest_speed, "rad/s")
    found = Sweep(plant.machine, fields, quantities, _si("speed", speed, "rad/s"), _si("pressure", pressure, "Pa"), top)
    _check(found)
    return found


def highest_of(plant: Plant) -> float:
    """Highest speed [rad/s] of onset and peak, rounded to three digits, when none is given."""
    return parse(f"{highest_speed(plant) * TO_RPM:.3g} rpm", "rad/s")


def _si(name: str, value: float | str, unit: str) -> float:
    try:
        number = float(parse(value, unit)) if isinstance(value, str) else float(value)
    except ValueError as error:
        raise DataError(f"{name}: {error}") from error
    if not 0 <= number < float("inf") or (name == "highest_speed" and not number):
        raise DataError(f"{name}: '{show(number, unit)}' is out of range; give a number from 0 to what the shaft holds")
    return number


def _check(sweep: Sweep) -> None:
    """Refuse axes that change nothing; question unusual corners."""
    used = {field.path for kind in sweep.kinds for field in sweep.axes_of(kind)}
    for field in sweep.fields:
        if field.path not in used:
            names = ", ".join(quantity.name for quantity in sweep.quantities)
            raise DataError(f"--over: {field.path} does not change {names}; leave the axis out or add a quantity")
    own = [field for field in sweep.fields if field.path not in POINTS]
    for end in (0, -1):
        machine = with_fields(sweep.machine, own, [field.values[end] for field in own])
        ask_machine(machine)
    speeds = [parse(f.values[-1], "rad/s") for f in sweep.fields if f.path == "speed"]
    for speed in (sweep.speed, sweep.highest, *speeds):
        ask_rim_speed(sweep.machine, speed, "speed")

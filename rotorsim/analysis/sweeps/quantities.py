"""Quantities of a sweep: the analysis that gives each, its unit, and whether the highest or the lowest is best."""

from __future__ import annotations

from dataclasses import dataclass

from rotorsim.analysis.cases import ANALYSES, Analysis
from rotorsim.base.constants import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.base.errors import DataError
from rotorsim.base.sentences import did_you_mean
from rotorsim.machine.schema import Machine


@dataclass(frozen=True)
class SweepQuantity:
    """A quantity: SI unit, unit and factor for tables and charts, `best` 'highest' or 'lowest', meaning."""

    name: str
    unit: str
    shown: str
    factor: float
    best: str
    meaning: str

    @property
    def kind(self) -> type[Analysis]:
        """The analysis that gives it."""
        return next(kind for kind in ANALYSES.values() if self.name in kind.quantities)

    @property
    def heading(self) -> str:
        """Name and unit, as in a table's head."""
        return f"{self.name} [{self.shown}]"


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        SweepQuantity("lift_off", "Pa", "MPa", TO_MPA, "lowest", "lift-off pressure, gauge"),
        SweepQuantity("onset", "rad/s", "rpm", TO_RPM, "highest", "whirl onset"),
        SweepQuantity("load", "N", "N", 1.0, "highest", "load capacity at half the clearance"),
        SweepQuantity("flow", "kg/s", "mg/s", 1e6, "lowest", "gas flow of all injectors"),
        SweepQuantity("damping", "1", "1", 1.0, "highest", "least damping ratio"),
        SweepQuantity("frequency", "rad/s", "Hz", TO_HZ, "highest", "first natural frequency"),
        SweepQuantity("peak", "m", "um 0-pk", TO_UM, "lowest", "largest unbalance response"),
    )
}
"""Every quantity of a sweep by its name."""
NEEDS_FILM, NEEDS_SUPPLY = ("onset", "load"), ("lift_off", "flow")


def read_quantities(what: str | tuple[str, ...] | list[str], machine: Machine) -> tuple[SweepQuantity, ...]:
    """Quantities of their names, with commas between or in a sequence; raises DataError for an unknown one.

    A machine without a film, or without a supply, has not all of them.
    """
    names = what.split(",") if isinstance(what, str) else list(what)
    names = [name.strip() for name in names if name.strip()]
    if not names:
        raise DataError(f"--what: no quantity is named; choose from {', '.join(QUANTITIES)}")
    for name in names:
        if name not in QUANTITIES:
            raise DataError(f"--what: '{name}' is not a quantity; {did_you_mean(name, QUANTITIES)}")
        if name in NEEDS_FILM and machine.film is None:
            raise DataError(f"--what: {name} needs a gas film, and {machine.name} has none; leave it out")
        if name in NEEDS_SUPPLY and not machine.fed:
            raise DataError(f"--what: {name} needs injectors or orifices, and {machine.name} has none; leave it out")
    return tuple(QUANTITIES[name] for name in dict.fromkeys(names))

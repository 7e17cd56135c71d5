"""Common interface of exported units, and the unit of a plant with its table of variables.

`Unit` is the seam: whatever has these names, a `core` in C that serves unit.h and an entry in `fmu.kinds` can be
exported, a controller's law too.
"""

from __future__ import annotations

import hashlib
import re
import uuid
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Protocol

from fmu.variables import UnitVariable, plant_variables
from rotorsim.base.errors import DataError
from rotorsim.plant import Plant
from rotorsim.plant.assemble import Assembly

LONGEST_NAME = 60
"""Characters of an identifier that compilers and file systems take besides the suffix."""


class Unit(Protocol):
    """Interface of every kind of unit."""

    @property
    def core(self) -> str:
        """C file that holds what the unit does."""

    @property
    def unit_name(self) -> str:
        """Name of the unit: the chosen one, or that of its subject and of its kind."""

    @property
    def description(self) -> str:
        """One sentence."""

    @property
    def continuous(self) -> bool:
        """Whether it can be used for model exchange."""

    @property
    def sample(self) -> float:
        """Time [s] of which communication steps are multiples."""

    @property
    def variables(self) -> tuple[UnitVariable, ...]:
        """The table of variables."""

    @property
    def hash(self) -> str:
        """Hash that identifies this model."""

    @property
    def token(self) -> str:
        """Instantiation token of FMI 3.0, GUID of FMI 2.0."""


@dataclass(frozen=True)
class PlantUnit:
    """A plant to be exported, at rest at `speed` [rad/s] and gauge `pressure` [Pa] when it starts."""

    plant: Plant
    speed: float
    pressure: float
    chosen_name: str = ""
    core = "plant.c"
    continuous = False

    @property
    def unit_name(self) -> str:
        """Name of the unit."""
        return self.chosen_name or f"{self.plant.machine.name}_plant"

    @property
    def sample(self) -> float:
        """Sampling time [s] of the machine, of which communication steps are multiples."""
        return self.plant.machine.sampling_time

    @property
    def description(self) -> str:
        """One sentence."""
        return self.plant.machine.description or f"{self.plant.machine.name}: rotor on gas bearings."

    @property
    def assembly(self) -> Assembly:
        """The plant's layouts, workspace and parameters."""
        return self.plant.assembly

    @cached_property
    def variables(self) -> tuple[UnitVariable, ...]:
        """The table of variables."""
        return plant_variables(self.assembly, self.speed, self.pressure)

    @cached_property
    def hash(self) -> str:
        """Hash of machine, kernels and variables that identifies this model."""
        parts = [self.plant.machine.text, self.assembly.module.__name__, software(), repr(self.variables)]
        return hashlib.sha256("\0".join([*parts, wrapper_text()]).encode()).hexdigest()[:32]

    @property
    def token(self) -> str:
        """Instantiation token of FMI 3.0, GUID of FMI 2.0."""
        return f"{{{uuid.UUID(self.hash)}}}"

    @property
    def modules(self) -> list[str]:
        """Modules that register the machine's effects."""
        return sorted({type(e).__module__ for es in self.plant.machine.effects.values() for e in es})


def identifier(unit: Unit) -> str:
    """The C identifier that names a unit's libraries: its name, with an underscore for what an identifier has not."""
    found = re.sub(r"[^A-Za-z0-9_]+", "_", unit.unit_name).strip("_") or "unit"
    return (found if found[0].isalpha() else f"unit_{found}")[:LONGEST_NAME]


def check_name(name: str) -> str:
    """A name that is asked for; raises DataError for one that is no C identifier, which the standard wants."""
    if re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST_NAME - 1}}}", name):
        return name
    raise DataError(
        f"name: '{name[:80]}' is not a name of a unit; write at most {LONGEST_NAME} letters, digits and underscores, "
        "a letter first"
    )


def software() -> str:
    """Name and version of this software."""
    try:
        return f"rotorsim {version('rotorsim')}"
    except PackageNotFoundError:
        return "rotorsim source"


def wrapper_text() -> str:
    """All of the C wrapper."""
    folder = Path(__file__).parent / "c"
    return "".join(p.read_text(encoding="utf-8") for p in sorted(folder.iterdir()) if p.suffix in (".c", ".h"))

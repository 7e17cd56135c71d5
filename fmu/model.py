"""What goes into a unit: a plant with its table of variables and its hash.

A controller or an identified model would be another maker of `UnitModel`, with a `serve` of its own.
"""

from __future__ import annotations

import hashlib
import uuid
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from fmu.variables import Variable, plant_variables
from rotorsim.errors import DataError
from rotorsim.plant import Plant
from rotorsim.plant.assemble import Assembly

IDENTIFIER = "RotorGasBearing"
MODELS = ("plant",)


@dataclass(frozen=True)
class UnitModel:
    """A plant to be exported, at rest at `speed` [rad/s] and gauge `pressure` [Pa] when it starts."""

    plant: Plant
    speed: float
    pressure: float

    @property
    def assembly(self) -> Assembly:
        """The plant's layouts, workspace and parameters."""
        return self.plant.assembly

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The table of variables."""
        return plant_variables(self.assembly, self.speed, self.pressure)

    @cached_property
    def hash(self) -> str:
        """Tells this model from every other: machine, kernels, variables."""
        parts = [self.plant.machine.text, self.assembly.module.__name__, software(), repr(self.variables)]
        return hashlib.sha256("\0".join([*parts, _wrapper_text()]).encode()).hexdigest()[:32]

    @property
    def token(self) -> str:
        """Instantiation token of FMI 3.0, GUID of FMI 2.0."""
        return f"{{{uuid.UUID(self.hash)}}}"

    @property
    def modules(self) -> list[str]:
        """Modules that register the machine's effects."""
        return sorted({type(e).__module__ for es in self.plant.machine.effects.values() for e in es})


def make_model(kind: str, plant: Plant, speed: float, pressure: float) -> UnitModel:
    """A model of a kind by name."""
    if kind not in MODELS:
        raise DataError(f"--model: '{kind}' cannot be exported; choose {', '.join(MODELS)}")
    if not plant.assembly.film.n_inj:
        pressure = 0.0
    return UnitModel(plant, speed, pressure)


def software() -> str:
    """Name and version of this software."""
    try:
        return f"rotorsim {version('rotorsim')}"
    except PackageNotFoundError:
        return "rotorsim source"


def _wrapper_text() -> str:
    folder = Path(__file__).parent / "c"
    return "".join(p.read_text(encoding="utf-8") for p in sorted(folder.iterdir()) if p.suffix in (".c", ".h"))

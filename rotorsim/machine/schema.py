"""Machine: rotor, bearings, gas film with injectors, effects, grid and solver, all in SI units."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    Discriminator,
    Field,
    InstanceOf,
    PrivateAttr,
    Tag,
    ValidationError,
    field_validator,
)

from rotorsim.base.errors import MachineFileError
from rotorsim.base.files import write_text
from rotorsim.effects import Effect
from rotorsim.machine import edit, toml
from rotorsim.machine.actuators import Actuators, Drive
from rotorsim.machine.checks import cross_check
from rotorsim.machine.effect_tables import read_effects
from rotorsim.machine.film import Gas, GasFilm, Injection, Injector
from rotorsim.machine.numerics import Grid, Solver
from rotorsim.machine.part import Part
from rotorsim.machine.readable import every_problem
from rotorsim.machine.rotor import Disc, LinearBearing, Probe, Shaft


def _kind(bearing: Any) -> str | None:
    kind = bearing.get("kind") if isinstance(bearing, dict) else getattr(bearing, "kind", None)
    return kind if isinstance(kind, str) else None


Bearing = Annotated[Annotated[LinearBearing, Tag("linear")] | Annotated[GasFilm, Tag("gas_film")], Discriminator(_kind)]


class Machine(Part):
    """A rotor on its bearings, as a machine file describes it."""

    name: str = Field(description="Short name.")
    description: str = Field("", description="A sentence about the machine.")
    shaft: Shaft = Field(description="The elastic shaft.")
    discs: tuple[Disc, ...] = Field((), description="Rigid discs on the shaft.")
    bearings: tuple[Bearing, ...] = Field(min_length=1, description="Bearings; at most one of them a gas film.")
    gas: Gas = Field(Gas(), description="The gas in film and injectors.")
    injection: Injection | None = Field(None, description="What all injectors have in common.")
    injectors: tuple[Injector, ...] = Field((), description="The injectors of the gas film.")
    actuators: Actuators | None = Field(None, description="Piezo actuators of the pins; ideal when not given.")
    drive: Drive = Field(Drive(), description="What turns and brakes the shaft.")
    probe: Probe | None = Field(None, description="Where displacement is measured; the first disc when not given.")
    grid: Grid = Field(Grid(symmetry="auto"), description="Grid of the gas film.")
    solver: Solver = Field(Solver(), description="Step and tolerances.")
    effects: dict[str, tuple[InstanceOf[Effect], ...]] = Field({}, description="Physical effects by name.")
    unusual: tuple[str, ...] = Field((), description="Paths of values that are meant, however unusual.")

    _source: str = PrivateAttr("")

    @classmethod
    def from_text(cls, text: str) -> Machine:
        """Machine of a TOML text; raises MachineFileError with one line per problem."""
        tables = toml.parse(text)
        try:
            machine = cls.model_validate(tables)
        except ValidationError as error:
            raise MachineFileError("\n".join(every_problem(error, cls, tables))) from error
        machine._source = text
        return machine

    @property
    def text(self) -> str:
        """Canonical TOML with units: `Machine.from_text(m.text) == m`, to the last bit."""
        return toml.dumps(self)

    @property
    def hash(self) -> str:
        """Short hash of the content; comments and spelling do not matter."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:16]

    @property
    def film(self) -> GasFilm | None:
        """The gas film, if there is one."""
        return next((b for b in self.bearings if isinstance(b, GasFilm)), None)

    @property
    def mass(self) -> float:
        """Mass of shaft and discs [kg]."""
        return self.shaft.mass + sum(d.mass for d in self.discs)

    def replace(self, path: str, value: Any) -> Machine:
        """The machine with another value at a dotted path: ``replace("effects.unbalance.me", "12 g*mm")``.

        Items of a list go by index from 0 (``bearings.1.clearance``); an absent effect is added.

        Raises
        ------
        MachineFileError
            If the path leads nowhere or the machine would not be valid.
        """
        return type(self).from_text(edit.with_value(self._source or self.text, path, value))

    def save(self, path: str | Path) -> None:
        """Write the machine file, with the comments it was read with; the file is complete or untouched."""
        write_text(path, self._source or self.text)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Machine) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(self.hash)

    @field_validator("effects", mode="before")
    @classmethod
    def _effects(cls, tables: Any) -> Any:
        return read_effects(tables)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Checks between parts."""
        return cross_check(self)

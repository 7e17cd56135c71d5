"""Machine: the tables of a machine file, checked against each other, with its text.

Its content is also shown: as one line, as SI numbers, as rows of every field, with the sources that it stands on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from pydantic import PrivateAttr, ValidationError

from rotorsim.base import display
from rotorsim.base.display import Card
from rotorsim.base.errors import MachineFileError
from rotorsim.base.files import write_text
from rotorsim.base.quantity import Quantity
from rotorsim.base.units import TO_UM, advised, show
from rotorsim.effects import Effect
from rotorsim.machine.bearings import BearingCoefficients
from rotorsim.machine.checks import cross_check, every_problem
from rotorsim.machine.file_text import by_index, declarations, dumps, parse, with_value
from rotorsim.machine.part import Part
from rotorsim.machine.tables import MachineTables, branches, changed


class Machine(MachineTables):
    """A rotor on its bearings, as a machine file describes it, its parts checked against each other.

    Examples
    --------
    >>> import rotorsim as rs
    >>> machine = rs.load_machine("dtu_gas_bearing")
    >>> machine.replace("effects.unbalance.me", "12 g*mm").name
    'dtu_gas_bearing'
    """

    _source: str = PrivateAttr("")

    @classmethod
    def from_text(cls, text: str) -> Machine:
        """Machine of a TOML text; raises MachineFileError with one line per problem."""
        tables, unnamed = by_index(parse(text))
        try:
            machine = cls.model_validate(tables)
        except ValidationError as error:
            raise MachineFileError("\n".join([*unnamed, *every_problem(error, cls, tables)])) from error
        if unnamed:
            raise MachineFileError("\n".join(unnamed))
        machine._source = text
        return machine

    @property
    def text(self) -> str:
        """Canonical TOML with units: `Machine.from_text(m.text) == m`, to the last bit."""
        return dumps(self)

    @property
    def hash(self) -> str:
        """Short hash of the content; comments, spelling and the table `checked` (no run needs it) do not matter."""
        return hashlib.sha256(self.model_copy(update={"checked": None}).text.encode()).hexdigest()[:16]

    def replace(self, path: str, value: Any) -> Machine:
        """The machine with another value at a dotted path: ``replace("effects.unbalance.me", "12 g*mm")``.

        Items of a list go by index from 0 (``bearings.1.clearance``); an absent effect is added.

        Raises
        ------
        MachineFileError
            If the path leads nowhere or the machine would not be valid.
        """
        return type(self).from_text(with_value(self._source or self.text, path, value))

    def with_(self, values: Mapping[str, Any] | None = None, /, **named: Any) -> Machine:
        """The machine with other SI values at dotted paths: ``with_({"bearings.1.clearance": 25e-6})``, or by ``**``.

        A whole part or effect can be a value too, also one that is absent, and the dict of effects; None removes an
        optional part. Raises MachineFileError as `replace`, and for a path that lies below another.
        """
        machine: Machine = changed(self, branches({**(values or {}), **named}))
        return machine

    def save(self, path: str | Path) -> None:
        """Write the machine file, with the comments it was read with; the file is complete or untouched."""
        write_text(path, self._source or self.text)

    def card(self) -> Card:
        """Mass, bearings, film, effects and hash."""
        effects = [f"{len(parts)} x {name}" if len(parts) > 1 else name for name, parts in self.effects.items()]
        rows = [("hash", self.hash), ("mass", f"{self.mass:.3g} kg"), ("bearings", str(len(self.bearings)))]
        rows.append(("effects", ", ".join(effects) or "none"))
        for k, (film, name) in enumerate(zip(self.films, self.film_names, strict=True)):
            text = f"{film.length * 1e3:g} mm long, clearance {film.clearance * TO_UM:.4g} um"
            orifices = sum(int(row.count) for row in film.orifices)
            counts = ((len(self.injectors) * (k == self.pinned_film), "injectors"), (orifices, "orifices"))
            fed = "".join(f", {count} {what}" for count, what in counts if count) or ", no feeding"
            rows.insert(3 + k, ("gas film" if len(self.films) == 1 else f"gas film {name}", text + fed))
        for one, name in zip(self.thrust_bearings, self.thrust_names, strict=True):
            size = f"{one.inner_diameter * 1e3:g} to {one.outer_diameter * 1e3:g} mm"
            rows.insert(-1, (f"thrust film {name}", f"{size}, clearance {one.clearance * TO_UM:.4g} um"))
        return Card(f"Machine {self.name}", rows)

    def __repr__(self) -> str:
        return display.text(self.card())

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        card = self.card()
        return display.html(Card(card.title, [("", self.description), *card.rows]))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Machine) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(self.hash)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Checks between parts."""
        return cross_check(self)


def summary(machine: Machine) -> str:
    """Machine summary in half a line.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.summary(machine).split(":")[0]
    'dtu_gas_bearing'
    """
    film = machine.film
    parts = [f"{machine.name}: {machine.mass:.3g} kg on {len(machine.bearings)} bearings"]
    if film:
        several = len(machine.films) > 1
        films = f"{len(machine.films)} gas films" if several else "gas film"
        gaps = dict.fromkeys(show(one.clearance, "m") for one in machine.films)
        counts = ((len(machine.injectors), "injectors"), (machine.orifice_count, "orifices"))
        fed = ", ".join(f"{count} {name}" for count, name in counts if count) or "no feeding"
        every = f"{'each ' if several and len(gaps) == 1 else ''}with {' and '.join(gaps)} clearance"
        parts.append(f"{films}, {every}; in all {fed}" if several else f"{films} {every} and {fed}")
    if machine.thrust_bearings:
        gaps = dict.fromkeys(show(one.clearance, "m") for one in machine.thrust_bearings)
        parts.append(f"{len(machine.thrust_bearings)} thrust bearings with {' and '.join(gaps)} clearance")
    acting = [name for name, several in machine.effects.items() if not all(map(_does_nothing, several))]
    parts.append(f"effects: {', '.join(acting) or 'none'}")
    if idle := [name for name in machine.effects if name not in acting]:
        parts.append(f"at neutral values and so without effect: {', '.join(idle)}")
    return "; ".join(parts)


def _does_nothing(effect: Effect) -> bool:
    """Whether every parameter of an effect has its default, the neutral value."""
    return all(getattr(effect, field.name) == field.default for field in fields(effect))


def si_numbers(machine: Machine) -> dict[str, Any]:
    """Values of a machine as SI numbers, with mass [kg] and content hash.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.si_numbers(machine)["name"]
    'dtu_gas_bearing'
    """
    effects = {name: [asdict(effect) for effect in effects] for name, effects in machine.effects.items()}
    return {**machine.model_dump(exclude={"effects"}), "effects": effects, "mass": machine.mass, "hash": machine.hash}


def rows(part: Any, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Dotted path, value in engineering units and description of every field, also of those that are not set.

    Examples
    --------
    >>> import rotorsim as rs
    >>> next(rs.machine.rows(machine))[0]
    'name'
    """
    for here, value, spec, doc in leaves(part, path):
        if value is None:
            yield here, f"not set [{advised(spec.unit)[0]}]" if spec and spec.unit != "1" else "not set", doc
        else:
            yield here, show(value, spec.unit) if spec else str(value), doc


def leaves(part: Any, path: str = "") -> Iterator[tuple[str, Any, Quantity | None, str]]:
    """Dotted path, SI value (None where it is not set), declaration and description of every field of a part.

    Examples
    --------
    >>> from rotorsim.machine.schema import leaves
    >>> {path: value for path, value, _, _ in leaves(machine)}["discs.0.mass"] > 0
    True
    """
    if isinstance(part, BearingCoefficients):
        alike = {"kyy": part.kxx, "cyy": part.cxx}
        part = part.model_copy(update={name: value for name, value in alike.items() if getattr(part, name) is None})
    for name, (spec, doc) in declarations(type(part)).items():
        if name == "kind":
            continue
        here, value = f"{path}.{name}".lstrip("."), getattr(part, name, None)
        if value is None or value == ():
            yield here, None, spec, doc
        elif isinstance(value, Part):
            yield from leaves(value, here)
        elif isinstance(value, dict):
            for key, parts in value.items():
                yield from _list_leaves(parts, f"{here}.{key}")
        elif isinstance(value, tuple) and name != "unusual":
            yield from _list_leaves(value, here)
        else:
            yield here, value, spec, doc


def differences(machines: Mapping[str, Machine]) -> list[dict[str, str]]:
    """Fields in which machines differ: path, and its text in each by name, '-' where it is not there.

    Examples
    --------
    >>> import rotorsim as rs
    >>> softer = machine.replace("bearings.0.kxx", "5 MN/m")
    >>> rs.machine.differences({"a": machine, "b": softer})[0]["field"]
    'bearings.0.kxx'
    """
    tables = {name: {path: value for path, value, _ in rows(one)} for name, one in machines.items()}
    paths = dict.fromkeys(path for table in tables.values() for path in table)
    found = [{"field": path, **{name: table.get(path, "-") for name, table in tables.items()}} for path in paths]
    return [row for row in found if len({row[name] for name in machines}) > 1]


def _list_leaves(parts: tuple[Any, ...], path: str) -> Iterator[tuple[str, Any, Quantity | None, str]]:
    single = len(parts) == 1 and path.startswith("effects.")
    for i, part in enumerate(parts):
        yield from leaves(part, path if single else f"{path}.{i}")

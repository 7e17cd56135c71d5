"""A design: the text of a machine file with its edits, each of which can be undone to the byte.

An edit that brings a problem that was not there before is refused with its sentence, and the text stays; so a design
that was valid remains valid, and faults of a file can be corrected one by one. Undo and redo keep texts. Every edit is
written next to the file at once; the file itself is written on demand, and not where somebody else has changed it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any

from fe_shaft.shaft import COEFFICIENTS
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.files import write_text
from rotorsim.base.quantity import Quantity
from rotorsim.base.units import advised, show, split
from rotorsim.machine import machine_text, shipped_machines
from rotorsim.machine.file_text import (
    entries,
    kept_tables,
    parse,
    read_text,
    tables_of,
    value_at,
    with_copy,
    with_table,
    with_value,
    with_values,
    without,
)
from rotorsim.machine.rotor_import import points_of
from rotorsim.machine.schema import Machine, leaves

UNSAVED = ".edits"
"""Ending of the file, next to that of the machine, that holds edits which are not saved."""
BOM = "\ufeff"
"""Byte order mark that some editors write before the text."""
TABULAR = ("linear", "table")
"""Kinds of bearings that take the table of a file."""
SHIFT = 0.05
"""Distance of a copied part from the first one, over the shaft's length."""


class RefusedError(DataError):
    """An edit that is not taken: a sentence about the value at a path of the machine file."""


class FileChangedError(DataError):
    """The machine file was changed by somebody else since it was read or written here."""


@dataclass(eq=False)
class Design:
    """A machine's text, the last machine that it described, its file and the texts before and after.

    `disk` is what the file held when it was read or written here, None before it exists; `unkept` is why edits cannot
    be written next to it, `left` what was written there and is not saved, `kept` the text of a design A with which this
    one is compared. Texts before and after come with whether the step to them exchanges this design and A.
    """

    text: str
    path: Path
    disk: str | None = None
    machine: Machine | None = None
    problems: tuple[str, ...] = ()
    revision: int = 0
    before: list[tuple[str, bool]] = field(default_factory=list)
    after: list[tuple[str, bool]] = field(default_factory=list)
    burst: tuple[str, str] = ("", "")
    unkept: str = ""
    left: str | None = None
    kept: str = ""

    def __post_init__(self) -> None:
        self.machine, self.problems = _read(self.text)

    def set(self, path: str, typed: str, burst: str = "") -> None:
        """Take what was typed into the field of a path; empty takes the value out.

        Edits of one path in one burst, as of one field while it has the keyboard, are undone together.
        """
        typed = typed.strip()
        old = value_at(kept_tables(self.text), path)
        if not typed and old is None:
            return
        if typed and old is not None and typed == _shown(old):
            return

        def make() -> str:
            return with_value(self.text, path, self._value(path, typed)) if typed else without(self.text, path)

        self._edit(make, path, typed, (path, burst) if burst else ("", ""))

    def add(self, kind: str) -> str:
        """Add a part of a kind, a key of `NEW`, in the middle of the shaft; its path."""
        if kind not in NEW:
            raise RefusedError(f"{kind[:40]!r} cannot be added; choose {', '.join(NEW)}", argument=kind, value=kind)
        values = NEW[kind](self._drawn())
        single = kind.startswith("effects.")
        if single and value_at(self.tables, kind) is not None:
            raise RefusedError(f"{kind}: is there already; change its values", argument=kind, value=kind)
        self._edit(lambda: with_table(self.text, kind, values, single), kind, kind)
        return kind if single else f"{kind}.{len(value_at(self.tables, kind)) - 1}"

    def copy(self, path: str) -> str:
        """Copy a part, next to itself where it has a place, under another name where it has one; its path."""
        return self._copy(path, lambda machine, table: _moved(machine, path, table))

    def mirror(self, path: str) -> str:
        """Copy a part to the place as far from the shaft's other end; the copy's path."""
        return self._copy(path, lambda machine, table: _mirrored(machine, path, table))

    def split(self, path: str) -> str:
        """Make two sections of one, half as long each; the path of the second."""
        machine, (above, _, number) = self._drawn(), path.rpartition(".")
        if above != "shaft.sections" or not number.isdecimal() or int(number) >= len(machine.shaft.sections):
            raise RefusedError(f"{path[:80]}: is not a section of the shaft", argument=path, value=path)
        section = machine.shaft.sections[int(number)]
        half = {"length": show(0.5 * section.length, "m")}
        middle = dict(zip(("inner_diameter", "outer_diameter"), section.diameters(0.5 * section.length), strict=True))
        tapered = {key: show(value, "m") for key, value in middle.items()
                   if getattr(section, f"{key}_right") is not None}  # fmt: skip
        first = half | {f"{key}_right": value for key, value in tapered.items()}

        def make() -> str:
            text = with_copy(self.text, path, half | tapered)
            return with_values(text, {f"{path}.{key}": value for key, value in first.items()})

        self._edit(make, path, "split")
        return f"{above}.{int(number) + 1}"

    def tabulate(self, path: str, name: str, content: str) -> None:
        """Give a bearing without a film the table of a CSV file, in place of its coefficients."""
        table = value_at(self.tables, path)
        if not path.startswith("bearings.") or not isinstance(table, Mapping) or table.get("kind") not in TABULAR:
            way = f"takes no table; choose a bearing of kind {' or '.join(TABULAR)}"
            raise RefusedError(f"{path[:80]}: {way}", argument=path, value=name)
        try:
            points = points_of(content, name)
        except MachineFileError as error:
            raise RefusedError(str(error), argument=path, value=name) from error
        rows = [{key: show(value, spec.unit) for key, value, spec, _ in entries(point) if spec} for point in points]

        def make() -> str:
            text = self.text
            for key in [*COEFFICIENTS, "points"]:
                text = without(text, f"{path}.{key}") if key in table else text
            return with_values(text, {f"{path}.kind": "table", f"{path}.points": rows})

        self._edit(make, path, name)

    def keep(self) -> None:
        """Keep the text as design A."""
        self.kept = self.text
        self.revision += 1

    def forget(self) -> None:
        """Keep no design A any more."""
        self.kept = ""
        self.revision += 1

    def swap(self) -> None:
        """Exchange the text with that of design A, as one edit."""
        if self.kept and self.kept != self.text:
            kept, self.kept = self.kept, self.text
            self.replace(kept, swaps=True)

    def _copy(self, path: str, place: Callable[[Machine, Mapping[str, Any]], dict[str, str]]) -> str:
        table, machine = value_at(self.tables, path), self._drawn()
        above, _, number = path.rpartition(".")
        if not isinstance(table, Mapping) or not isinstance(value_at(self.tables, above), list):
            way = "is not a part of a list in the file; choose one of the page"
            raise RefusedError(f"{path[:80]}: {way}", argument=path, value=path)
        changes: dict[str, Any] = {}
        if "position" in table:
            changes |= place(machine, table)
        if "name" in table:
            changes["name"] = _free_name(str(table["name"]), value_at(self.tables, above))
        self._edit(lambda: with_copy(self.text, path, changes), path, "copy")
        return f"{above}.{int(number) + 1}"

    def delete(self, path: str) -> None:
        """Take a part out of the file, with the comments in it."""
        self._edit(lambda: without(self.text, path), path, "delete")

    def undo(self) -> None:
        """The text before the last edit."""
        self._step(self.before, self.after)

    def redo(self) -> None:
        """The text before the last undo."""
        self._step(self.after, self.before)

    def _step(self, taken: list[tuple[str, bool]], left: list[tuple[str, bool]]) -> None:
        """Take the last text of a list and leave the present one in the other; a swap is one of design A too."""
        if not taken:
            return
        text, swaps = taken.pop()
        left.append((self.text, swaps))
        if swaps and self.kept:
            self.kept = self.text
        self._become(text)

    def replace(self, text: str, swaps: bool = False) -> None:
        """Another text altogether, as one edit, by which design A may have become this one."""
        self.before.append((self.text, swaps))
        self.after.clear()
        self._become(text)

    @property
    def tables(self) -> dict[str, Any]:
        """The tables of the text, as they are written."""
        return tables_of(self.text)

    @property
    def saved(self) -> bool:
        """Whether the file holds the text."""
        return self.text == self.disk

    @property
    def unsaved(self) -> Path:
        """The file of edits that are not saved."""
        return self.path.with_name(self.path.name + UNSAVED)

    def changed_on_disk(self) -> bool:
        """Whether the file is not what it was when it was read or written here."""
        return _on_disk(self.path) != self.disk

    def save(self, path: Path | None = None, anyway: bool = False) -> None:
        """Write the file, or another one from now on; raises FileChangedError where that has another content."""
        known = self.disk if path is None or path == self.path else None
        target = path or self.path
        there = _on_disk(target)
        if there not in (None, known, self.text) and not anyway:
            way = "take it over, replace it or save elsewhere"
            raise FileChangedError(f"{target}: was changed by somebody else; {way}", argument="file", value=str(target))
        write_text(target, _mark(target) + self.text)
        self.disk = self.text
        self.forget_edits()
        self.path = target

    def take_disk(self) -> None:
        """The text that the file has now, as one edit; raises MachineFileError where it cannot be read."""
        self.disk = read_text(self.path) if self.path.is_file() else None
        if self.disk is not None:
            self.replace(self.disk)

    def _drawn(self) -> Machine:
        if self.machine is None:
            raise RefusedError(f"{self.problems[0]}; correct that first", argument="machine", value=self.path.name)
        return self.machine

    def _value(self, path: str, typed: str) -> Any:
        """The value of a machine file for what was typed: a bare number has the unit that the field shows."""
        declared = next((spec for here, _, spec, _ in self._leaves() if here == path), None)
        old = value_at(kept_tables(self.text), path)
        number = _number(typed)
        if declared is None:
            unit = split(old)[1] if isinstance(old, str) and _number(split(old)[0]) is not None else ""
            if unit and number is not None:
                return f"{typed} {unit}"
            return number if number is not None and not isinstance(old, str) and old is not None else typed
        if declared.unit == "1":
            return typed if number is None or declared.choices else number
        return f"{typed} {unit_of(old, declared)}" if number is not None else typed

    def _leaves(self) -> Iterator[tuple[str, Any, Quantity | None, str]]:
        return leaves(self.machine) if self.machine is not None else iter(())

    def _edit(self, make: Callable[[], str], path: str, typed: str, burst: tuple[str, str] = ("", "")) -> None:
        """Take the text that `make` makes unless it brings a problem that was not there."""
        try:
            text = make()
            if text == self.text:
                return
            machine, problems = _read(text)
        except MachineFileError as error:
            raise RefusedError(str(error), argument=path, value=typed) from error
        new = [one for one in problems if one not in self.problems]
        if new and (self.machine is not None or len(problems) > len(self.problems)):
            raise RefusedError(new[0], argument=path, value=typed)
        if not burst[1] or burst != self.burst or not self.before:
            self.before.append((self.text, False))
        self.after.clear()
        self._become(text, (machine, problems))
        self.burst = burst

    def _become(self, text: str, read: tuple[Machine | None, tuple[str, ...]] | None = None) -> None:
        machine, self.problems = read or _read(text)
        self.text, self.burst = text, ("", "")
        self.machine = machine or self.machine
        self.revision += 1
        self._leave_edits()

    def look(self) -> None:
        """Write the edits again where another desk that had taken them over has taken them away."""
        if self.left is not None and not self.unsaved.exists():
            self._leave_edits()

    def _leave_edits(self) -> None:
        self.unkept = ""
        if self.saved:
            self.forget_edits()
            return
        try:
            write_text(self.unsaved, self.text)
            self.left = self.text
        except OSError as error:  # the edit itself is taken
            self.unkept = str(error)

    def forget_edits(self) -> None:
        """Take the edits next to the file away, if they are those of this design or what the file holds."""
        with suppress(OSError):
            if _on_disk(self.unsaved) in (self.left, self.disk):
                self.unsaved.unlink(missing_ok=True)
        self.left = None


def open_design(name: str | Path, folder: str | Path = ".") -> Design:
    """The design of a machine file, or a new one in `folder` of a shipped machine of that name.

    Raises MachineFileError where the name is neither.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.desk.open_design("plain_rotor").machine.name
    'plain_rotor'
    """
    if str(name) in shipped_machines():
        return Design(machine_text(name), Path(folder) / f"{name}.toml")
    text = machine_text(name)
    parse(text)
    return Design(text, Path(name), text)


def unsaved_edits(design: Design) -> str | None:
    """The text with edits that an earlier desk has left next to the file; None where there is none."""
    text = _on_disk(design.unsaved)
    return None if text is None or text == design.text else text


def unit_of(written: Any, declared: Quantity) -> str:
    """Unit of a value as it is written; the usual one where there is none."""
    unit = split(written)[1] if isinstance(written, str) else ""
    return unit or advised(declared.unit)[0]


@lru_cache(maxsize=8)
def machine_from(text: str) -> Machine:
    """The machine of a text, which the desk asks for again and again; raises MachineFileError."""
    return Machine.from_text(text)


def _read(text: str) -> tuple[Machine | None, tuple[str, ...]]:
    """The machine of a text, or None and its problems."""
    try:
        return machine_from(text), ()
    except MachineFileError as error:
        return None, error.problems


def _mark(path: Path) -> str:
    """Byte order mark of a file, which it keeps; empty where it has none."""
    return BOM if path.is_file() and path.read_bytes().startswith(BOM.encode()) else ""


def _on_disk(path: Path) -> str | None:
    """Text of a file; None where there is none, or none that can be read."""
    if not path.is_file():
        return None
    try:
        return read_text(path)
    except MachineFileError:
        return ""


def _shown(written: Any) -> str:
    """A written value as its field shows it: without its unit."""
    digits = split(written)[0] if isinstance(written, str) and _number(split(written)[0]) is not None else written
    return str(digits)


@lru_cache(maxsize=1024)
def _number(text: str) -> int | float | None:
    """A number that was typed; None for anything else."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text)
    return None


def _part(machine: Machine, path: str) -> Any:
    part: Any = machine
    for key in path.split("."):
        part = part[int(key)] if key.isdecimal() else part[key] if isinstance(part, Mapping) else getattr(part, key)
    return part


def _mirrored(machine: Machine, path: str, table: Mapping[str, Any]) -> dict[str, str]:
    """Place of a part's mirror image; that of a layer, which reaches from its place to the right, is its left end."""
    part, ends = _part(machine, path), machine.shaft.start + machine.shaft.end
    long = part.length if path.startswith("shaft.layers") else 0.0
    names = [name for name in ("position", "seat") if name in table]
    return {name: show(float(f"{ends - getattr(part, name) - long:.9g}"), "m") for name in names}


def _moved(machine: Machine, path: str, table: Mapping[str, Any]) -> dict[str, str]:
    """Place of the copy of a part, 5 % of the shaft to the right, or to the left where the shaft ends before."""
    part = _part(machine, path)
    step = SHIFT * machine.shaft.length
    step = step if part.position + step <= machine.shaft.end else -step
    names = [name for name in ("position", "seat") if name in table]
    return {name: show(float(f"{getattr(part, name) + step:.4g}"), "m") for name in names}


def _free_name(name: str, parts: Any) -> str:
    """A name that no part of the list has."""
    taken = {one.get("name") for one in parts if isinstance(one, Mapping)} if isinstance(parts, list) else {name}
    stem, number = name.rstrip("0123456789") or name, 2
    while f"{stem}{number}" in taken:
        number += 1
    return f"{stem}{number}"


def _middle(machine: Machine) -> str:
    return show(float(f"{0.5 * (machine.shaft.start + machine.shaft.end):.4g}"), "m")


def _between_bearings(machine: Machine) -> str:
    """The middle of the longest part of the shaft without a bearing."""
    places = sorted({machine.shaft.start, *(b.position for b in machine.bearings), machine.shaft.end})
    a, b = max(pairwise(places), key=lambda ends: ends[1] - ends[0])
    return show(float(f"{0.5 * (a + b):.4g}"), "m")


def _section(machine: Machine) -> dict[str, Any]:
    last = machine.shaft.sections[-1]
    return {"length": show(float(f"{0.1 * machine.shaft.length:.2g}"), "m"), "outer_diameter": show(last.outer[1], "m")}


def _layer(machine: Machine) -> dict[str, Any]:
    at = float(f"{0.5 * (machine.shaft.start + machine.shaft.end):.4g}")
    inner = machine.shaft.outer_diameter(at)
    return {"position": show(at, "m"), "length": show(float(f"{0.05 * machine.shaft.length:.2g}"), "m"),
            "inner_diameter": show(inner, "m"), "outer_diameter": show(float(f"{1.2 * inner:.4g}"), "m")}  # fmt: skip


def _disc(machine: Machine) -> dict[str, Any]:
    """A solid steel disc five times as wide as the shaft there and as long as a tenth of that."""
    z = 0.5 * (machine.shaft.start + machine.shaft.end)
    diameter = 5 * machine.shaft.outer_diameter(z)
    width = 0.1 * diameter
    mass = 7850.0 * 0.25 * pi * diameter**2 * width
    inertias = mass * diameter**2 / 8, mass * (diameter**2 / 16 + width**2 / 12)
    texts = [
        show(float(f"{value:.4g}"), unit)
        for value, unit in zip((mass, *inertias), ("kg", "kg*m^2", "kg*m^2"), strict=True)
    ]
    return {"position": _middle(machine)} | dict(
        zip(("mass", "polar_inertia", "diametral_inertia"), texts, strict=True)
    )


def _probe(machine: Machine) -> dict[str, Any]:
    return {"name": _free_name("probe_", [{"name": p.name} for p in machine.probes]), "angle": "45 deg",
            "quantity": "relative_displacement", "position": _middle(machine)}  # fmt: skip


NEW: dict[str, Callable[[Machine], dict[str, Any]]] = {
    "shaft.sections": _section,
    "shaft.layers": _layer,
    "discs": _disc,
    "point_masses": lambda machine: {"position": _middle(machine), "mass": "0.1 kg"},
    "bearings": lambda machine: {"kind": "linear", "position": _between_bearings(machine), "kxx": "10 MN/m",
                                 "cxx": "1 kN*s/m"},
    "probes": _probe,
    "effects.unbalance": lambda machine: {"me": "10 g*mm"},
    "effects.gravity": lambda machine: {"acceleration": "9.81 m/s^2"},
}  # fmt: skip
"""Values of a new part by its kind, the list or table of the machine file to which it is added."""

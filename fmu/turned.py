"""Numbers of a machine that can be set before a unit starts: clearance, ambient pressure, temperature, discharge.

Others change the modes of the shaft or the weights of a grid, which no chain reproduces: the mass of a disc, the place
of a probe, the length of a film. The unit offers `Choice`s of these, with what the assembly of each machine fills.

A unit holds what `assemble` fills, the workspace and the parameter record; such a number stands in few of their
entries. Each of these follows from it by a chain of operations in the order of the assembly, so that it has the same
bits. Machines with other values are assembled to see which entries change: a number with an entry that no chain
reproduces there to the last bit, or that changes more than entries, stays fixed.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from reynolds.injector import Injector as Nozzle, unit_coefficients
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.quantity import Quantity, quantities, quantity_of
from rotorsim.base.units import parse
from rotorsim.effects import Effect
from rotorsim.effects.film.gas_heating import sutherland
from rotorsim.machine.file_text import expanded
from rotorsim.machine.gas_film import FREEZING, GASES, Gas, GasFilm, Injection, Orifices
from rotorsim.machine.limits import hottest, speed_limit
from rotorsim.machine.part import Part
from rotorsim.machine.plausibility import range_of
from rotorsim.machine.schema import Machine
from rotorsim.plant.assemble import Assembly, assemble

Formula = tuple[tuple[str, float], ...]
"""Operations on the number, one after another, each with its constant."""
OPERATIONS: dict[str, Callable[[float, float], float]] = {
    "TIMES": lambda x, a: x * a,
    "BY": lambda x, a: x / a,
    "UNDER": lambda x, a: a / x,
    "PLUS": lambda x, a: x + a,
    "ROOT": lambda x, a: math.sqrt(x),
    "VISCOSITY": getattr(sutherland, "py_func", sutherland),
}
"""Operations of formulas by their names in C."""
FACTORS = (0.77, 0.93, 1.0, 1.09, 1.31)
"""Values, over that of the machine, with which formulas are compared."""
HALVINGS = 30
"""Halvings in the search for the last value that a machine takes."""
MOST_MACHINES = 64
"""Machines that one unit holds, at most."""


@dataclass(frozen=True)
class Entries:
    """Entries `place` to `place + count` of the workspace or of the parameter record, and their formula.

    The `least` of it and what stands there is taken where several films share an entry.
    """

    in_record: bool
    place: int
    count: int
    formula: Formula
    least: bool = False


@dataclass(frozen=True)
class Turned:
    """A number that can be set: name in the unit, declaration, value, limits, and the entries that follow from it."""

    name: str
    quantity: Quantity
    value: float
    low: float
    high: float
    entries: tuple[Entries, ...]


def turned_numbers(a: Assembly) -> tuple[Turned, ...]:
    """All numbers of a machine that can be set before its unit starts."""
    found = []
    for name, path, part, formulas in _numbers(a):
        quantity = quantity_of(part.model_fields[path.rsplit(".", 1)[1]])
        value = _value(a.machine, path)
        assert quantity is not None
        entries = _entries(a, path, value, quantity, [(), *formulas])
        if entries is not None:
            low, high = (_reach(a.machine, path, value, bound) for bound in _usual(path, quantity, value))
            found.append(Turned(name, quantity, value, low, high, entries))
    return tuple(_with_tolerance(a, found))


def _usual(path: str, quantity: Quantity, value: float) -> tuple[float, float]:
    """Bounds of a number as far as such values are usual, or it has one beyond."""
    low, high = quantity.bounds
    known = range_of(path, quantity.unit)
    return (low, high) if known is None else (max(low, min(known.low, value)), min(high, max(known.high, value)))


def _with_tolerance(a: Assembly, found: list[Turned]) -> Iterator[Turned]:
    """The numbers, clearances with the tolerance of motions, which follows from the least of all films' or of none."""
    clearances = [one for one in found if one.name.endswith(".clearance")]
    formula = (("TIMES", a.machine.solver.tolerance),)
    for one in found:
        if one not in clearances:
            yield one
        elif len(clearances) == len(a.films):
            tolerance = Entries(True, _tolerance(a), 1, formula, least=one is not clearances[0])
            yield replace(one, entries=(*one.entries, tolerance))


def _tolerance(a: Assembly) -> int:
    """Place in the parameter record of the tolerance of motions."""
    fields = a.record.dtype.fields
    assert fields is not None
    return fields["motion_tolerance"][1] // 8


def value_of(formula: Formula, x: float) -> float:
    """The value of a formula."""
    for operation, constant in formula:
        x = OPERATIONS[operation](x, constant)
    return x


def _numbers(a: Assembly) -> Iterator[tuple[str, str, type[Part], list[Formula]]]:
    """Name, path, part and possible formulas of each number."""
    machine = a.machine
    if not a.films:
        return
    yield "gas.ambient_pressure", "gas.ambient_pressure", Gas, []
    yield "gas.temperature", "gas.temperature", Gas, list(_of_temperature(a))
    for k, (bearing, film) in enumerate(zip(machine.film_bearings, machine.films, strict=True)):
        name, path = f"bearing_{k + 1}" if k else "bearing", f"bearings.{bearing}"
        yield f"{name}.clearance", f"{path}.clearance", GasFilm, list(_of_clearance(machine, film))
        for i, row in enumerate(film.orifices):
            of_row = f"{name}.orifices" if len(film.orifices) == 1 else f"{name}.orifices[{i + 1}]"
            area, mouth = math.pi / 4 * row.diameter**2, (("TIMES", math.pi), ("TIMES", row.mouth))
            yield f"{of_row}.discharge", f"{path}.orifices.{i}.discharge", Orifices, [(("TIMES", area),)]
            yield f"{of_row}.curtain_discharge", f"{path}.orifices.{i}.curtain_discharge", Orifices, [mouth]
    one = machine.injection
    if one is None or not machine.injectors:
        return
    seat = (("TIMES", math.pi), ("TIMES", one.pin_diameter))
    gaps = {max(one.seat_gap - pin, one.minimum_gap) for pin in (0.0, one.pin_bias)}
    if one.pin_discharge is not None:
        name = "injection.pin_discharge"
        yield name, name, Injection, [(*seat, ("TIMES", gap)) for gap in gaps]
    name, around = "injection.curtain_discharge", (("TIMES", math.pi), ("TIMES", one.orifice_diameter))
    yield name, name, Injection, [around]


def _of_temperature(a: Assembly) -> Iterator[Formula]:
    """Formulas of a temperature T: source, nozzle function, plena, viscosity, Sutherland's constant over T."""
    gas, known = a.machine.gas, GASES[a.machine.gas.name]
    if gas.viscosity is None:
        s = known.sutherland / FREEZING
        yield ("BY", FREEZING), ("PLUS", -1.0), ("VISCOSITY", s), ("TIMES", known.viscosity)
    yield (("UNDER", gas.S),)
    for film in a.films:
        yield ("TIMES", gas.R), ("BY", film.grid.dy * film.grid.dz)
    nozzles: set[Nozzle] = {nozzle for film in a.films for nozzle in film.injectors}
    for volume, exponent in {(nozzle.plenum_volume, nozzle.polytropic_exponent) for nozzle in nozzles}:
        yield ("TIMES", gas.R), ("TIMES", exponent), ("UNDER", volume)
        yield ("TIMES", exponent * gas.R), ("UNDER", volume)
    for number in unit_coefficients(gas.kappa)[0]:
        yield ("TIMES", gas.R), ("ROOT", 0.0), ("UNDER", float(number))


def _of_clearance(machine: Machine, film: GasFilm) -> Iterator[Formula]:
    """Formulas of a clearance: the conductance of a gap to its walls."""
    for effect in machine.effects.get("heat_balance", ()):
        area = math.pi * film.diameter * film.length
        yield ("UNDER", 6 * effect.conductivity), ("TIMES", area)  # type: ignore[attr-defined]


def _entries(
    a: Assembly, path: str, value: float, quantity: Quantity, formulas: list[Formula]
) -> tuple[Entries, ...] | None:
    """Entries that follow from a number, but the tolerance; None where a formula is missing or more changes."""
    values = [float(value * factor) for factor in FACTORS if quantity.holds(value * factor)]
    others = []
    for x in values:
        try:
            other = a if x == value else assemble(a.machine.with_({path: x}))
        except MachineFileError:
            continue
        same = other.module.__name__ == a.module.__name__ and np.array_equal(other.ix, a.ix)
        if not same or speed_limit(other.machine) != speed_limit(a.machine):
            return None
        others.append((x, other))
    found: list[Entries] = []
    for in_record in (False, True):
        rows = np.array([o.numbers if in_record else o.w for _, o in others])
        changed = np.flatnonzero((rows != rows[0]).any(axis=0))
        changed = changed[changed != _tolerance(a)] if in_record else changed
        of = np.full(changed.size, -1)
        for number, formula in enumerate(formulas):
            column = np.array([value_of(formula, x) for x, _ in others])
            of[(of < 0) & (rows[:, changed] == column[:, None]).all(axis=0)] = number
        if (of < 0).any():
            return None
        breaks = np.flatnonzero((np.diff(changed) != 1) | (np.diff(of) != 0)) + 1
        for places, kinds in zip(np.split(changed, breaks), np.split(of, breaks), strict=True):
            if places.size:
                found.append(Entries(in_record, int(places[0]), places.size, formulas[kinds[0]]))
    return tuple(found) if len(others) > 2 else None


def _value(machine: Machine, path: str) -> float:
    """The value at a path of a machine."""
    part = machine
    for name in path.split("."):
        part = part[int(name)] if name.isdigit() else getattr(part, name)  # type: ignore[index]
    return float(part)  # type: ignore[arg-type]


def _reach(machine: Machine, path: str, good: float, bound: float) -> float:
    """The bound, or the last value towards it with which the machine is valid and ends at the same temperature."""

    def holds(value: float) -> bool:
        try:
            return hottest(machine.with_({path: value})) == hottest(machine)
        except MachineFileError:
            return False

    if holds(bound):
        return bound
    bad = bound
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


@dataclass(frozen=True)
class Choice:
    """A number that a unit takes from a list: path, name in the unit, declaration, values [SI], first its own."""

    path: str
    name: str
    quantity: Quantity
    values: tuple[float, ...]

    @property
    def text(self) -> str:
        """The values in ascending order, each as it reads back, with their unit."""
        return (
            f"{', '.join(repr(float(value)).removesuffix('.0') for value in sorted(self.values))} {self.quantity.unit}"
        )


Over = Mapping[str, float | str | Sequence[float | str]]
"""Values, in SI or as text with units, one or several, by paths of the machine."""


def listed(path: str, values: float | str | Sequence[float | str]) -> tuple[float | str, ...]:
    """The values offered for a path, of which one needs no list; raises DataError for none."""
    found = tuple(values) if isinstance(values, Iterable) and not isinstance(values, str) else (values,)
    if not found:
        raise DataError(f"over: {path} has no values; give one or more, or leave it out", argument=path, value=values)
    return found


def _in_si(path: str, value: float | str, unit: str) -> float:
    """A value offered, in SI; raises DataError for one that is not a number of its unit."""
    try:
        return parse(value, unit) if isinstance(value, str) else float(value)
    except (TypeError, ValueError) as error:
        fault = error if isinstance(value, str) else f"{value!r} is not a number"
        raise DataError(f"over: {path}: {fault}", argument=path, value=value) from error


def _by_path(machine: Machine, over: Over) -> dict[str, list[float | str]]:
    """Values by the paths of single numbers: a star is each entry of a list."""
    found: dict[str, list[float | str]] = {}
    for path, values in over.items():
        offered = listed(path, values)
        for one in expanded(machine.text, path):
            found.setdefault(one, []).extend(offered)
    return found


def read_choices(a: Assembly, over: Over) -> tuple[Choice, ...]:
    """Numbers of a machine that a unit offers; a path with a star offers its values for each entry of a list.

    Raises DataError for a path without a number, a value that is none, and too many machines.

    The machine's own value is added where it is not among the values.
    """
    found = []
    for path, values in _by_path(a.machine, over).items():
        name, owner, field = _named(a.machine, path)
        quantity = None if owner is None else _declaration(owner, field)
        own = None if quantity is None else getattr(owner, field)
        if own is None and field == "position" and isinstance(owner, Effect):
            own = a.mesh.place(owner)
        if quantity is None or own is None:
            raise DataError(f"over: {path} leads to no number of {a.machine.name}; write e.g. 'discs.0.mass'")
        others = [_in_si(path, x, quantity.unit) for x in values]
        found.append(Choice(path, name, quantity, tuple(dict.fromkeys([float(own), *others]))))
    count = math.prod(len(one.values) for one in found)
    if count > MOST_MACHINES:
        raise DataError(f"over: {count} machines are above the limit of {MOST_MACHINES}; offer fewer values")
    return tuple(found)


def chosen_machines(machine: Machine, choices: Sequence[Choice]) -> list[Machine]:
    """The machines of all choices, the last one varying first, the machine itself at the beginning."""
    found = []
    for numbers in product(*(range(len(one.values)) for one in choices)):
        changes = {one.path: one.values[k] for one, k in zip(choices, numbers, strict=True) if k}
        found.append(machine.with_(changes) if changes else machine)
    return found


def _declaration(owner: object, field: str) -> Quantity | None:
    """Declaration of a field of a part or effect."""
    if isinstance(owner, Effect):
        return quantities(owner).get(field)
    known = type(owner).model_fields.get(field) if isinstance(owner, Part) else None
    return None if known is None else quantity_of(known)


def _named(machine: Machine, path: str) -> tuple[str, object, str]:
    """Name in the unit of what is at a path of a machine, the part or effect that has it (or None), and its field."""
    *above, field = path.split(".")
    here: object = machine
    words: list[str] = []
    for key in above:
        if isinstance(here, Mapping):
            here = here.get(key, ())
            words.append(key)
            continue
        if isinstance(here, tuple) and not key.isdecimal():
            return path, None, field
        if isinstance(here, tuple):
            number = int(key)
            here = here[number] if number < len(here) else None
            words[-1:] = [_item(machine, words[-1], number)]
            continue
        here = getattr(here, key, None)
        words.append(key)
    if isinstance(here, tuple):  # an effect without its number
        here = here[0] if len(here) == 1 else None
    return ".".join([*words, field]), here, field


def _item(machine: Machine, kind: str, number: int) -> str:
    """Name of an entry of a list, counted from 1; a film by its number, a probe by its name, an effect if several."""
    if kind == "bearings" and number in machine.film_bearings:
        place = machine.film_bearings.index(number)
        return f"bearing_{place + 1}" if place else "bearing"
    if kind == "probes" and number < len(machine.probes):
        return f"probes.{machine.probes[number].name}"
    if len(machine.effects.get(kind, ())) == 1:
        return kind
    return f"{kind}[{number + 1}]"

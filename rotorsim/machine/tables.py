"""Tables of a machine file: rotor, bearings, gas film with injectors, effects, grid and solver, all in SI units.

Units, limits and sentences of an effect are declared by its fields. A change at a dotted path has SI values, which are
checked as those of a machine file.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, replace
from typing import Annotated, Any

from pydantic import Discriminator, Field, InstanceOf, Tag, ValidationError, field_validator

from rotorsim.base.display import closest, did_you_mean, quote
from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantity_of
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.base import LEFT_OUT
from rotorsim.machine import numerics
from rotorsim.machine.bearings import LinearBearing, TableBearing
from rotorsim.machine.gas_film import Actuators, Gas, GasFilm, Injection, PinnedInjector, ThrustBearing
from rotorsim.machine.numerics import Checked, Grid, Limits, Solver
from rotorsim.machine.part import SI, Part, PartError, quantity, sentences, unknown_field
from rotorsim.machine.rotor import AnyProbe, Disc, Drive, LumpedMass, Probe, Shaft

SAME_PLACE = 1e-7
"""Places nearer than this [m] are one."""


def _kind(bearing: Any) -> str | None:
    kind = bearing.get("kind") if isinstance(bearing, dict) else getattr(bearing, "kind", None)
    return kind if isinstance(kind, str) else None


Bearing = Annotated[
    Annotated[LinearBearing, Tag("linear")]
    | Annotated[TableBearing, Tag("table")]
    | Annotated[GasFilm, Tag("gas_film")],
    Discriminator(_kind),
]


class MachineTables(Part):
    """A rotor on its bearings, each part by itself."""

    name: str = Field(description="Short name.")
    description: str = Field("", description="A sentence about the machine.")
    shaft: Shaft = Field(description="The elastic shaft.")
    discs: tuple[Disc, ...] = Field((), description="Rigid discs on the shaft.")
    point_masses: tuple[LumpedMass, ...] = Field((), description="Masses without moments of inertia on the shaft.")
    bearings: tuple[Bearing, ...] = Field(min_length=1, description="Bearings: gas films, linear ones, tables.")
    thrust_bearings: tuple[ThrustBearing, ...] = Field((), description="Gas films that carry along the shaft.")
    axial_load: float | None = quantity(
        "N", "Static force on the rotor towards +z, as its weight where it stands upright; none when not given.", None,
        low=-1e9, high=1e9, example=20.0)  # fmt: skip
    gas: Gas = Field(Gas(), description="The gas in film and injectors.")
    injection: Injection | None = Field(None, description="What all injectors have in common.")
    injectors: tuple[PinnedInjector, ...] = Field((), description="The injectors of the gas film.")
    actuators: Actuators | None = Field(None, description="Piezo actuators of the pins; ideal when not given.")
    drive: Drive = Field(Drive(), description="What turns and brakes the shaft.")
    probe: Probe | None = Field(None, description="Where displacement is measured; the first disc when not given.")
    probes: tuple[AnyProbe, ...] = Field((), description="Further probes, at any plane, angle and quantity.")
    grid: Grid = Field(Grid(symmetry="auto"), description="Grid of the gas film.")
    solver: Solver = Field(Solver(), description="Step and tolerances.")
    effects: dict[str, tuple[InstanceOf[Effect], ...]] = Field({}, description="Physical effects by name.")
    limits: Limits | None = Field(None, description="Where a run ends; see `rotorsim.machine.limits`.")
    checked: Checked | None = Field(None, description="Range in which the model was compared with measurements.")
    unusual: tuple[str, ...] = Field((), description="Paths of values that are meant, however unusual.")

    @property
    def films(self) -> tuple[GasFilm, ...]:
        """The gas films, in the order of the bearings; AttributeError while one of these has no kind."""
        return tuple(b for b in self.bearings if b.kind == "gas_film")

    @property
    def film_bearings(self) -> tuple[int, ...]:
        """Indices of the bearings that are gas films."""
        return tuple(i for i, b in enumerate(self.bearings) if b.kind == "gas_film")

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Name of every bearing; 'bearing 0' and so on, as the machine file counts them, where it has none."""
        return tuple(b.name or f"bearing {i}" for i, b in enumerate(self.bearings))

    @property
    def bearings_in_words(self) -> tuple[str, ...]:
        """Every bearing as a sentence names it: 'the bearing left', 'the tail bearing'; 'bearing 0' without a name."""
        named = (b.name and (b.name if "bearing" in b.name.lower() else f"bearing {b.name}") for b in self.bearings)
        return tuple(f"the {name}" if name else f"bearing {i}" for i, name in enumerate(named))

    @property
    def disc_names(self) -> tuple[str, ...]:
        """Name of every disc; 'disc 0' and so on, as the machine file counts them, where it has none."""
        return tuple(d.name or f"disc {i}" for i, d in enumerate(self.discs))

    @property
    def film_names(self) -> tuple[str, ...]:
        """Names of the bearings that are gas films."""
        return tuple(self.bearing_names[i] for i in self.film_bearings)

    @property
    def thrust_names(self) -> tuple[str, ...]:
        """Name of every thrust bearing; 'thrust bearing 0' and so on where it has none."""
        return tuple(t.name or f"thrust bearing {i}" for i, t in enumerate(self.thrust_bearings))

    @property
    def film(self) -> GasFilm | None:
        """The first gas film, if there is one."""
        return next(iter(self.films), None)

    @property
    def pinned_film(self) -> int | None:
        """Number from 0, among the films, of the one that the injectors with pins feed."""
        if not self.injectors or self.injection is None:
            return None
        return 0 if self.injection.bearing is None else self.film_at(self.injection.bearing)

    def film_at(self, bearing: float) -> int | None:
        """Number from 0, among the films, of a bearing; None where no gas film stands there."""
        films = self.film_bearings
        return films.index(int(bearing)) if bearing in films else None

    def film_number(self, effect: Effect) -> int | None:
        """Number from 0, among the films, of the one that an effect is about; None for all films, or none."""
        bearing = getattr(effect, "bearing", None)
        return None if bearing is None else self.film_at(bearing)

    def spring_number(self, effect: Effect) -> int | None:
        """Index of the linear bearing that an effect is about, the first where it names none; None without one."""
        named = getattr(effect, "bearing", None)
        springs = [i for i, b in enumerate(self.bearings) if isinstance(b, LinearBearing) and named in (None, i)]
        return next(iter(springs), None)

    @property
    def supported(self) -> tuple[int, ...]:
        """Indices of the bearings in a housing that moves."""
        return tuple(i for i, bearing in enumerate(self.bearings) if bearing.support is not None)

    def housing_at(self, z: float) -> int | None:
        """Index of the bearing at a coordinate z [m] whose housing moves; None where there is none."""
        return next((i for i in self.supported if abs(self.bearings[i].position - z) <= SAME_PLACE), None)

    def housing_under(self, effect: Effect) -> int | None:
        """Index of the bearing on whose housing an effect acts; None where no housing that moves is there."""
        z = getattr(effect, "position", None)
        if z is not None:
            return self.housing_at(z)
        own = self.spring_number(effect) if effect.place == "bearing" else None
        if effect.place == "film" and self.films:
            own = self.film_bearings[self.film_number(effect) or 0]
        return own if own in self.supported else None

    def housing_of(self, probe: AnyProbe) -> int | None:
        """Index of the bearing on whose housing a probe is mounted; None where that stands still.

        That is the bearing it names, else the nearest one; a sensor without a position is on the only housing.
        """
        if probe.bearing is not None:
            nearest = int(probe.bearing)
        elif probe.position is None:
            return self.supported[0] if self.supported else None
        else:
            places = [abs(bearing.position - probe.position) for bearing in self.bearings]
            nearest = places.index(min(places))
        return nearest if nearest in self.supported else None

    def film_of(self, effect: Effect) -> GasFilm | None:
        """The film that an effect is about, the first where it is about all."""
        number = self.film_number(effect)
        return self.film if number is None else self.films[number]

    def injector_count(self, effect: Effect) -> int:
        """Number of injectors, orifices included, of the film that an effect is about; the largest of all films."""
        about = self.film_number(effect)
        counts = [
            sum(int(row.count) for row in film.orifices) + (len(self.injectors) if k == self.pinned_film else 0)
            for k, film in enumerate(self.films)
            if about in (None, k)
        ]
        return max(counts, default=0)

    @property
    def orifice_count(self) -> int:
        """Number of orifices without pins of all films."""
        return sum(int(row.count) for film in self.films for row in film.orifices)

    @property
    def fed(self) -> bool:
        """Whether gas is supplied to a journal film, by injectors or orifices."""
        return bool(self.orifice_count) or self.pinned_film is not None

    @property
    def supplied(self) -> bool:
        """Whether anything takes gas from the supply: a journal film or a thrust bearing."""
        return self.fed or any(one.inner_edge == "fed" for one in self.thrust_bearings)

    @property
    def mass(self) -> float:
        """Mass of shaft, discs and point masses [kg]."""
        return self.shaft.mass + sum(d.mass for d in self.discs) + sum(m.mass for m in self.point_masses)

    @property
    def sampling_time(self) -> float:
        """Time [s] between two samples of probes, encoder and laws; see `rotorsim.machine.numerics`."""
        return numerics.sampling_time(self)

    @property
    def time_step(self) -> float:
        """Step [s] of the solver, which divides the sampling time."""
        return numerics.time_step(self)

    @field_validator("effects", mode="before")
    @classmethod
    def _effects(cls, tables: Any) -> Any:
        return read_effects(tables)


def read_effects(tables: Any) -> dict[str, tuple[Effect, ...]]:
    """Effects by name in the file's order; every problem of every table is raised at once."""
    if not isinstance(tables, Mapping):
        raise ValueError(f"{quote(tables)} is not a set of tables; write e.g. [effects.unbalance]")
    problems: list[tuple[str, str]] = []
    effects = {str(name): _read_entries(str(name), value, problems) for name, value in tables.items()}
    if problems:
        raise PartError(*problems)
    return effects


def readable_effects(tables: Any) -> dict[str, tuple[Effect, ...]]:
    """The effects in which nothing is wrong."""
    found: dict[str, tuple[Effect, ...]] = {}
    for name, value in tables.items() if isinstance(tables, Mapping) else ():
        problems: list[tuple[str, str]] = []
        read = _read_entries(str(name), value, problems)
        found |= {} if problems else {str(name): read}
    return found


def unknown_effect(name: str) -> str:
    """Sentence about a name that is no effect's; the package that has it may have failed."""
    if name in LEFT_OUT:
        return LEFT_OUT[name]
    if closest(name, REGISTRY):
        return f"unknown effect; {did_you_mean(name, REGISTRY)}"
    return "unknown effect; take one that 'rotorsim machine effects' lists, or install the package that has it"


def _read_entries(name: str, value: Any, problems: list[tuple[str, str]]) -> tuple[Effect, ...]:
    if name not in REGISTRY:
        problems.append((name, unknown_effect(name)))
        return ()
    if isinstance(value, (list, tuple)) and value:
        return tuple(_read_one(name, f"{name}.{i}", entry, problems) for i, entry in enumerate(value))
    return (_read_one(name, name, value, problems),)


def _read_one(name: str, path: str, table: Any, problems: list[tuple[str, str]]) -> Effect:
    effect = REGISTRY[name]
    if isinstance(table, effect):
        return table
    known = {f.name: f for f in fields(effect)}
    values: dict[str, Any] = {}
    if not isinstance(table, Mapping):
        problems.append((path, f"{quote(table)} is not a table; write [effects.{name}]"))
        table = {}
    for key, given in table.items():
        if key not in known:
            problems.append((f"{path}.{key}", unknown_field(str(key), known)))
            continue
        try:
            unit = quantity_of(known[key])
            values[key] = float(unit.parse(given)) if unit else given
        except ValueError as error:
            problems.append((f"{path}.{key}", str(error)))
    for key, parameter in known.items():
        if key not in table and parameter.default is MISSING and parameter.default_factory is MISSING:
            problems.append((f"{path}.{key}", "missing; add it"))
    return effect() if problems else effect(**values)


class ChangeTree(dict[str, Any]):
    """Changes below one part of a machine, by field or number."""


def branches(values: Mapping[str, Any]) -> ChangeTree:
    """Values by dotted path as a tree; raises MachineFileError for a path that lies below another."""
    root = ChangeTree()
    for path, value in values.items():
        *above, last = keys = path.split(".")
        if not all(keys):
            raise MachineFileError(f"{path!r} is not a path; write e.g. 'effects.unbalance.me'")
        here = root
        for depth, key in enumerate(above, 1):
            whole = ".".join(above[:depth])
            if whole in values:
                raise MachineFileError(
                    f"{path}: lies below {whole}, which is given too; give one of them", argument=path
                )
            here = here.setdefault(key, ChangeTree())
        here[last] = value
    return root


def changed(old: Any, change: Any, path: str = "") -> Any:
    """A part, list or effect of a machine with a tree of changes; raises MachineFileError with one line per problem."""
    if change is None and isinstance(old, (Part, Effect, tuple, Mapping)):
        raise MachineFileError(f"{path}: may not be None; give the whole part")
    if not isinstance(change, ChangeTree):
        return change
    if isinstance(old, tuple):
        return _changed_items(old, change, path)
    if isinstance(old, Mapping):
        return _changed_effects(old, change, path)
    if isinstance(old, Effect):
        return _changed_effect(old, change, path)
    if isinstance(old, Part):
        return _changed_part(old, change, path)
    raise MachineFileError(f"{path}: is a value, not a table; check the path")


def _changed_items(old: tuple[Any, ...], change: ChangeTree, path: str) -> tuple[Any, ...]:
    if not old:
        raise MachineFileError(f"{path}: there are none in this machine; give the whole list")
    alone = len(old) == 1 and not all(key.isdecimal() for key in change)  # a single table without its number
    items = {"0": change} if alone else change
    _known(items, map(str, range(len(old))), path)
    single = len(old) == 1 and isinstance(old[0], Effect)
    numbered = ((str(i), item) for i, item in enumerate(old))
    where = {i: path if single else _join(path, i) for i in items}
    return tuple(changed(item, items[i], where[i]) if i in items else item for i, item in numbered)


def _changed_effects(old: Mapping[str, Any], change: ChangeTree, path: str) -> dict[str, Any]:
    """Effects by name; one that is absent can only be given as a whole."""
    for name in (key for key, value in change.items() if isinstance(value, ChangeTree) and key not in old):
        absent = "is not in this machine; give the whole effect, or use replace"
        raise MachineFileError(f"{_join(path, name)}: {absent if name in REGISTRY else unknown_effect(name)}")
    return {**old, **{name: changed(old.get(name), value, _join(path, name)) for name, value in change.items()}}


def _changed_part(old: Part, change: ChangeTree, path: str) -> Part:
    known = type(old).model_fields
    _known(change, known, path)
    new = dict(old)
    for key, value in change.items():
        optional = known[key].default is None
        if isinstance(value, ChangeTree) and new[key] is None and quantity_of(known[key]) is None:
            raise MachineFileError(f"{_join(path, key)}: is not in this machine; give the whole part")
        new[key] = None if optional and value is None else changed(new[key], value, _join(path, key))
    return checked_part(type(old), new, path)


def checked_part(kind: type[Part], values: Mapping[str, Any], path: str) -> Part:
    try:
        return kind.model_validate(values, context=SI)
    except ValidationError as error:
        raise MachineFileError("\n".join(_join(path, line) for line in sentences(error, kind))) from error


def _changed_effect(effect: Effect, change: ChangeTree, path: str) -> Effect:
    known = {entry.name: entry for entry in fields(effect)}
    _known(change, known, path)
    return replace(
        effect, **{name: _parameter(known[name], value, _join(path, name)) for name, value in change.items()}
    )


def _parameter(entry: dataclasses.Field[Any], change: Any, path: str) -> Any:
    """A value of an effect's parameter; a number is a float, as those of machine files."""
    declaration, value = quantity_of(entry), changed(None, change, path)
    if declaration is None or (value is None and entry.default is None):
        return value
    try:
        return float(declaration.check(value))
    except ValueError as error:
        raise MachineFileError(f"{path}: {error}") from error


def _known(change: Iterable[str], names: Iterable[str], path: str) -> None:
    """Refuse a path that leads nowhere."""
    names = list(names)
    for key in change:
        if key not in names:
            raise MachineFileError(f"{_join(path, key)}: is not there; {did_you_mean(key, names)}")


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key

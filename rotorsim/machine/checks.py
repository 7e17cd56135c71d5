"""Checks between parts, and every problem of a machine file in one pass.

Parts go together in their positions on the shaft, the spacing of bearings, injectors in the film, effects with a
target. pydantic checks values one by one and looks at what is between them once all are right. `every_problem` makes
the parts of what can be read, without the values that cannot; a check that meets a missing one ends without a word.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import chain
from math import inf
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from rotorsim.base.quantity import quantities, quantity_of
from rotorsim.base.units import show
from rotorsim.effects import FILM_PORTS, Effect
from rotorsim.effects.base import OFF_SHAFT
from rotorsim.machine.gas_film import GasFilm
from rotorsim.machine.numerics import check_step
from rotorsim.machine.part import Part, choices, sentences
from rotorsim.machine.plausibility import films_of, numbers, questions
from rotorsim.machine.rotor import HousingAcceleration, HousingVelocity
from rotorsim.machine.tables import MachineTables, readable_effects

SAME_PLACE = 1e-6
"""Bearings nearer than this [m] are at one position."""


MOVE_HOUSING = ("pedestal", "base_vibration")
"""Effects in which the housing moves."""
OTHER_PLACES = {f"the {place}": f"the {place}" for place in ("left end", "right end", "plane of the probes", "shaft")}
"""Places that a sentence names where neither a disc nor a bearing is."""
Problems = Iterator[tuple[str, str]]


def cross_check(machine: MachineTables) -> Problems:
    """Paths and sentences of all problems between parts, those first that decide what the machine is."""
    for check in (*decisive(machine), *further(machine)):
        yield from check


def decisive(machine: MachineTables) -> Iterator[Problems]:
    """Checks of what a machine is made of."""
    yield _injection(machine)
    yield _actuators(machine)
    yield _once(machine)
    for path, effect in _each_effect(machine):
        yield _place(machine, path, effect)


def further(machine: MachineTables) -> Iterator[Problems]:
    """Checks of how its parts fit, each by itself."""
    yield _on_shaft(machine)
    yield _bearings_apart(machine)
    for list_name in ("bearings", "discs", "thrust_bearings"):
        yield _names(machine, list_name)
    yield _disc_names(machine)
    yield _axial(machine)
    for check in (_floor, _thin, _reach, _offsets, _one_law):
        yield check(machine)
    yield _gains(machine)
    yield check_step(machine)
    yield _meant(machine)
    yield _cool(machine)
    yield _probes(machine)
    for path, effect in _each_effect(machine):
        yield _own(machine, path, effect)


def _positions(machine: MachineTables) -> Iterator[tuple[str, float]]:
    """Paths and coordinates of everything that has a place on the shaft."""
    named: list[tuple[str, Any]] = [(f"point_masses.{i}", mass) for i, mass in enumerate(machine.point_masses)]
    named += [(f"bearings.{i}", bearing) for i, bearing in enumerate(machine.bearings)]
    named += [(f"thrust_bearings.{i}", bearing) for i, bearing in enumerate(machine.thrust_bearings)]
    named += [("probe", machine.probe)] if machine.probe else []
    named += [(f"probes.{i}", probe) for i, probe in enumerate(machine.probes)]
    for path, part in chain(named, _each_effect(machine)):
        position = getattr(part, "position", None)
        if position is not None:
            yield f"{path}.position", position


def _on_shaft(machine: MachineTables) -> Problems:
    start, end = machine.shaft.start, machine.shaft.end
    slack = 1e-9 * machine.shaft.length
    reach = f"{show(start, 'm')} to {show(float(f'{end:.9g}'), 'm')}"
    arms = [getattr(disc, "position", None) for disc in machine.discs if getattr(disc, "seat", None) is not None]
    for i, disc in enumerate(machine.discs):
        name = "position" if getattr(disc, "seat", None) is None else "seat"
        z = getattr(disc, name, start)
        if not start - slack <= z <= end + slack:
            way = "move it, lengthen the shaft" + (" or give the disc a seat on it" if name == "position" else "")
            yield f"discs.{i}.{name}", f"'{show(z, 'm')}' is outside the shaft ({reach}); {way}"
    for path, z in _positions(machine):
        if not start - slack <= z <= end + slack and z not in arms:
            yield path, f"'{show(z, 'm')}' is outside the shaft ({reach}); move it or lengthen the shaft"


def _names(machine: MachineTables, where: str) -> Problems:
    """Every part of a list with a name has its own."""
    names = [getattr(part, "name", None) for part in getattr(machine, where)]
    for i, name in enumerate(names):
        if name is not None and name in names[:i]:
            yield f"{where}.{i}.name", f"'{name}' is the name of {where}.{names.index(name)} too; give each its own"


def _disc_names(machine: MachineTables) -> Problems:
    """No disc has the name that a sentence has for another place."""
    discs, bearings = ([getattr(part, "name", None) for part in own] for own in (machine.discs, machine.bearings))
    taken = {f"the bearing {name}" if name else f"bearing {i}": f"bearings.{i}" for i, name in enumerate(bearings)}
    taken |= {f"disc {i}": f"discs.{i}" for i, name in enumerate(discs) if not name} | OTHER_PLACES
    for i, name in enumerate(discs):
        if name in taken:
            yield f"discs.{i}.name", f"'{name}' is what a sentence calls {taken[name]}; give the disc another name"


def _axial(machine: MachineTables) -> Problems:
    """A load along the shaft has a film that pushes against it."""
    against = "-z" if (machine.axial_load or 0.0) > 0 else "+z"
    if machine.axial_load and against not in [getattr(one, "pushes", None) for one in machine.thrust_bearings]:
        yield "axial_load", f"'{show(machine.axial_load, 'N')}' has no thrust bearing that pushes '{against}'; add one"


def _bearings_apart(machine: MachineTables) -> Problems:
    places = [getattr(bearing, "position", inf) for bearing in machine.bearings]
    for i, place in enumerate(places):
        for k, other in enumerate(places[:i]):
            if abs(place - other) < SAME_PLACE:
                yield (
                    f"bearings.{i}.position",
                    f"'{show(place, 'm')}' is where bearings.{k} is; move one or add its stiffness there",
                )


def _injection(machine: MachineTables) -> Problems:
    if machine.injectors and machine.injection is None:
        yield "injection", "missing, but there are injectors; add [injection] or remove the injectors"
    if machine.injectors and machine.film is None:
        yield "injectors", "there is no film to inject into; add a bearing with kind = 'gas_film' or remove them"
    common = machine.injection
    if common is None or machine.film is None:
        return
    if common.bearing is not None and machine.film_at(common.bearing) is None:
        yield "injection.bearing", f"{common.bearing:g} {_no_film(machine)}"
    if machine.injectors and machine.pinned_film is not None:
        film = machine.films[machine.pinned_film]
        reach = max(abs(one.offset) for one in machine.injectors) + common.orifice_diameter / 2
        path = f"bearings.{machine.film_bearings[machine.pinned_film]}"
        yield from ((f"{path}.{name}", why) for name, why in film.sleeve.unfed(reach))


def _one_law(machine: MachineTables) -> Problems:
    """Rows of orifices and pins follow one law."""
    rows = {f"{path}.orifices.{i}": row for path, film in films_of(machine) for i, row in enumerate(film.orifices)}
    laminar = {path: row.loss_factor is not None for path, row in rows.items()}
    if machine.injectors and machine.injection is not None:
        laminar = {"injection": machine.injection.law == "loss_factor", **laminar}
    first = next(iter(laminar.values()), False)
    for path, own in laminar.items():
        if own != first:
            yield (
                f"{path}.loss_factor",
                f"{'given' if own else 'missing'}, unlike before; all rows and pins follow one law",
            )


def _no_film(machine: MachineTables) -> str:
    """Rest of a sentence about an index that is not that of a gas film."""
    known = [path.rpartition(".")[2] for path, _ in films_of(machine)]
    return f"is not the index of a gas film among the bearings; write {' or '.join(known)}"


def _probes(machine: MachineTables) -> Problems:
    """Every probe has a name of its own, and one of the housing has a housing that can move."""
    shaken = any(name in machine.effects for name in MOVE_HOUSING)
    first: dict[str, int] = {}
    for i, probe in enumerate(machine.probes):
        name = getattr(probe, "name", None)
        if name in first:
            yield f"probes.{i}.name", f"'{name}' is the name of probes.{first[name]} too; give each its own"
        elif name is not None:
            first[name] = i
        bearing = getattr(probe, "bearing", None)
        if bearing is not None and not bearing < len(machine.bearings):
            yield (
                f"probes.{i}.bearing",
                f"{bearing:g} is not the index of a bearing; write 0 to {len(machine.bearings) - 1}",
            )
        elif isinstance(probe, (HousingVelocity, HousingAcceleration)):
            yield from _housing(machine, f"probes.{i}", probe, shaken)


def _housing(machine: MachineTables, path: str, probe: HousingVelocity | HousingAcceleration, shaken: bool) -> Problems:
    """A sensor on a housing: it can move, and there is no doubt which one it is."""
    if machine.housing_of(probe) is None and not shaken:
        yield (
            f"{path}.quantity",
            f"'{probe.quantity}' needs a housing that moves; give its bearing a support, add [effects.pedestal] or "
            "[effects.base_vibration], or write 'relative_displacement'",
        )  # fmt: skip
    if probe.bearing is None and probe.position is None and len(machine.supported) > 1:
        yield f"{path}.bearing", f"missing, and {len(machine.supported)} bearings have a housing that moves; add it"


def _floor(machine: MachineTables) -> Problems:
    for _, film in films_of(machine):
        if machine.solver.minimum_film >= film.clearance:
            shown, limit = show(machine.solver.minimum_film, "m"), show(film.clearance, "m")
            yield "solver.minimum_film", f"'{shown}' is not below the clearance '{limit}'; make it smaller"
            return


def _thin(machine: MachineTables) -> Problems:
    for path, film in films_of(machine):
        if film.clearance > film.diameter / 20:
            limit = show(film.diameter / 20, "m")
            yield f"{path}.clearance", f"'{show(film.clearance, 'm')}' is not a thin film; write at most '{limit}'"


def _reach(machine: MachineTables) -> Problems:
    shaft = machine.shaft
    for path, film in films_of(machine):
        if not (shaft.start - 1e-9 <= film.position - film.length / 2
                and film.position + film.length / 2 <= shaft.end + 1e-9):  # fmt: skip
            yield f"{path}.length", f"'{show(film.length, 'm')}' reaches beyond the shaft; move or shorten the film"


def _offsets(machine: MachineTables) -> Problems:
    """Injectors and rows of orifices stand inside their films."""
    for place, film, offset, width in chain(_orifices(machine), _injectors(machine)):
        room = max((film.length - width) / 2, 0.0)
        if abs(offset) > room:
            shown, limit = show(offset, "m"), show(room, "m")
            yield f"{place}.offset", f"'{shown}' puts the orifice outside the film; write at most '{limit}'"


def _orifices(machine: MachineTables) -> Iterator[tuple[str, GasFilm, float, float]]:
    """Paths of rows of orifices, their films, offsets [m] and widths [m]."""
    for path, film in films_of(machine):
        yield from ((f"{path}.orifices.{i}", film, row.offset, row.mouth) for i, row in enumerate(film.orifices))


def _injectors(machine: MachineTables) -> Iterator[tuple[str, GasFilm, float, float]]:
    """Paths of injectors, their film, offsets [m] and widths [m]; none while it is open which film they feed."""
    if machine.injection is None:
        return
    number = machine.injection.bearing
    if number is None:  # the first film: a bearing before it that has no kind ends this check
        number = next((i for i, bearing in enumerate(machine.bearings) if bearing.kind == "gas_film"), -1)
    film, width = dict(films_of(machine)).get(f"bearings.{int(number)}"), machine.injection.orifice_diameter
    if film is not None:
        yield from ((f"injectors.{i}", film, getattr(x, "offset", 0.0), width) for i, x in enumerate(machine.injectors))


def _each_effect(machine: MachineTables) -> Iterator[tuple[str, Effect]]:
    """Paths of all effects and themselves."""
    for name, entries in machine.effects.items():
        for i, effect in enumerate(entries):
            yield (f"effects.{name}" if len(entries) == 1 else f"effects.{name}.{i}"), effect


def _once(machine: MachineTables) -> Problems:
    """An effect is there once if it can be only once."""
    for name, entries in machine.effects.items():
        if len(entries) > 1 and entries[0].single and not _one_a_film(machine, entries):
            way = "give each the 'bearing' of another film" if len(machine.films) > 1 else "keep one table"
            yield f"effects.{name}", f"there are {len(entries)} of them, and a machine has one; {way}"


def _place(machine: MachineTables, path: str, effect: Effect) -> Problems:
    """An effect has something to act on."""
    found = misplaced(machine, effect)
    if found:
        yield f"{path}.{found[0]}".rstrip("."), found[1]


def _one_a_film(machine: MachineTables, entries: tuple[Effect, ...]) -> bool:
    """Whether effects are about a film each, every one about another."""
    films = {machine.film_number(effect) for effect in entries}
    return None not in films and len(films) == len(entries)


def _own(machine: MachineTables, path: str, effect: Effect) -> Problems:
    """Values beyond an effect's limits, in an effect made in Python, and problems that an effect itself finds."""
    for field, declared in quantities(effect).items():
        value = getattr(effect, field)
        absent = value is None and getattr(type(effect), field, None) is None
        if not absent and (sentence := declared.fault(value)):
            yield f"{path}.{field}", sentence
    if misplaced(machine, effect) is None:
        for field, sentence in effect.problems(machine).items():
            yield f"{path}.{field}".rstrip("."), sentence


def misplaced(machine: MachineTables, effect: Effect) -> tuple[str, str] | None:
    """Missing part of the machine on which an effect acts: field and sentence."""
    placed = getattr(effect, "position", None) is not None or effect.influence != "node"
    if effect.port in ("reference", "amplifier") and not machine.injectors:
        where = "" if machine.film is not None else " to a gas film"
        return "", f"acts on the pins of injectors, but there are none; add [[injectors]]{where} or remove it"
    if (effect.place == "film" or effect.port in FILM_PORTS) and machine.film is None:
        return "", "acts in a gas film, but there is none; add one (kind = 'gas_film') or remove it"
    if effect.influence in OFF_SHAFT and machine.housing_under(effect) is None:
        return _no_housing(machine, effect)
    bearing = getattr(effect, "bearing", None)
    if effect.place == "bearing":
        springs = [str(i) for i, one in enumerate(machine.bearings) if one.kind == "linear"]
        if bearing is not None and str(int(bearing)) not in springs:
            return (
                "bearing",
                f"{bearing:g} is not the index of a linear bearing; write {' or '.join(springs) or 'none'}",
            )
        return None
    if bearing is not None and machine.film_at(bearing) is None:
        return "bearing", f"{bearing:g} {_no_film(machine)}"
    if effect.port == "support" and bearing is None and len(machine.films) > 1:
        known = " or ".join(path.rpartition(".")[2] for path, _ in films_of(machine))
        return "bearing", f"missing, and there are several films; write {known}"
    if effect.port == "support" and getattr(machine.film_of(effect), "support", None) is not None:
        return "", "its bearing has a support already; keep one of the two"
    if effect.port == "injector" and not machine.injectors and not any(film.orifices for _, film in films_of(machine)):
        return "", "acts in injectors, but there are none; add [[injectors]] or [[bearings.orifices]], or remove it"
    if effect.port in ("amplifier", "actuator") and machine.actuators is None:
        return "", "acts in the piezo actuators, but there are none; add [actuators] or remove it"
    on_disc = effect.port in ("force", "random_force", "motion") and effect.place == "disc"
    if on_disc and not placed and not machine.discs:
        middle = show(float(f"{machine.shaft.start + machine.shaft.length / 2:.3g}"), "m")
        return "position", f"missing, and there is no disc to act on; write e.g. '{middle}'"
    return None


def _no_housing(machine: MachineTables, effect: Effect) -> tuple[str, str]:
    """Field and sentence for an effect on a housing where none moves."""
    z, places = getattr(effect, "position", None), [machine.bearings[i].position for i in machine.supported]
    if not hasattr(effect, "position"):
        return "", "acts on the housing of its bearing, which stands still; give that a support"
    write = " or ".join(f"'{show(place, 'm')}'" for place in places) or "the position of a bearing with a support"
    if z is None:
        return "position", f"missing, and it acts on the housing of a bearing; write {write}"
    return "position", f"at '{show(z, 'm')}' no housing moves; give a bearing there a support or write {write}"


def _actuators(machine: MachineTables) -> Problems:
    driven = machine.actuators is not None and getattr(machine.actuators, "mode", "ideal") != "ideal"
    if driven and not machine.injectors:
        yield "actuators", "there are no injectors whose pins they could move; add injectors or remove them"


def _gains(machine: MachineTables) -> Problems:
    if machine.actuators is not None and machine.actuators.mode == "reference":
        for i, injector in enumerate(machine.injectors):
            for name in ("pd_gain", "pd_zero"):
                if getattr(injector, name, 0.0) is None:
                    yield f"injectors.{i}.{name}", "missing, but actuators.mode is 'reference'; add it"


def _cool(machine: MachineTables) -> Problems:
    """The gas is fed cooler than a film may become."""
    limit, fed = getattr(machine.limits, "temperature", None), machine.gas.temperature
    if limit is not None and limit <= fed:
        text = f"'{show(limit, 'K')}' is not above the gas.temperature '{show(fed, 'K')}'; make it higher"
        yield "limits.temperature", text


def _meant(machine: MachineTables) -> Problems:
    """Paths of unusual values lead to values."""
    known = {path for path, _, _ in numbers(machine)} if machine.unusual else set()
    for i, path in enumerate(machine.unusual):
        if path not in known:
            yield f"unusual.{i}", f"'{path}' leads to no number; write the path of one, e.g. 'shaft.start'"


def every_problem(error: ValidationError, model: type[Part], tables: Mapping[str, Any]) -> list[str]:
    """Sentences of all problems of the tables of a file, those first that decide what the machine is."""
    machine: Any = readable(model, tables)
    filed = tables.get("effects", {})
    first = [_line(found) for check in decisive(machine) for found in _found(check)]
    if not isinstance(filed, Mapping) or len(machine.effects) < len(filed):
        machine.__dict__.pop("effects")  # one effect may need another that cannot be read
    between = [_line(found) for part in _parts(machine) for found in _found(*part)]
    with suppress(AttributeError):
        for check in further(machine):
            between += [_line(found) for found in _found(check)]
    return list(dict.fromkeys([*first, *sentences(error, model), *between, *questions(machine, whole=False)]))


def readable(model: type[Part], table: Any) -> Part:
    """A part with what can be read of its table; a value that cannot is an attribute that is missing."""
    table = table if isinstance(table, Mapping) else {}
    part = model.model_construct()
    for name in model.model_fields:
        if name in table:
            part.__dict__.pop(name, None)
            with suppress(ValueError):
                part.__dict__[name] = _read(model, name, table[name])
    return part


def _read(model: type[Part], name: str, value: Any) -> Any:
    """A value as its field has it; raises ValueError."""
    info = model.model_fields[name]
    known, kinds = quantity_of(info), choices(info.annotation)
    if known is not None:
        return known.parse(value)
    if get_origin(kinds[0]) is dict:
        return readable_effects(value)
    if get_origin(kinds[0]) is tuple:
        own = choices(get_args(kinds[0])[0])
        if not isinstance(value, (list, tuple)):
            raise ValueError(name)
        return tuple(value) if own == (str,) else tuple(_item(own, item) for item in value)
    if isinstance(kinds[0], type) and issubclass(kinds[0], BaseModel):
        return readable(_kind(kinds, value), value)
    words = get_args(kinds[0])
    if (words and value not in words) or not isinstance(value, str):
        raise ValueError(name)
    return value


def _item(kinds: tuple[Any, ...], table: Any) -> Part:
    """An item of a list; one of a kind that is not known keeps its place and has no values, not even a kind."""
    try:
        return readable(_kind(kinds, table), table)
    except ValueError:
        return Part.model_construct()


def _kind(kinds: tuple[Any, ...], table: Any) -> type[Part]:
    """The part that a table is, by its tag where there are several; raises ValueError where it has none of them."""
    if len(kinds) == 1:
        return kinds[0]
    given = table.get(kinds[0].tag) if isinstance(table, Mapping) else None
    known = [k for k in kinds if given in get_args(k.model_fields[k.tag].annotation)]
    if not known:
        raise ValueError(given)
    return known[0]


def _parts(part: Any, path: str = "") -> Iterator[tuple[Iterable[tuple[str, str]], str]]:
    """Problems within every part below, and its path; the whole itself is checked apart."""
    for name in type(part).model_fields:
        value = part.__dict__.get(name)
        below = [(f"{path}{name}", value)] if isinstance(value, Part) else []
        if isinstance(value, tuple):
            below = [(f"{path}{name}.{i}", item) for i, item in enumerate(value) if isinstance(item, Part)]
        for here, one in below:
            yield one.problems(), here
            yield from _parts(one, f"{here}.")


def _found(problems: Iterable[tuple[str, str]], path: str = "") -> Iterator[tuple[str, str]]:
    """Problems up to where a value is missing or one that does not fit makes no number."""
    with suppress(AttributeError, ArithmeticError, ValueError):
        for below, sentence in problems:
            yield f"{path}.{below}".strip("."), sentence


def _line(found: tuple[str, str]) -> str:
    return f"{found[0]}: {found[1]}"

"""Places on a machine where an effect acts: probes, injectors, bearings, discs or the shaft.

They follow from the effect's port, from its `influence`, `place`, `position` and `bearing`, as the plant takes them,
and from its `injector`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import tau

from rotorsim.effects import FILM_PORTS, Effect
from rotorsim.machine import Machine
from rotorsim.machine.gas_film import GasFilm
from rotorsim.plant.mesh import SAME_PLACE, Mesh

OF_NOZZLES = ("injector", "plenum")
"""Ports of single injectors."""
WHOLE = ("torque", "rotating")
"""Ports of the whole shaft."""


@dataclass(frozen=True)
class Nozzle:
    """An injector or orifice: index of its bearing, number from 1 there, whether it has a pin, z [m], angle [rad]."""

    bearing: int
    number: int
    pinned: bool
    z: float
    angle: float


@dataclass(frozen=True)
class Place:
    """A place where something acts.

    part : 'probes', 'injector', 'bearing', 'disc' or 'shaft'
    name : as text, with its position
    begin, end : coordinates z [m] between which it lies
    nozzle : the injector, where it is a single one
    """

    part: str
    name: str
    begin: float
    end: float
    nozzle: Nozzle | None = None


def acting_places(machine: Machine, effect: Effect) -> tuple[Place, ...]:
    """Places of a machine where an effect acts, from the left end to the right."""
    if effect.port == "sensor":
        return (probe_plane(machine),)
    if effect.port in FILM_PORTS:
        return tuple(_nozzles_of(machine, effect)) or tuple(_films_of(machine, effect))
    if effect.port in WHOLE or effect.influence == "mass":
        return (_span("the whole shaft", machine.shaft.start, machine.shaft.end),)
    if effect.influence == "bow":
        ends = [bearing.position for bearing in machine.bearings]
        return (_span("the shaft between the outermost bearings", min(ends), max(ends)),)
    mesh = Mesh(machine)
    bearing = mesh.bearing_number(effect)
    return (place_at(machine, mesh.place(effect)) if bearing is None else bearing_place(machine, bearing),)


def probe_plane(machine: Machine) -> Place:
    """Plane of the displacement probes."""
    z = Mesh(machine).probe
    return Place("probes", f"the probes at {_mm(z)}", z, z)


def force_plane(machine: Machine) -> Place:
    """The first disc, on which an equivalent force acts; the plane of the probes where there is none."""
    return place_at(machine, machine.discs[0].position if machine.discs else Mesh(machine).probe)


def place_at(machine: Machine, z: float) -> Place:
    """A plane of the shaft: a disc where one is there."""
    several = len(machine.discs) > 1
    for number, disc in enumerate(machine.discs):
        if abs(disc.position - z) < SAME_PLACE:
            return Place("disc", f"disc {number} at {_mm(z)}" if several else f"the disc at {_mm(z)}", z, z)
    return Place("shaft", f"the shaft at {_mm(z)}", z, z)


def bearing_place(machine: Machine, number: int) -> Place:
    """A bearing by its index; a gas film is as long as it is."""
    bearing = machine.bearings[number]
    name = f"{machine.bearing_names[number]} at {_mm(bearing.position)}"
    return Place("bearing", name, *bearing.ends)


def nozzles(machine: Machine) -> tuple[Nozzle, ...]:
    """Injectors and orifices: of each film those with pins, then its rows of orifices."""
    found: list[Nozzle] = []
    for number, (bearing, film) in enumerate(_films(machine)):
        pinned = machine.injectors if number == machine.pinned_film else ()
        at = [(True, one.offset, one.angle) for one in pinned]
        at += [(False, row.offset, angle) for row in film.orifices for angle in row.angles]
        found += [
            Nozzle(bearing, k, pin, film.position + offset, angle % tau) for k, (pin, offset, angle) in enumerate(at, 1)
        ]
    return tuple(found)


def _films_of(machine: Machine, effect: Effect) -> Iterator[Place]:
    """The film that an effect is about, or all; of the pins' actuators the film that these feed."""
    about = machine.pinned_film if effect.port == "actuator" else machine.film_number(effect)
    for number, (bearing, _) in enumerate(_films(machine)):
        if about in (None, number):
            yield bearing_place(machine, bearing)


def _films(machine: Machine) -> Iterator[tuple[int, GasFilm]]:
    """The gas films with the indices of their bearings."""
    yield from zip(machine.film_bearings, machine.films, strict=True)


def _nozzles_of(machine: Machine, effect: Effect) -> Iterator[Place]:
    """The injector that an effect names, in the film that it is about or in all; none where it names none."""
    if effect.port not in OF_NOZZLES:
        return
    number, about = int(getattr(effect, "injector", 0)), machine.film_number(effect)
    for one in nozzles(machine):
        if one.number == number and (about is None or about == machine.film_at(one.bearing)):
            name = f"injector {number} of {machine.bearing_names[one.bearing]} at {_mm(one.z)}"
            yield Place("injector", name, one.z, one.z, one)


def _span(name: str, begin: float, end: float) -> Place:
    return Place("shaft", name, begin, end)


def _mm(z: float) -> str:
    """Position of three digits."""
    return f"{float(f'{z * 1e3:.3g}'):g} mm"

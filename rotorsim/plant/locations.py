"""Places on a machine: where an effect acts, and where its probes read.

An effect acts at probes, injectors, bearings, discs or the shaft, as its port, its `influence`, `place`, `position`,
`bearing` and `injector` say. A probe is a row of factors of the motion, with coordinates for its readings in a record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import tau
from typing import Any

import numpy as np

from rotorsim.effects import FILM_PORTS, Effect
from rotorsim.effects.base import HOUSING, OFF_SHAFT
from rotorsim.machine.gas_film import GasFilm
from rotorsim.machine.rotor import AnyProbe, ShaftProbe, gain, reading_unit
from rotorsim.machine.schema import Machine
from rotorsim.machine.tables import SAME_PLACE
from rotorsim.plant.kernels.layout import AROUND
from rotorsim.plant.mesh import Mesh

OF_NOZZLES = ("injector", "plenum", "reference", "amplifier", "pin_sensor")
"""Ports of single injectors."""
WHOLE = ("drive", "torque", "rotating")
"""Ports of the whole shaft."""
DRIVEN = ("reference", "amplifier")
"""Ports of the electronics that drive the pins."""
OF_PINS = ("reference", "amplifier", "actuator", "pin_sensor")
"""Ports of the pins."""
OF_HOUSING = "the housing of "
"""Beginning of the name of a housing as a place, before its bearing's."""


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
        found = tuple(_nozzles_of(machine, effect)) or tuple(_films_of(machine, effect))
        return tuple(map(_drive_of, found)) if effect.port in DRIVEN else found
    if effect.port in WHOLE or effect.influence == "mass":
        return (_span("the whole shaft", machine.shaft.start, machine.shaft.end),)
    if effect.influence == "bow":
        ends = [bearing.position for bearing in machine.bearings]
        return (_span("the shaft between the outermost bearings", min(ends), max(ends)),)
    mesh = Mesh(machine)
    bearing = machine.housing_under(effect) if effect.influence in OFF_SHAFT else mesh.bearing_number(effect)
    if bearing is None:
        return (place_at(machine, mesh.place(effect)),)
    return (bearing_place(machine, bearing, effect.influence == HOUSING),)


def probe_plane(machine: Machine) -> Place:
    """Plane of the displacement probes."""
    return probes_at(Mesh(machine).probe)


def probes_at(z: float) -> Place:
    """A plane of displacement probes at a coordinate [m]."""
    return Place("probes", f"the probes at {_mm(z)}", z, z)


def force_plane(machine: Machine) -> Place:
    """The first disc, on which an equivalent force acts; the plane of the probes where there is none."""
    return place_at(machine, machine.discs[0].position if machine.discs else Mesh(machine).probe)


def place_at(machine: Machine, z: float) -> Place:
    """A plane of the shaft: a disc where one is there."""
    several = len(machine.discs) > 1
    for number, disc in enumerate(machine.discs):
        if abs(disc.position - z) < SAME_PLACE:
            name = machine.disc_names[number] if several or disc.name else "the disc"
            return Place("disc", f"{name} at {_mm(z)}", z, z)
    return Place("shaft", f"the shaft at {_mm(z)}", z, z)


def bearing_place(machine: Machine, number: int, housing: bool = False) -> Place:
    """A bearing by its index, or its housing; a gas film is as long as it is."""
    bearing = machine.bearings[number]
    name = f"{OF_HOUSING * housing}{machine.bearings_in_words[number]} at {_mm(bearing.position)}"
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
    """The film that an effect is about, or all."""
    about = _film_number(machine, effect)
    for number, (bearing, _) in enumerate(_films(machine)):
        if about in (None, number):
            yield bearing_place(machine, bearing)


def _film_number(machine: Machine, effect: Effect) -> int | None:
    """Number of the film that an effect is about, None for all; of the pins' effects the film that these feed."""
    return machine.pinned_film if effect.port in OF_PINS else machine.film_number(effect)


def _films(machine: Machine) -> Iterator[tuple[int, GasFilm]]:
    """The gas films with the indices of their bearings."""
    yield from zip(machine.film_bearings, machine.films, strict=True)


def _nozzles_of(machine: Machine, effect: Effect) -> Iterator[Place]:
    """The injector that an effect names, in the film that it is about or in all; none where it names none."""
    if effect.port not in OF_NOZZLES:
        return
    number, about = int(getattr(effect, "injector", 0)), _film_number(machine, effect)
    for one in nozzles(machine):
        if one.number == number and (about is None or about == machine.film_at(one.bearing)):
            name = f"injector {number} of {machine.bearing_names[one.bearing]} at {_mm(one.z)}"
            yield Place("injector", name, one.z, one.z, one)


def _drive_of(place: Place) -> Place:
    """The electronics that drive an injector, or all of a film."""
    what = (
        "the reference and amplifier" if place.nozzle is not None else "the references and amplifiers of the injectors"
    )
    return replace(place, name=f"{what} of {place.name}")


def _span(name: str, begin: float, end: float) -> Place:
    return Place("shaft", name, begin, end)


def _mm(z: float) -> str:
    """Position of three digits."""
    return f"{float(f'{z * 1e3:.3g}'):g} mm"


FACTORS: dict[str, dict[int, float]] = {
    "relative_displacement": {0: -1.0},
    "absolute_displacement": {6: 1.0},
    "housing_velocity": {2: 1.0, 8: 1.0},
    "housing_acceleration": {4: 1.0, 10: 1.0},
}
"""Places of x among the motion around the shaft (`layout.AROUND`) that a quantity has, and their factors."""


ORDER = {"relative_displacement": 0, "housing_velocity": 1, "housing_acceleration": 2}
"""Time derivative of the housing's displacement that is in a quantity."""


def probe_rows(mesh: Mesh) -> np.ndarray:
    """Factors (probes, 3 n + AROUND): of the n coordinates, their velocities and accelerations, the motion around."""
    machine, n = mesh.machine, mesh.reduced.Phi.shape[1]
    rows = np.zeros((len(machine.probes), 3 * n + AROUND))
    for row, probe in zip(rows, machine.probes, strict=True):
        direction = gain(probe) * along(probe.angle)
        if isinstance(probe, ShaftProbe):
            row[:n] = direction @ mesh.shape_between(probe.position)
        mounted, order = machine.housing_of(probe), ORDER.get(probe.quantity)
        if mounted is not None and order is not None:
            sign = -1.0 if order == 0 else 1.0
            row[n * order : n * (order + 1)] += sign * direction @ mesh.housing(mounted)
        for place, factor in FACTORS[probe.quantity].items():
            row[3 * n + place : 3 * n + place + 2] = factor * direction
    return rows


def along(angle: float) -> np.ndarray:
    """Unit vector (2,) at an angle [rad] from x towards y, exact at right angles."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    return np.where(np.abs(direction) < 1e-15, 0.0, direction)


def position(machine: Machine, probe: AnyProbe) -> float:
    """Coordinate z [m] of a probe; NaN for one of a housing that no bearing has."""
    if probe.position is not None:
        return float(probe.position)
    mounted = machine.housing_of(probe)
    if mounted is not None:
        return machine.bearings[mounted].position
    return float("nan") if machine.film is None else machine.film.position


def probe_coordinates(machine: Machine) -> dict[str, Any]:
    """Coordinates of `probe_measured` in a record; empty for a machine without probes."""
    probes = machine.probes
    if not probes:
        return {}
    return {
        "probe": [p.name for p in probes],
        "probe_quantity": [p.quantity for p in probes],
        "probe_position": [position(machine, p) for p in probes],
        "probe_angle": [p.angle for p in probes],
        "probe_gain": [gain(p) for p in probes],
        "probe_unit": [reading_unit(p) for p in probes],
    }

"""Mirror image x to -x of a machine: angles a become pi - a, and a shaft that turned from x to y turns from y to x."""

from collections.abc import Iterator
from dataclasses import fields
from math import pi

from rotorsim.machine.bearings import LinearBearing
from rotorsim.machine.gas_film import GasFilm
from rotorsim.machine.schema import Machine

ANGLES = {"phase", "phase_2x", "phase_3x", "sleeve_phase", "journal_phase", "weight_direction", "direction"}
"""Fields of effects that are angles from x towards y, or phases of a wave that turns with the shaft."""
ALONG_X = {
    ("base_vibration", "x"): "m/s^2", ("journal_tilt", "x"): "rad", ("rub", "offset_x"): "m",
    ("sensor_gain", "cross_x"): "1", ("sensor_gain", "cross_y"): "1",
}  # fmt: skip
"""Unit of the fields, by name of the effect, that are along x or couple x with y."""
IN_TIME = {("base_vibration", "phase")}
"""Phases that do not turn."""


def mirrored(machine: Machine) -> Machine:
    """The mirror image of a machine; tables over the speed are those of either sense and stay."""
    values = (*_bearings(machine), *_injectors(machine), *_effects(machine))
    return machine.with_({path: f"{value!r} {unit}" if unit != "1" else value for path, value, unit in values})


def _bearings(machine: Machine) -> Iterator[tuple[str, float, str]]:
    for k, bearing in enumerate(machine.bearings):
        at = f"bearings.{k}"
        if isinstance(bearing, LinearBearing):
            for name, unit in (("kxy", "N/m"), ("kyx", "N/m"), ("cxy", "N*s/m"), ("cyx", "N*s/m")):
                if getattr(bearing, name):
                    yield f"{at}.{name}", -getattr(bearing, name), unit
        if isinstance(bearing, GasFilm):
            yield from _film(bearing, at)


def _film(film: GasFilm, at: str) -> Iterator[tuple[str, float, str]]:
    if film.lobes is not None:
        yield f"{at}.lobes.offset", 1 - film.lobes.offset, "1"
        yield f"{at}.lobes.first_angle", pi - film.lobes.first_angle, "rad"
    if film.grooves is not None:
        yield f"{at}.grooves.angle", -film.grooves.angle, "rad"
    for name in ("steps", "orifices"):
        for n, row in enumerate(getattr(film, name)):
            yield f"{at}.{name}.{n}.first_angle", pi - row.first_angle, "rad"


def _injectors(machine: Machine) -> Iterator[tuple[str, float, str]]:
    for k, injector in enumerate(machine.injectors):
        yield f"injectors.{k}.angle", pi - injector.angle, "rad"


def _effects(machine: Machine) -> Iterator[tuple[str, float, str]]:
    for name, several in machine.effects.items():
        for n, effect in enumerate(several):
            at = f"effects.{name}" if len(several) == 1 else f"effects.{name}.{n}"
            for field in (one.name for one in fields(effect)):
                value = getattr(effect, field)
                if field in ANGLES and (name, field) not in IN_TIME:
                    yield f"{at}.{field}", (pi - value + pi) % (2 * pi) - pi, "rad"
                elif (name, field) in ALONG_X and value:
                    yield f"{at}.{field}", -value, ALONG_X[name, field]

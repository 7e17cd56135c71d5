"""What no part sees alone: all on the shaft, bearings apart, injectors in the film, effects with a place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rotorsim.effects import FILM_PORTS, Effect
from rotorsim.machine.film import GasFilm
from rotorsim.machine.units import show

if TYPE_CHECKING:
    from rotorsim.machine.schema import Machine

SAME_PLACE = 1e-6
"""Bearings nearer than this [m] are at one position."""


def cross_check(machine: Machine) -> list[tuple[str, str]]:
    """Paths and sentences of all problems between parts."""
    checks = (_on_shaft, _bearings_apart, _films, _actuators, _effects)
    return [problem for check in checks for problem in check(machine)]


def _positions(machine: Machine) -> Iterator[tuple[str, float]]:
    for i, disc in enumerate(machine.discs):
        yield f"discs.{i}.position", disc.position
    for i, bearing in enumerate(machine.bearings):
        yield f"bearings.{i}.position", bearing.position
    if machine.probe:
        yield "probe.position", machine.probe.position
    for name, entries in machine.effects.items():
        for i, effect in enumerate(entries):
            position = getattr(effect, "position", None)
            if position is not None:
                yield _effect_path(name, i, len(entries)) + ".position", position


def _on_shaft(machine: Machine) -> Iterator[tuple[str, str]]:
    start, end = machine.shaft.start, machine.shaft.end
    slack = 1e-9 * machine.shaft.length
    reach = f"{show(start, 'm')} to {show(float(f'{end:.9g}'), 'm')}"
    for path, z in _positions(machine):
        if not start - slack <= z <= end + slack:
            yield path, f"'{show(z, 'm')}' is outside the shaft ({reach}); move it or lengthen the shaft"


def _bearings_apart(machine: Machine) -> Iterator[tuple[str, str]]:
    for i, bearing in enumerate(machine.bearings):
        for k, other in enumerate(machine.bearings[:i]):
            if abs(bearing.position - other.position) < SAME_PLACE:
                place = show(bearing.position, "m")
                yield (
                    f"bearings.{i}.position",
                    f"'{place}' is where bearings.{k} is; move one or add its stiffness there",
                )


def _films(machine: Machine) -> Iterator[tuple[str, str]]:
    films = [(i, b) for i, b in enumerate(machine.bearings) if isinstance(b, GasFilm)]
    for i, _ in films[1:]:
        yield (
            f"bearings.{i}",
            f"second gas film beside bearings.{films[0][0]}; keep one, make the other kind = 'linear'",
        )
    if machine.injectors and not films:
        yield (
            "injectors",
            "there is no film to inject into; add a bearing with kind = 'gas_film' or remove them",
        )
    if machine.injectors and machine.injection is None:
        yield "injection", "missing, but there are injectors; add [injection] or remove the injectors"
    if films:
        yield from _film(machine, f"bearings.{films[0][0]}", films[0][1])


def _film(machine: Machine, path: str, film: GasFilm) -> Iterator[tuple[str, str]]:
    floor, shaft = machine.solver.minimum_film, machine.shaft
    if floor >= film.clearance:
        limit = show(film.clearance, "m")
        yield (
            "solver.minimum_film",
            f"'{show(floor, 'm')}' is not below the clearance '{limit}'; make it smaller",
        )
    if film.clearance > film.diameter / 20:
        limit = show(film.diameter / 20, "m")
        yield f"{path}.clearance", f"'{show(film.clearance, 'm')}' is no thin film; write at most '{limit}'"
    if film.position - film.length / 2 < shaft.start - 1e-9 or film.position + film.length / 2 > shaft.end + 1e-9:
        yield (
            f"{path}.length",
            f"'{show(film.length, 'm')}' reaches beyond the shaft; move or shorten the film",
        )
    orifice = machine.injection.orifice_diameter if machine.injection else 0.0
    room = (film.length - orifice) / 2
    for i, injector in enumerate(machine.injectors):
        if abs(injector.offset) > room:
            said, limit = show(injector.offset, "m"), show(max(room, 0.0), "m")
            yield (
                f"injectors.{i}.offset",
                f"'{said}' puts the orifice outside the film; write at most '{limit}'",
            )


def _effects(machine: Machine) -> Iterator[tuple[str, str]]:
    for name, entries in machine.effects.items():
        if len(entries) > 1 and entries[0].single:
            yield f"effects.{name}", f"there are {len(entries)} of them, and a machine has one; keep one table"
        for i, effect in enumerate(entries):
            path = _effect_path(name, i, len(entries))
            misplaced = _misplaced(machine, effect)
            if misplaced:
                yield f"{path}.{misplaced[0]}".rstrip("."), misplaced[1]
                continue
            for field, sentence in effect.problems(machine).items():
                yield f"{path}.{field}".rstrip("."), sentence


def _misplaced(machine: Machine, effect: Effect) -> tuple[str, str] | None:
    """What an effect lacks to act on: field and sentence."""
    placed = getattr(effect, "position", None) is not None or effect.influence != "node"
    if machine.film is None and (effect.place == "film" or effect.port in FILM_PORTS):
        return "", "acts in a gas film, but there is none; add one (kind = 'gas_film') or remove it"
    if effect.port == "actuator" and machine.actuators is None:
        return "", "acts in the piezo actuators, but there are none; add [actuators] or remove it"
    if effect.port in ("force", "motion") and effect.place == "disc" and not placed and not machine.discs:
        return "position", "missing, and there is no disc to act on; write e.g. '25 mm'"
    return None


def _actuators(machine: Machine) -> Iterator[tuple[str, str]]:
    if machine.actuators is None or machine.actuators.mode == "ideal":
        return
    if not machine.injectors:
        yield "actuators", "there are no injectors whose pins they could move; add injectors or remove them"
    if machine.actuators.mode == "reference":
        for i, injector in enumerate(machine.injectors):
            for name in ("pd_gain", "pd_zero"):
                if getattr(injector, name) is None:
                    yield f"injectors.{i}.{name}", "missing, but actuators.mode is 'reference'; add it"


def _effect_path(name: str, index: int, entries: int) -> str:
    return f"effects.{name}" if entries == 1 else f"effects.{name}.{index}"

"""User's machine with every effect of the catalogue added at its neutral value.

A candidate is then a change of parameters, and its plant is compiled once; so is what single records state as set on
purpose. Effects that scatter readings (noise, quantisation, encoder, pressure transducer) are left out: the diagnosis
compares means, and what scatters is its floor.
"""

from __future__ import annotations

from dataclasses import replace

from rotorsim.effects import FILM_PORTS, REGISTRY, Effect, FilmEffect
from rotorsim.machine import Machine


def without_scatter(machine: Machine) -> Machine:
    """Machine without the effects that scatter sensor readings."""
    return with_effects(machine, {n: e for n, e in machine.effects.items() if REGISTRY[n].role != "scatter"})


def with_effects(machine: Machine, effects: dict[str, tuple[Effect, ...]]) -> Machine:
    """Machine with other effects; raises MachineFileError if they do not fit."""
    return machine.with_({"effects": effects})


def fits(effect: Effect, machine: Machine) -> bool:
    """True if an effect has something to act on in the machine."""
    if machine.film is None and effect.port in FILM_PORTS:
        return False
    if effect.port in ("injector", "plenum") and not machine.injector_count(effect):
        return False
    if effect.port == "actuator" and not machine.injectors:
        return False
    if effect.port == "actuator" and (machine.actuators is None or machine.actuators.mode == "ideal"):
        return False
    present = {**machine.effects, effect.name: (effect,)}
    return not effect.problems(machine.model_copy(update={"effects": present}))


def bearings_of(effect: type[Effect], machine: Machine) -> tuple[int | None, ...]:
    """Bearings that a candidate can be about: of several gas films each, else None alone."""
    films = machine.film_bearings
    return films if issubclass(effect, FilmEffect) and len(films) > 1 else (None,)


def own_tables(effect: type[Effect], machine: Machine) -> tuple[Effect, ...]:
    """Neutral tables of a candidate: for every bearing that it can be about all its places."""
    tables = []
    for bearing in bearings_of(effect, machine):
        own = [effect.neutral(machine, i) for i in range(effect.places)]
        own = own if bearing is None else [replace(e, bearing=bearing) for e in own]  # type: ignore[call-arg]
        tables += own if all(fits(e, machine) for e in own) else []
    return tuple(tables)


def of_each_film(present: tuple[Effect, ...], own: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """What a machine has of an effect that a film has once, as a table for each film; neutral where it has none."""
    if all(getattr(e, "bearing", None) is None for e in own):
        return present
    common = next((e for e in present if getattr(e, "bearing", None) is None), None)
    named = {getattr(e, "bearing", None): e for e in present}
    return tuple(
        named.get(e.bearing, e if common is None else replace(common, bearing=e.bearing))  # type: ignore
        for e in own
    )


def equip(
    machine: Machine, also: tuple[str, ...] = (), scatter: bool = False, only: tuple[str, ...] | None = None
) -> tuple[Machine, dict[str, int]]:
    """Machine with all candidates at neutral values, and the table number of each.

    An effect that may have several tables gets its own; a single one shares the machine's. Of several films each has
    a table. `also` adds effects
    that are otherwise left out, `scatter` keeps those of the sensors, `only` limits the candidates.
    """
    base = dict(machine.effects) if scatter else dict(without_scatter(machine).effects)
    slots: dict[str, int] = {}
    ahead: dict[str, tuple[Effect, ...]] = {}
    behind: dict[str, tuple[Effect, ...]] = {}
    for name in sorted(REGISTRY):
        effect = REGISTRY[name]
        if effect.role == "scatter" or (effect.role == "asymmetric" and name not in also):
            continue
        fixed = effect.role == "set" or effect.calibration_of(machine)
        if only is not None and name not in only and not fixed:
            continue
        own = own_tables(effect, machine)
        if not own:
            continue
        if name in base:
            if effect.single:
                slots[name] = 0
                base[name] = of_each_film(base[name], own)
            else:
                slots[name] = len(base[name])
                base[name] = (*base[name], *own)
        else:
            slots[name] = 0
            (behind if effect.ends_chain else ahead)[name] = own
    return with_effects(machine, {**ahead, **base, **behind}), slots

"""User's machine with every effect of the catalogue added at its neutral value.

A candidate is then a change of parameters, and its plant is compiled once. Effects that scatter readings (noise,
quantisation, encoder, pressure transducer) are left out: the diagnosis compares means, and what scatters is its floor.
"""

from __future__ import annotations

from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
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
    if effect.port in ("injector", "plenum", "actuator") and not machine.injectors:
        return False
    if effect.port == "actuator" and (machine.actuators is None or machine.actuators.mode == "ideal"):
        return False
    present = {**machine.effects, effect.name: (effect,)}
    return not effect.problems(machine.model_copy(update={"effects": present}))


def equip(
    machine: Machine, also: tuple[str, ...] = (), scatter: bool = False, only: tuple[str, ...] | None = None
) -> tuple[Machine, dict[str, int]]:
    """Machine with all candidates at neutral values, and the table number of each.

    An effect that may have several tables gets one of its own; a single one shares the machine's. `also` adds effects
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
        if only is not None and name not in only and not effect.calibration_of(machine):
            continue
        own = tuple(effect.neutral(machine, i) for i in range(effect.places))
        if not all(fits(e, machine) for e in own):
            continue
        if name in base:
            if effect.single:
                slots[name] = 0
            else:
                slots[name] = len(base[name])
                base[name] = (*base[name], *own)
        else:
            slots[name] = 0
            (behind if effect.ends_chain else ahead)[name] = own
    return with_effects(machine, {**ahead, **base, **behind}), slots

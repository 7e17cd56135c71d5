"""The machine of a diagnosis: the user's, with every effect of the catalogue in it at its neutral value.

A candidate is then a change of parameters, and its plant is compiled once. Effects that scatter readings (noise,
quantisation, encoder, pressure transducer) are left out: the diagnosis compares means, and what scatters is its floor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
from rotorsim.machine import Machine
from rotorsim.machine.toml import dumps

SCATTER = ("noise", "quantisation", "encoder", "pressure_transducer")
LEFT_OUT = (*SCATTER, "journal_tilt")
"""A tilt breaks the symmetry of the film, which is another plant."""
CALIBRATING = ("unbalance", "clearance_growth", "ball_bearing", "discharge_drift", "plenum_volume")
"""Effects that a calibration turns."""
TWICE = ("weak_injector", "plenum_volume", "unbalance")
"""Effects that a diagnosis needs in two places at once."""


def without_scatter(machine: Machine) -> Machine:
    """The machine whose sensors show means."""
    return with_effects(machine, {n: e for n, e in machine.effects.items() if n not in SCATTER})


def with_effects(machine: Machine, effects: dict[str, tuple[Effect, ...]]) -> Machine:
    """The machine with other effects; raises MachineFileError where they do not fit it."""
    return Machine.from_text(dumps(machine.model_copy(update={"effects": effects})))


def fits(effect: Effect, machine: Machine) -> bool:
    """Whether an effect has something to act on."""
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
    """The machine with all candidates, neutral, and the number of the table that each may use.

    An effect that may have several tables gets one of its own; a single one shares the machine's. `also` adds effects
    that are otherwise left out, `scatter` keeps those of the sensors, `only` limits the candidates.
    """
    base = dict(machine.effects) if scatter else dict(without_scatter(machine).effects)
    slots: dict[str, int] = {}
    ahead: dict[str, tuple[Effect, ...]] = {}
    behind: dict[str, tuple[Effect, ...]] = {}
    for name in sorted(REGISTRY):
        effect = REGISTRY[name]
        if name in LEFT_OUT and name not in also and name not in base:
            continue
        if name in SCATTER or (name in LEFT_OUT and name not in also):
            continue
        if only is not None and name not in only and name not in CALIBRATING:
            continue
        own = tuple(_neutral(effect, machine, i) for i in range(2 if name in TWICE else 1))
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
            (behind if name == "dead_zone" else ahead)[name] = own
    return with_effects(machine, {**ahead, **base, **behind}), slots


def _neutral(effect: type[Effect], machine: Machine, number: int) -> Effect:
    """A neutral table; the second unbalance is in the plane of the film, the first plenum is all of them."""
    one: Any = effect()
    if effect.name == "unbalance" and number == 1 and machine.film is not None:
        return replace(one, position=machine.film.position)
    if effect.name == "plenum_volume" and number == 1:
        return replace(one, injector=1.0)
    return one

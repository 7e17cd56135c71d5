"""Every effect of the catalogue in one machine, so that a slider changes a number and nothing is compiled again.

Effects that the machine file does not have stand there at their neutral values, which leave every bit of a trajectory
as it is. The film is whole, not half, because a tilted journal is one of them.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
from rotorsim.errors import DataError
from rotorsim.live.control import Control
from rotorsim.machine import Machine
from rotorsim.machine.effect_tables import spec_of_parameter
from rotorsim.machine.unit_table import dimension

LAST = ("dead_zone", "quantisation", "encoder")
"""Effects that come last in their chain."""
READ_IN = {"m": "um", "s": "ms", "Pa": "kPa", "N*m": "N*m", "N/m": "MN/m"}
"""Where a slider shows another unit than the machine file's largest."""


def equip(machine: Machine) -> Machine:
    """The machine with every effect that can act on it; those it lacks are neutral."""
    missing = [n for n in sorted(REGISTRY) if n not in machine.effects and _acts(REGISTRY[n], machine)]
    ahead: dict[str, Any] = {n: ({},) for n in missing if n not in LAST}
    behind: dict[str, Any] = {n: ({},) for n in LAST if n in missing}
    for name, table in (ahead | behind).items():
        machine = machine.replace(f"effects.{name}", table[0])
    return machine.replace("grid.symmetry", "none") if machine.film is not None else machine


def _acts(effect: type[Effect], machine: Machine) -> bool:
    """Whether an effect has something to act on."""
    if machine.film is None and effect.port in FILM_PORTS:
        return False
    if effect.port in ("injector", "plenum", "actuator") and not machine.injectors:
        return False
    return not effect().problems(machine.model_copy(update={"effects": machine.effects | {effect.name: (effect(),)}}))


def sliders(machine: Machine) -> dict[str, Control]:
    """A control for every number of every effect of an equipped machine, by 'effect.parameter' (its first table)."""
    found = {}
    for name in sorted(machine.effects):
        effect = machine.effects[name][0]
        for f in fields(effect):
            spec = spec_of_parameter(f)
            if f.name == "position" or spec is None or spec.low is None or spec.high is None:
                continue
            high = float(len(machine.injectors)) if f.name == "injector" else spec.high
            neutral = min(max(float(getattr(type(effect)(), f.name)), spec.low), high)
            key, label, doc = f"{name}.{f.name}", f.name.replace("_", " "), f.metadata.get("doc", "")
            found[key] = Control(key, label, *_shown(spec.unit), spec.low, high, neutral, _whole(f.name), doc)
    return found


def _shown(unit: str) -> tuple[str, float]:
    kind = dimension(unit)
    written = READ_IN.get(unit) or (kind.people[-1] if kind.people else "")
    return written, float(kind.factors[written]) if written else 1.0


def _whole(parameter: str) -> bool:
    return parameter in ("injector", "order", "counts", "window", "surface") or parameter.endswith("_lobes")


def with_value(machine: Machine, key: str, value: float) -> Effect:
    """The effect of an equipped machine with a parameter [SI] changed; raises DataError where it does not fit."""
    name, _, parameter = key.partition(".")
    effect: Any = replace(machine.effects[name][0], **{parameter: value})
    changed = machine.model_copy(update={"effects": machine.effects | {name: (effect, *machine.effects[name][1:])}})
    for other, tables in changed.effects.items():
        for one in tables:
            for where, sentence in one.problems(changed).items():
                raise DataError(f"{other}{'.' if where else ''}{where}: {sentence}")
    return effect

"""Machine with every effect of the catalogue, so that sliders change parameters without recompiling.

Effects that the machine file does not have stand there at their neutral values, which leave every bit of a trajectory
as it is. The film is whole, not half, because a tilted journal is one of them.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import fields, replace
from typing import Any

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.unit_table import dimension
from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
from rotorsim.live.page.control import Control
from rotorsim.machine import Machine
from rotorsim.machine.effect_tables import spec_of_parameter

READ_IN = {"m": "um", "s": "ms", "Pa": "kPa", "N*m": "N*m", "N/m": "MN/m"}
"""Where a slider shows another unit than the machine file's largest."""


def equip(machine: Machine) -> Machine:
    """Machine with every effect that can act on it; those missing in the file are neutral."""
    missing = [n for n in sorted(REGISTRY) if n not in machine.effects]
    for name in sorted(missing, key=lambda n: REGISTRY[n].ends_chain):
        if _acts(REGISTRY[name], machine):
            with suppress(MachineFileError):
                machine = machine.replace(f"effects.{name}", {})
    return machine.replace("grid.symmetry", "none") if machine.film is not None else machine


def _acts(effect: type[Effect], machine: Machine) -> bool:
    """Whether an effect has something to act on, as far as the checks of a machine file leave that open."""
    if machine.film is None and effect.port in FILM_PORTS:
        return False
    return bool(machine.injectors) or effect.port not in ("injector", "plenum", "supply", "actuator")


def sliders(machine: Machine) -> dict[str, Control]:
    """Controls of all effect parameters of an equipped machine, by 'effect.parameter' (first table)."""
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
    """Effect of an equipped machine with a parameter [SI] changed; raises DataError if it does not fit."""
    name, _, parameter = key.partition(".")
    effect: Any = replace(machine.effects[name][0], **{parameter: value})
    changed = machine.model_copy(update={"effects": machine.effects | {name: (effect, *machine.effects[name][1:])}})
    for other, tables in changed.effects.items():
        for one in tables:
            for where, sentence in one.problems(changed).items():
                raise DataError(f"{other}{'.' if where else ''}{where}: {sentence}")
    return effect

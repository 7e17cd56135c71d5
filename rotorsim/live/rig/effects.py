"""Machine with every effect of the catalogue, so that sliders change parameters without recompiling.

Effects that the machine file does not have stand there at their neutral values, which leave every bit of a trajectory
as it is. The film is whole, not half, because a tilted journal is one of them.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.quantity import quantities
from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
from rotorsim.effects.base import WHERE
from rotorsim.live.page.control import Control, control_of
from rotorsim.machine import Machine

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
        for parameter, quantity in quantities(effect).items():
            if parameter in WHERE or quantity.low is None or quantity.high is None:
                continue
            if parameter == "injector":
                quantity = replace(quantity, high=float(len(machine.injectors)))
            neutral, key = float(getattr(type(effect)(), parameter)), f"{name}.{parameter}"
            found[key] = control_of(key, quantity, neutral, READ_IN.get(quantity.unit, ""))
    return found


def with_value(machine: Machine, key: str, value: float) -> Machine:
    """An equipped machine with a parameter [SI] of an effect's first table changed.

    Raises DataError with one sentence that names the slider, if the value does not fit.
    """
    name, _, parameter = key.partition(".")
    try:
        return machine.with_({f"effects.{name}.0.{parameter}": value})
    except MachineFileError as error:
        path, colon, sentence = error.problems[0].partition(": ")
        raise DataError(f"{path.removeprefix('effects.').replace('.0', '', 1)}{colon}{sentence}") from error

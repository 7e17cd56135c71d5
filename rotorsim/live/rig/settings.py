"""Settings of a live rig: numbers within their limits, positions of switches, effects with a slider for each parameter.

A parameter is changed while the plant runs: it is written into the parameter record with all that follows from it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, replace
from math import prod
from typing import Any

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.quantity import quantities
from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
from rotorsim.effects.base import WHERE
from rotorsim.live.rig.controls import BEARING, START, Control, control_of, operating, switches
from rotorsim.machine import Machine
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.compose import Call
from rotorsim.plant.kernels.modal_rotor import build_support

READ_IN = {"m": "um", "s": "ms", "Pa": "kPa", "N*m": "N*m", "N/m": "MN/m"}
"""Units of sliders that differ from the largest one of machine files."""


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


class RigSettings:
    """Values by key: operating numbers, 'effect.parameter', switches; `revision` counts changes."""

    def __init__(self, machine: Machine, laws: tuple[str, ...]) -> None:
        self.operating = operating(machine)
        self.sliders = sliders(machine)
        self.switches = switches(machine) | {"controller": laws}
        self.numbers = {key: control.neutral for key, control in self.operating.items()}
        self.numbers |= {key: _present(machine, key) for key in self.sliders}
        self.file = {key: self.numbers[key] for key in self.sliders}
        self.positions = START | {key: self.switches[key][0] for key in (BEARING,) if key in self.switches}
        self.revision = 0

    def control(self, key: str) -> Control:
        """The control of a number; raises DataError."""
        found = self.operating.get(key) or self.sliders.get(key)
        if found is None:
            raise DataError(f"{str(key)[:60]!r}: is not a setting of this rig")
        return found

    def number(self, key: str, value: Any) -> tuple[float, str]:
        """The value that a number can take, and the message if it is not the one asked for; raises DataError."""
        return self.control(key).clamp(value)

    def keep(self, key: str, value: float | str) -> None:
        """Write down a value that has been checked."""
        if isinstance(value, str):
            self.positions[key] = value
        else:
            self.numbers[key] = value
        self.revision += 1

    def position(self, key: str, value: Any) -> str:
        """A switch's position; raises DataError."""
        if key not in self.switches or value not in self.switches[key]:
            known = ", ".join(self.switches.get(key, ())) or "none: there is no such switch"
            raise DataError(f"{str(key)[:40]}: {str(value)[:40]!r} is none of its positions; they are {known}")
        return str(value)

    def everything(self) -> dict[str, float | str]:
        """Numbers in SI and positions of switches, by key."""
        return {**self.numbers, **self.positions}


def _present(machine: Machine, key: str) -> float:
    name, _, parameter = key.partition(".")
    effect = machine.effects[name][0]
    assert parameter in {f.name for f in fields(effect)}
    return float(getattr(effect, parameter))


def write_effect(a: Assembly, record: str, effect: Effect, parameter: str) -> None:
    """Write an effect's parameter and its derived numbers into the parameter record."""
    row = a.record[record]
    for name, value in ({parameter: getattr(effect, parameter)} | effect.derived(a.machine)).items():
        row[name] = value


def update_derived(a: Assembly, w: Any) -> None:
    """Recompute the numbers derived from parameters: supports, plena, rotor matrix."""
    for call in a.calls:
        if call.effect.port == "support":
            dof = a.rotor.n_machine + 2 * call.order
            _pure(build_support)(w, a.rotor, call.film or 0, dof, *_pure(_kernel(call))(_row(a, call)))
    for f, film in enumerate(a.films):
        plena = [c for c in a.calls if c.effect.port == "plenum" and c.film in (None, f)]
        capacity = a.film_part(w, f)[a.film.capacity :]
        for k in range(len(film.injectors)):
            factor = prod(_pure(_kernel(c))(k, _row(a, c)) for c in plena)
            capacity[k] = a.P.capacity[f * a.film.n_inj + k] * factor
    w[a.rotor.matrix_step] = 0.0


def _row(a: Assembly, call: Call) -> Any:
    return getattr(a.P, call.record)


def _kernel(call: Call) -> Callable[..., Any]:
    return type(call.effect).kernel


def _pure(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The Python of a kernel: once in a while it is quicker than compiling."""
    return getattr(kernel, "py_func", kernel)

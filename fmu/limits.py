"""Limits of an exported unit: of its inputs from the machine, of an effect's parameters from the effect's own checks.

An input is refused beyond the limits at which a run in Python is refused or ends, and warned of once beyond the range
in which the machine's model was checked. Bounds of parameters come from the parameter; `Effect.problems` narrows them
(an injector that does not exist, heat that closes the gap); a parameter that would change what was fixed at export (the
symmetry of the film's grid, derived numbers) is locked to its value.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotorsim.base.constants import TO_RPM
from rotorsim.base.quantity import UNLIMITED, quantities
from rotorsim.effects import Effect
from rotorsim.machine.running_limits import speed_limit
from rotorsim.machine.schema import Machine
from rotorsim.plant.validity import known_speed

HALVINGS = 60
MOST_WHOLE = 4096
SLACK = 1.001
"""Factor on the ends of the checked range within which there is no warning, as in `Checked.holds`."""


def input_limits(machine: Machine, name: str) -> dict[str, Any]:
    """Limits of an input, as fields of a `Variable`: refused beyond `low` and `high`, warned of beyond `checked`."""
    if name == "shaft.speed_ref":
        return _speed_limits(machine)
    if name == "injection.pressure":
        return _pressure_limits(machine)
    if name.startswith("piezo.ref") and machine.actuators is not None:
        limit = machine.actuators.reference_limit
        return {"low": -limit, "high": limit, "why": "the actuators take actuators.reference_limit"}
    return {}


def _speed_limits(machine: Machine) -> dict[str, Any]:
    limit, why = speed_limit(machine)
    found: dict[str, Any] = {"low": -limit, "high": limit, "why": why}
    known = known_speed(machine)
    if known is not None:
        end, reason = known
        text = f"is beyond {end:.6g} rad/s ({end * TO_RPM:.6g} rpm), {reason}; this input is in rad/s"
        found |= {"checked": (-SLACK * end, SLACK * end), "beyond": text}
    return found


def _pressure_limits(machine: Machine) -> dict[str, Any]:
    found: dict[str, Any] = {"low": 1.0 - machine.gas.ambient_pressure, "why": "less is a vacuum"}
    checked = machine.checked
    if checked is not None:
        high = UNLIMITED if checked.highest_pressure is None else SLACK * checked.highest_pressure
        text = f"is outside the checked pressures ({checked.pressures}, {checked.against}); this input is in Pa, gauge"
        found |= {"checked": (checked.lowest_pressure / SLACK, high), "beyond": text}
    return found


def limits(machine: Machine, effect: Effect, name: str, half: bool) -> tuple[float, float]:
    """Limits of a parameter; `half`: the film is computed on one half."""
    quantity, value = quantities(effect)[name], float(getattr(effect, name))
    low, high = quantity.bounds
    if _locked(machine, effect, name, _another(value, low, high), half):
        return value, value
    whole = bool(quantity.multiple)
    return _reach(machine, effect, name, value, low, whole), _reach(machine, effect, name, value, high, whole)


def _with(effect: Effect, name: str, value: float) -> Any:
    return replace(effect, **{name: value})


def _another(value: float, low: float, high: float) -> float:
    """A permitted value other than the present one."""
    return min(value + 1e-3 * (high - value), value + 1.0) if high > value else value - min(1e-3 * (value - low), 1.0)


def _locked(machine: Machine, effect: Effect, name: str, other: float, half: bool) -> bool:
    changed = _with(effect, name, other)
    if half and changed.symmetric != effect.symmetric:
        return True
    return bool(changed.derived(machine) != effect.derived(machine))


def _refused(machine: Machine, effect: Effect, name: str, value: float) -> bool:
    return name in _with(effect, name, value).problems(machine)


def _reach(machine: Machine, effect: Effect, name: str, good: float, bound: float, whole: bool) -> float:
    """The bound, or the last value towards it that the effect takes."""
    if abs(bound) >= UNLIMITED or not _refused(machine, effect, name, bound):
        return bound
    if whole:
        step = 1.0 if bound > good else -1.0
        for _ in range(MOST_WHOLE):
            if abs(good + step - bound) > abs(good - bound) or _refused(machine, effect, name, good + step):
                break
            good += step
        return good
    bad = bound
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        good, bad = (good, middle) if _refused(machine, effect, name, middle) else (middle, bad)
    return good

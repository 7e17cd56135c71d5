"""Limits of an effect's parameters in an exported unit, from the effect's own validity checks.

Bounds come from the parameter; `Effect.problems` narrows them (an injector that does not exist, heat that closes the
gap); a parameter that would change what was fixed at export (the symmetry of the film's grid, derived numbers) is
locked to its value.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotorsim.base.quantity import UNLIMITED, quantities
from rotorsim.effects import Effect
from rotorsim.machine.schema import Machine

HALVINGS = 60
MOST_WHOLE = 4096


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

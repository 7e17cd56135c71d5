"""Settings of a live rig: numbers clamped to their limits, switches to their positions."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.live.page.control import Control
from rotorsim.live.rig.effects import sliders
from rotorsim.live.rig.operating import BEARING, START, operating, switches
from rotorsim.machine import Machine


class Settings:
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
        """All values, in SI."""
        return {**self.numbers, **self.positions}


def _present(machine: Machine, key: str) -> float:
    name, _, parameter = key.partition(".")
    effect = machine.effects[name][0]
    assert parameter in {f.name for f in fields(effect)}
    return float(getattr(effect, parameter))

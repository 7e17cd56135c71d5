"""Controls of the live rig: numbers with limits and steps, the operating ones, and the switches."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rotorsim.base.constants import RPM
from rotorsim.base.errors import DataError
from rotorsim.base.quantity import Quantity
from rotorsim.base.units import dimension
from rotorsim.machine import Machine

HUGE = 1e300


@dataclass(frozen=True)
class Control:
    """Numeric control in SI with limits; displayed as value / `scale` in the unit `shown`."""

    key: str
    label: str
    shown: str
    scale: float
    low: float
    high: float
    neutral: float
    whole: bool = False
    doc: str = ""
    power: int = 3
    """Wide ranges are spread over a slider by this power, so that small values have room."""

    def clamp(self, value: Any) -> tuple[float, str]:
        """The nearest value [SI] within the limits, and a sentence if that is another one; raises DataError."""
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < HUGE:
            raise DataError(f"{self.key}: {str(value)[:40]!r} is not a number; give one from {self.limits}")
        inside = min(max(float(value), self.low), self.high)
        if self.whole:
            inside = float(round(inside))
        if abs(inside - value) <= 1e-9 * max(abs(self.low), abs(self.high)):
            return inside, ""
        if self.low <= value <= self.high:
            return inside, f"{self.label}: {self.read(value)} is not whole, set to {self.read(inside)}"
        return inside, f"{self.label}: {self.read(value)} is beyond {self.limits}, set to {self.read(inside)}"

    def read(self, value: float) -> str:
        """A value as text in its display unit."""
        return f"{value / self.scale:.6g} {self.shown}".strip()

    @property
    def limits(self) -> str:
        """Both limits as text in their display unit."""
        return f"{self.read(self.low)} to {self.read(self.high)}"

    def place(self, value: float) -> float:
        """Position of a slider from -1 (or 0) to 1 for a value; its zero is the neutral value."""
        away = value - self.neutral
        reach = self.high - self.neutral if away >= 0 else self.neutral - self.low
        return math.copysign((abs(away) / reach) ** (1 / self.power), away) if reach > 0 else 0.0

    def value(self, place: float) -> float:
        """The value [SI] for a slider's place: three digits, for reading."""
        reach = self.high - self.neutral if place >= 0 else self.neutral - self.low
        away = math.copysign(abs(place) ** self.power * reach, place)
        return float(f"{(self.neutral + away) / self.scale:.3g}") * self.scale


def control_of(key: str, quantity: Quantity, neutral: float = 0.0, shown: str = "", power: int = 3) -> Control:
    """Control of a quantity with both limits, displayed in the unit `shown`, by default people's largest."""
    kind, (low, high) = dimension(quantity.unit), quantity.bounds
    unit = shown or (kind.people[-1] if kind.people else "")
    scale = float(kind.factors[unit]) if unit else 1.0
    label = key.rpartition(".")[2].replace("_", " ")
    inside = min(max(neutral, low), high)
    return Control(key, label, unit, scale, low, high, inside, bool(quantity.multiple), quantity.doc, power)


OFF, P_LAW, PAUSE = "off", "P", "pause"
SWITCHES: dict[str, tuple[str, ...]] = {
    "drive": ("speed", "torque", "coast"),
    "sense": ("forward", "backward"),
    "noise": ("on", "off"),
    "pace": ("pause", "0.1x", "1x", "fastest"),
}
"""Positions of every switch but `controller`, whose positions are off, P and the laws that were given."""
BEARING = "bearing"
"""Switch of a machine with several films: whose journal and pressure are drawn."""
START = {"drive": "speed", "sense": "forward", "noise": "on", "pace": "1x", "controller": OFF}
HIGHEST = 30_000 * RPM
"""Highest speed [rad/s] that can be set on a machine whose file states none; a drive takes 3 s to it."""
TORQUE = Quantity("N*m", "Drive torque, in the sense that is set.", low=0.0, high=5.0)
IMPULSE = Quantity("N*s", "Of a hammer's hit on the disc, five samples long.", low=0.0, high=0.2)
PRESSURE = Quantity("Pa", "Gauge pressure.", low=0.0, high=1e6)
PACES = {"pause": 0.0, "0.1x": 0.1, "1x": 1.0, "fastest": float("inf")}


def switches(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Positions of the switches of a machine, but `controller`."""
    return SWITCHES | ({BEARING: machine.film_names} if len(machine.films) > 1 else {})


def driven_axes(machine: Machine) -> str:
    """Axes whose reference drives a pin."""
    return "".join(axis for axis in "xy" if any(i.reference.endswith(axis) for i in machine.injectors))


def operating(machine: Machine) -> dict[str, Control]:
    """Operating controls by key."""
    limit = 5.0 if machine.actuators is None else machine.actuators.reference_limit
    highest = machine.drive.highest_speed or HIGHEST
    speed = Quantity("rad/s", "Speed the drive holds.", low=0.0, high=highest)
    acceleration = Quantity("rad/s^2", "Limit of the drive.", low=RPM, high=highest / 3)
    found = [
        control_of("speed", speed, power=1),
        control_of("acceleration", acceleration, 500 * RPM * highest / HIGHEST),
        control_of("torque", TORQUE, power=1),
        control_of("impulse", IMPULSE, 0.01 * min(machine.mass, 1.0)),
    ]
    if machine.injectors or any(film.orifices for film in machine.films):
        found.append(control_of("pressure", PRESSURE, 0.3e6, "MPa", power=1))
    reference = Quantity("V", "Constant.", low=-limit, high=limit)
    found += [control_of(f"reference_{axis}", reference, power=1) for axis in driven_axes(machine)]
    return {control.key: control for control in found}

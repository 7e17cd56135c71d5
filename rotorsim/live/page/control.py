"""Numeric control of a live rig: limits, neutral value, displayed unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.quantity import Quantity
from rotorsim.base.units import dimension

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
        """Where a slider from -1 (or 0) to 1 stands for a value; its zero is the neutral value."""
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

"""Result of a benchmark: measured figure, unit and bound."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """A figure with its unit and bound; `met` states whether it is at or below the bound."""

    name: str
    value: float
    unit: str
    bound: float | None = None

    @property
    def met(self) -> bool | None:
        """None when nothing is demanded."""
        return None if self.bound is None else bool(self.value <= self.bound)

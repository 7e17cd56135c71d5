"""Result of a benchmark: measured figure, unit and bound."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """A figure with its unit and bound; `met` states whether it is at or below the bound.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.bench.Figure("one diagnosis, median", 95.0, "s", bound=180.0).met
    True
    """

    name: str
    value: float
    unit: str
    bound: float | None = None

    @property
    def met(self) -> bool | None:
        """None when nothing is demanded."""
        return None if self.bound is None else bool(self.value <= self.bound)

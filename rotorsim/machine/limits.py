"""Machine-file parts: limits at which a run ends, and the range in which the model was compared with measurements."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field

from rotorsim.base.constants import MPA
from rotorsim.base.units import show
from rotorsim.machine.part import Part, quantity

HOT = 423.15
"""Temperature [K] from which on quenched bearing steel loses hardness and piezo stacks end, 150 degC."""


class Limits(Part):
    """Limits at which a run ends.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Limits(tip_speed="200 m/s").tip_speed
    200.0
    """

    tip_speed: float = quantity(
        "m/s", "Speed of the rim of the rotor's widest part; a solid disc of steel bears 810 MPa at 500 m/s.",
        500.0, above=0, high=2000)  # fmt: skip
    temperature: float | None = quantity(
        "K", "Temperature of gas, journal or sleeve; 150 degC when not given, none where the gas is fed warmer.",
        None, above=0, high=5000, example=HOT)  # fmt: skip
    choked_feeds: float | None = quantity(
        "1", "Share of a film's injectors and orifices that may be choked where they enter it; any when not given.",
        None, low=0, high=1, example=0.5)  # fmt: skip


class Checked(Part):
    """Operating points at which the machine's model was compared with measurements; no run depends on it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_machine("dtu_gas_bearing").checked.highest_pressure
    700000.0
    """

    highest_speed: float = quantity("rad/s", "Highest speed.", low=0, high=1e6, example=628.3185307179587)
    lowest_pressure: float = quantity("Pa", "Lowest gauge pressure of the supply.", 0.0, low=0, high=1e8, example=3e5)
    highest_pressure: float | None = quantity(
        "Pa", "Highest gauge pressure of the supply; any when not given.", None, low=0, high=1e8, example=7e5
    )
    against: str = Field("measurements", description="What it was compared with.")

    def problems(self) -> Iterator[tuple[str, str]]:
        """The pressures are a range."""
        if self.highest_pressure is not None and self.highest_pressure < self.lowest_pressure:
            low, high = show(self.lowest_pressure, "Pa"), show(self.highest_pressure, "Pa")
            yield "lowest_pressure", f"'{low}' is above highest_pressure '{high}'; make it smaller"

    def holds(self, speed: float, pressure: float) -> bool:
        """Whether an operating point [rad/s], [Pa] lies within, to 0.1 %."""
        highest = np.inf if self.highest_pressure is None else 1.001 * self.highest_pressure
        return abs(speed) <= 1.001 * self.highest_speed and 0.999 * self.lowest_pressure <= pressure <= highest

    @property
    def pressures(self) -> str:
        """The pressures as a text."""
        if self.highest_pressure is None:
            return f"from {self.lowest_pressure / MPA:g} MPa on"
        return f"{self.lowest_pressure / MPA:g} to {self.highest_pressure / MPA:g} MPa"

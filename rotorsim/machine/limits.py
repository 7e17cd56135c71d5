r"""Limits at which a run of a machine ends, and the range in which its model was compared with measurements.

The rim of the rotor's widest part, of radius R, moves at v = Omega R. A solid disc bears there, at its centre,

.. math:: \sigma = \frac{3 + \nu}{8}\,\rho v^2

Cites: timoshenko_1970.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from rotorsim.base.constants import MPA, TO_RPM
from rotorsim.base.units import show
from rotorsim.effects.film.gas_heating import NOMINAL
from rotorsim.machine.part import Part, quantity
from rotorsim.machine.rim_speed import largest_radius

if TYPE_CHECKING:
    from rotorsim.machine.rotor import Material
    from rotorsim.machine.schema import Machine

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


def spin_stress(material: Material, rim: float) -> float:
    """Stress [Pa] at the centre of a solid disc whose rim moves at `rim` [m/s]."""
    return (3 + material.poisson_ratio) / 8 * material.density * rim**2


def hottest(machine: Machine) -> float:
    """Limit of the temperature [K]; infinite where none is given and the gas is fed warmer than `HOT`."""
    given = limits_of(machine).temperature
    if given is not None:
        return given
    return HOT if machine.gas.temperature < HOT else np.inf


def limits_of(machine: Machine) -> Limits:
    """The limits of a machine, the default ones where its file gives none."""
    return machine.limits or Limits()


def first_passed(machine: Machine, speed: np.ndarray, rises: np.ndarray | None = None) -> tuple[int, str] | None:
    """First sample beyond a limit, and the sentence; None if there is none.

    Parameters
    ----------
    machine : Machine
    speed : array (n,)
        Speeds [rad/s].
    rises : array (n, k), optional
        Temperatures [K] above that of the gas, of any bodies.
    """
    at, radius = largest_radius(machine)
    limit, rims = limits_of(machine).tip_speed, np.abs(speed) * radius
    warm, highest = _temperatures(machine, speed, rises), hottest(machine)
    beyond = np.flatnonzero((rims > limit * (1 + 1e-12)) | (warm > highest))
    if not beyond.size:
        return None
    first = int(beyond[0])
    if warm[first] > highest:
        what = f"{warm[first] - 273.15:.4g} degC in a film, above limits.temperature {highest - 273.15:.4g} degC"
    else:
        stress = spin_stress(machine.shaft.material, float(rims[first]))
        what = (
            f"the rim of {at}, radius {1e3 * radius:.3g} mm, moves at {rims[first]:.5g} m/s, above limits.tip_speed "
            f"{limit:g} m/s (a solid disc of the shaft's material bears {stress / MPA:.3g} MPa there)"
        )
    return first, at_speed(float(speed[first]), what)


def at_speed(speed: float, what: str) -> str:
    """Why a run ended at a speed [rad/s]."""
    return f"ended at {speed * TO_RPM:.0f} rpm: {what}"


def _temperatures(machine: Machine, speed: np.ndarray, rises: np.ndarray | None) -> np.ndarray:
    """Highest temperature (n,) [K] in the films: that of the gas, and what friction adds where an effect states it."""
    warm = np.full(len(speed), machine.gas.temperature)
    for effect in machine.effects.get("gas_heating", ()):
        warm = warm + effect.rise + effect.heating * (speed / NOMINAL) ** 2  # type: ignore[attr-defined]
    if rises is not None and rises.size:
        warm = warm + np.maximum(rises.max(axis=1), 0.0)
    return warm

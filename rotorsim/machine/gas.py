r"""Machine-file part of the gas in films and injectors, with the properties of common gases.

.. math:: \mu = \mu_0 \left(\frac{T}{T_0}\right)^{3/2} \frac{T_0 + S}{T + S}, \qquad T_0 = 273.15\ \mathrm{K}

Viscosity hardly depends on pressure. Within 3 % of measurements between 200 K and 1000 K at moderate pressures. Source:
Sutherland (1893); mu_0 and S from White (2011), table 1-2 and section 1.9 (air as in the standard atmosphere); helium
fitted to White's power law; gas constants and ratios of heat capacities at 300 K from White (2011), appendix A.

Cites: sutherland_1893, white_2011.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from pydantic import Field

from rotorsim.base.errors import DataError
from rotorsim.base.units import show
from rotorsim.effects.film.gas_heating import sutherland
from rotorsim.machine.part import Part, quantity

FREEZING = 273.15
"""Temperature [K] of the viscosities in `GASES`."""
MISFIT = 0.05
"""Relative difference from a gas's property from which a stated one is questioned."""


class Properties(NamedTuple):
    """Viscosity [Pa s] at `FREEZING`, Sutherland's constant [K], gas constant [J/(kg K)], ratio of heat capacities."""

    viscosity: float
    sutherland: float
    gas_constant: float
    heat_capacity_ratio: float


GASES = {
    "air": Properties(1.716e-5, 110.4, 287.05, 1.4),
    "nitrogen": Properties(1.663e-5, 107.0, 296.80, 1.4),
    "oxygen": Properties(1.919e-5, 139.0, 259.84, 1.395),
    "argon": Properties(2.125e-5, 144.0, 208.13, 1.667),
    "helium": Properties(1.87e-5, 79.4, 2077.1, 1.667),
    "hydrogen": Properties(8.411e-6, 97.0, 4124.2, 1.405),
    "carbon_dioxide": Properties(1.370e-5, 222.0, 188.92, 1.289),
}


class Gas(Part):
    """The gas in film and injectors: ideal, isothermal in the film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> round(1e6 * rs.machine.Gas(name="helium", temperature="40 degC").mu, 1)
    20.6
    """

    name: Literal["air", "nitrogen", "oxygen", "argon", "helium", "hydrogen", "carbon_dioxide"] = Field(
        default="air", description="Which gas it is; its properties hold where they are not given."
    )
    viscosity: float | None = quantity(
        "Pa*s", "Dynamic viscosity; that of the gas at its temperature when not given.", None, above=0, high=1,
        example=1.81e-5)  # fmt: skip
    ambient_pressure: float = quantity("Pa", "Absolute ambient pressure.", 101325.0, above=0, high=1e8)
    temperature: float = quantity("K", "Absolute temperature.", 293.15, above=0, high=5000)
    gas_constant: float | None = quantity(
        "J/(kg*K)", "Specific gas constant; that of the gas when not given.", None, above=0, high=1e5, example=287.05
    )
    heat_capacity_ratio: float | None = quantity(
        "1", "Ratio of the heat capacities; that of the gas when not given.", None, above=1, high=2, example=1.4
    )

    @property
    def law(self) -> float:
        """Viscosity [Pa s] of the named gas at the temperature."""
        known = GASES[self.name]
        factor = getattr(sutherland, "py_func", sutherland)
        return float(known.viscosity * factor(self.temperature / FREEZING - 1, known.sutherland / FREEZING))

    @property
    def mu(self) -> float:
        """Viscosity [Pa s]."""
        return self.law if self.viscosity is None else self.viscosity

    @property
    def R(self) -> float:
        """Specific gas constant [J/(kg K)]."""
        return GASES[self.name].gas_constant if self.gas_constant is None else self.gas_constant

    @property
    def kappa(self) -> float:
        """Ratio of the heat capacities [1]."""
        return GASES[self.name].heat_capacity_ratio if self.heat_capacity_ratio is None else self.heat_capacity_ratio

    @property
    def S(self) -> float:
        """Sutherland's constant [K]."""
        return GASES[self.name].sutherland

    def absolute(self, pressure: float) -> float:
        """Absolute pressure [Pa] for a gauge pressure [Pa]; raises DataError for one below vacuum."""
        if not pressure > -self.ambient_pressure:
            raise DataError(
                f"pressure: {pressure:g} Pa gauge is below vacuum; give more than {-self.ambient_pressure:g} Pa"
            )
        return pressure + self.ambient_pressure

    def doubts(self) -> Iterator[tuple[str, str]]:
        """Given properties that are not those of the named gas at its temperature: fields and sentences."""
        at = f"{self.name.replace('_', ' ')} at {show(self.temperature, 'K')}"
        known = GASES[self.name]
        for field, unit, own, way in (
            ("viscosity", "Pa*s", self.law, "remove it and it follows the temperature"),
            ("gas_constant", "J/(kg*K)", known.gas_constant, "give the gas by its name"),
            ("heat_capacity_ratio", "1", known.heat_capacity_ratio, "give the gas by its name"),
        ):
            given = getattr(self, field)
            if given is not None and abs(given / own - 1) > MISFIT:
                right = show(float(f"{own:.4g}"), unit)
                yield field, f"'{show(given, unit)}' is not that of {at}, '{right}'; {way}"

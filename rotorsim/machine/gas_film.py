r"""Machine-file parts of the gas bearings: the gas, films with their orifices, injectors with pins and their piezos.

The viscosity of a common gas follows its temperature T by

.. math:: \mu = \mu_0 \left(\frac{T}{T_0}\right)^{3/2} \frac{T_0 + S}{T + S}, \qquad T_0 = 273.15\ \mathrm{K}

Viscosity hardly depends on pressure. Within 3 % of measurements between 200 K and 1000 K at moderate pressures. Source:
Sutherland (1893); mu_0 and S from White (2011), table 1-2 and section 1.9 (air as in the standard atmosphere); helium
fitted to White's power law; gas constants and ratios of heat capacities at 300 K from White (2011), appendix A.

Cites: sutherland_1893, white_2011.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, tau
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from reynolds import sleeve as forms
from reynolds.injector import Injector as Nozzle
from rotorsim.base.errors import DataError
from rotorsim.base.units import show
from rotorsim.effects.film.gas_heating import sutherland
from rotorsim.machine.bearings import BearingPart, Support
from rotorsim.machine.part import Part, part_of, quantity

if TYPE_CHECKING:
    from reynolds.sleeve import (
        Foil as Foil,
        Grooves as Grooves,
        Lobes as Lobes,
        RingFeed as RingFeed,
        SpiralGrooves as SpiralGrooves,
        Steps as Steps,
    )
else:  # the same classes, which can also be read from a machine file
    Foil, Grooves, Lobes, Steps, RingFeed, SpiralGrooves = (
        part_of(form, __name__)
        for form in (forms.Foil, forms.Grooves, forms.Lobes, forms.Steps, forms.RingFeed, forms.SpiralGrooves)
    )


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


class Orifices(Part):
    """A row of orifices round the bearing that are always open.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.machine.Orifices(count=8, diameter="0.2 mm", offset="10 mm").angles)
    8
    """

    count: float = quantity("1", "Number of orifices in the row, evenly spaced.", low=1, high=64, multiple=1, example=8)
    diameter: float = quantity(
        "m", "Diameter of an orifice; a vent to the ambient at a supply pressure of 0.", above=0, high=0.01,
        example=0.2e-3)  # fmt: skip
    discharge: float = quantity("1", "Discharge coefficient of an orifice.", 0.8, above=0, high=2)
    offset: float = quantity("m", "Axial distance from the film's centre.", 0.0, low=-10, high=10, example=5e-3)
    first_angle: float = quantity("rad", "Where the first one stands, from x towards y.", 0.0, low=-7, high=7)
    pocket_diameter: float | None = quantity(
        "m", "Diameter of the pocket behind which the film begins; without one the orifice ends in the film.",
        None, above=0, high=0.1, example=2e-3)  # fmt: skip
    curtain_discharge: float = quantity("1", "Discharge coefficient from its rim into the film.", 0.8, above=0, high=2)
    volume: float | None = quantity(
        "m^3", "Volume between orifice and film; that of a hole as long as it is wide when not given.",
        None, above=0, high=1e-3, example=1e-11)  # fmt: skip
    loss_factor: float | None = quantity(
        "kg/(s*Pa^2)", "Mass flow per difference of squared pressures, of a laminar restrictor in place of an orifice.",
        None, above=0, high=1e-12, example=1e-17)  # fmt: skip

    def problems(self) -> Iterator[tuple[str, str]]:
        """A pocket is wider than its orifice."""
        if self.pocket_diameter is not None and self.pocket_diameter < self.diameter:
            least = show(self.diameter, "m")
            yield "pocket_diameter", f"'{show(self.pocket_diameter, 'm')}' is below the orifice's '{least}'; widen it"

    @property
    def mouth(self) -> float:
        """Diameter [m] of the rim through which the gas enters the film."""
        return self.diameter if self.pocket_diameter is None else self.pocket_diameter

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles of all orifices [rad]."""
        return tuple(self.first_angle + tau * k / self.count for k in range(int(self.count)))

    @property
    def nozzles(self) -> tuple[Nozzle, ...]:
        """The orifices as the film takes them."""
        area = pi / 4 * self.diameter**2
        volume = area * self.diameter if self.volume is None else self.volume
        flow: dict[str, Any] = {"open_area": self.discharge * area}
        if self.loss_factor is not None:
            flow = {"law": "loss_factor", "loss_factor": self.loss_factor}
        return tuple(
            Nozzle(
                angle=angle, offset=self.offset, orifice_diameter=self.mouth,
                curtain_discharge=self.curtain_discharge, plenum_volume=volume, **flow,
            )
            for angle in self.angles
        )  # fmt: skip


class GasFilm(BearingPart):
    """A gas-lubricated journal bearing.

    Examples
    --------
    >>> import rotorsim as rs
    >>> size = {"diameter": "40 mm", "length": "40 mm", "clearance": "25 um"}
    >>> rs.machine.GasFilm(kind="gas_film", position="100 mm", **size).clearance
    2.5e-05
    """

    kind: Literal["gas_film"] = Field(description="Always 'gas_film'.")
    name: str | None = Field(None, description="Name by which effects and injectors may give their bearing.")
    position: float = quantity("m", "Coordinate z of the film's centre.", low=-100, high=100, example=0.24)
    diameter: float = quantity("m", "Diameter of the journal.", above=0, high=10, example=0.04)
    length: float = quantity("m", "Axial length of the film.", above=0, high=10, example=0.04)
    clearance: float = quantity("m", "Radial clearance.", above=0, high=1e-3, example=25e-6)
    nominal_stiffness: float = quantity(
        "N/m", "Isotropic spring that stands for the film when the rotor's modes are chosen, nowhere else.",
        4e6, above=0, high=1e12,
    )  # fmt: skip
    orifices: tuple[Orifices, ...] = Field((), description="Rows of orifices that feed the film without pins.")
    lobes: Lobes | None = Field(None, description="Arcs of a sleeve that is not round.")
    steps: tuple[Steps, ...] = Field((), description="Rows of pockets in the sleeve.")
    grooves: Grooves | None = Field(None, description="Narrow slanted grooves on journal or sleeve.")
    foil: Foil | None = Field(None, description="Bump foil on the sleeve.")
    support: Support | None = Field(None, description="The housing of the sleeve, where it moves.")

    @property
    def spring(self) -> float:
        """The nominal stiffness [N/m]."""
        return self.nominal_stiffness

    @property
    def ends(self) -> tuple[float, float]:
        """Coordinates z [m] of its ends."""
        return self.position - 0.5 * self.length, self.position + 0.5 * self.length

    @property
    def sleeve(self) -> forms.Sleeve:
        """Form of the sleeve."""
        return forms.Sleeve(self.lobes, self.steps, self.grooves, self.foil)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Orifices stand in a sleeve that can be fed, and its forms fit it and each other."""
        form = self.sleeve
        yield from form.unfed(max(abs(row.offset) + row.mouth / 2 for row in self.orifices)) if self.orifices else ()
        for k, row in enumerate(self.orifices):
            if self.foil is not None and row.pocket_diameter is not None:
                pocket = show(row.pocket_diameter, "m")
                yield f"orifices.{k}.pocket_diameter", f"'{pocket}' is cut into a sleeve, not into a foil; remove it"
        yield from form.problems(self.length)


class ThrustBearing(Part):
    """A gas film between a face of the rotor and a plate, which carries along the shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> size = {"inner_diameter": "20 mm", "outer_diameter": "60 mm", "clearance": "20 um"}
    >>> rs.machine.ThrustBearing(position="0 mm", pushes="+z", **size).gap(5e-6)
    2.5e-05
    """

    name: str | None = Field(None, description="Name of the film.")
    position: float = quantity("m", "Coordinate z of the film.", low=-100, high=100, example=0.05)
    pushes: Literal["+z", "-z"] = Field(description="Direction of its force on the rotor.")
    inner_diameter: float = quantity("m", "Inner diameter of the film.", above=0, high=10, example=0.02)
    outer_diameter: float = quantity("m", "Outer diameter of the film.", above=0, high=10, example=0.06)
    clearance: float = quantity(
        "m", "Gap over the ridges, with the rotor where the file has it.", above=0, high=1e-3, example=20e-6
    )
    inner_edge: Literal["open", "closed", "fed"] = Field(
        "open", description="'open' to the ambient, 'closed', or 'fed' with the supply pressure."
    )
    hub_diameter: float | None = quantity(
        "m", "Diameter down to which the pressure of a closed or fed inner edge acts; the inner one when not given.",
        None, low=0, high=10, example=0.01)  # fmt: skip
    grooves: SpiralGrooves | None = Field(None, description="Spiral grooves in one of its faces.")
    feed: RingFeed | None = Field(None, description="Orifices of a fed inner edge; without them all pressure is there.")

    @property
    def sign(self) -> float:
        """1 where it pushes the rotor towards +z, -1 where towards -z."""
        return 1.0 if self.pushes == "+z" else -1.0

    def gap(self, displacement: float) -> float:
        """Gap [m] of a rotor displaced [m] towards +z."""
        return self.clearance + self.sign * displacement

    def problems(self) -> Iterator[tuple[str, str]]:
        """Its edges follow each other, the land leaves grooves, and only a fed edge has orifices."""
        inner, outer = show(self.inner_diameter, "m"), show(self.outer_diameter, "m")
        if self.inner_diameter >= self.outer_diameter:
            yield "inner_diameter", f"'{inner}' is not below outer_diameter '{outer}'; make it smaller"
        elif self.grooves is not None and self.grooves.land >= 0.5 * (self.outer_diameter - self.inner_diameter):
            land = show(self.grooves.land, "m")
            yield "grooves.land", f"'{land}' leaves no grooves between '{inner}' and '{outer}'; make it narrower"
        if self.hub_diameter is not None and self.hub_diameter > self.inner_diameter:
            yield "hub_diameter", f"'{show(self.hub_diameter, 'm')}' is above inner_diameter '{inner}'; make it smaller"
        if self.hub_diameter is not None and self.inner_edge == "open":
            yield "hub_diameter", "goes with an inner_edge that is 'closed' or 'fed'; remove it or write which"
        if self.feed is not None and self.inner_edge != "fed":
            yield "feed", f"does not go with an inner_edge that is '{self.inner_edge}'; write 'fed' or remove it"
        if self.clearance > self.outer_diameter / 20:
            limit = show(self.outer_diameter / 20, "m")
            yield "clearance", f"'{show(self.clearance, 'm')}' is not a thin film; write at most '{limit}'"


class Injection(Part):
    """Common data of all injectors: pin seat, plenum and orifice into the film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_machine("dtu_gas_bearing").injection.seat_gap
    4.02e-05
    """

    bearing: float | None = quantity(
        "1", "Index among the bearings, from 0, of the film that they feed; the first film when not given.",
        None, low=0, high=63, multiple=1, example=1)  # fmt: skip

    law: Literal["orifice", "loss_factor"] = Field(
        description="Flow past the pin: 'orifice' (nozzle, may choke) or 'loss_factor' (laminar)."
    )
    seat_gap: float = quantity(
        "m", "Gap of the pin's seat with the pin fully drawn back.", above=0, high=1e-2, example=40e-6
    )
    minimum_gap: float = quantity(
        "m", "Gap that stays open when the pin is fully pushed in.", low=0, high=1e-2, example=0.5e-6
    )
    pin_diameter: float = quantity("m", "Diameter of the pin's seat.", above=0, high=0.1, example=2e-3)
    pin_discharge: float | None = quantity(
        "1", "Discharge coefficient of the pin's seat; for law 'orifice'.", None, above=0, high=2, example=0.15
    )
    orifice_diameter: float = quantity("m", "Diameter of the orifice into the film.", above=0, high=0.1, example=2e-3)
    curtain_discharge: float = quantity(
        "1", "Discharge coefficient from orifice to film.", above=0, high=2, example=0.9
    )
    plenum_volume: float = quantity("m^3", "Volume between pin and film.", above=0, high=1e-3, example=1e-9)
    polytropic_exponent: float = quantity("1", "Exponent of the plenum's gas; 1 is isothermal.", 1.0, low=1, high=2)
    loss_factor: float | None = quantity(
        "kg/(s*Pa^2)", "Mass flow per difference of squared pressures, fully open; for law 'loss_factor'.",
        None, above=0, high=1e-6, example=3.9e-16)  # fmt: skip
    loss_exponent: float = quantity("1", "Exponent n of loss_factor (gap / seat_gap)^n.", 1.0, low=0, high=4)
    pin_bias: float = quantity("m", "Travel of the pins at zero reference voltage.", low=0, high=1e-2, example=22.5e-6)
    pin_per_volt: float = quantity("m/V", "Travel of a pin per volt of reference.", low=0, high=1e-2, example=4.2e-6)

    def nozzle(self, injector: PinnedInjector) -> Nozzle:
        """An injector as the film takes it."""
        return Nozzle(
            angle=injector.angle, offset=injector.offset, law=self.law, pin=self.pin_bias, seat_gap=self.seat_gap,
            minimum_gap=self.minimum_gap, pin_diameter=self.pin_diameter, pin_discharge=self.pin_discharge or 0.0,
            orifice_diameter=self.orifice_diameter, curtain_discharge=self.curtain_discharge,
            plenum_volume=self.plenum_volume, polytropic_exponent=self.polytropic_exponent,
            loss_factor=self.loss_factor or 0.0, loss_exponent=self.loss_exponent,
        )  # fmt: skip

    def problems(self) -> Iterator[tuple[str, str]]:
        """The law has its coefficient, and the seat can close."""
        needs = {"orifice": "pin_discharge", "loss_factor": "loss_factor"}[self.law]
        if getattr(self, needs) is None:
            yield needs, f"missing, but law '{self.law}' needs it; add it or choose the other law"
        if self.minimum_gap >= self.seat_gap:
            least, most = show(self.minimum_gap, "m"), show(self.seat_gap, "m")
            yield "minimum_gap", f"'{least}' is not below seat_gap '{most}'; make it smaller"


class PinnedInjector(Part):
    """One injector.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.PinnedInjector(angle="90 deg", reference="+y").offset
    0.0
    """

    angle: float = quantity("rad", "Where it stands, from x towards y.", low=-7, high=7)
    offset: float = quantity("m", "Axial distance from the film's centre.", 0.0, low=-10, high=10, example=5e-3)
    reference: Literal["+x", "-x", "+y", "-y", "none"] = Field(
        description="Reference voltage that drives its pin, and its sign; '+' pushes the pin in (closes)."
    )
    pd_gain: float | None = quantity(
        "1", "Gain P of its PD law; for actuators.mode 'reference'.", None, above=0, high=1e3, example=0.9
    )
    pd_zero: float | None = quantity(
        "1/s", "Zero of its PD law; for actuators.mode 'reference'.", None, above=0, high=1e6, example=2000.0
    )
    amplifier_lag: float | None = quantity(
        "s", "Time constant of its amplifier; that of all when not given.", None, low=0, high=10, example=0.4e-3
    )
    stack_lag: float | None = quantity(
        "s", "Time constant of its stack; that of all when not given.", None, low=0, high=10, example=0.1e-3
    )

    @property
    def signs(self) -> tuple[float, float]:
        """Signs with which the references along x and y push its pin in, 0 for one that does not drive it."""
        sign = {"+": 1.0, "-": -1.0}.get(self.reference[0], 0.0)
        return sign if self.reference.endswith("x") else 0.0, sign if self.reference.endswith("y") else 0.0


CROSSOVERS = np.geomspace(1.0, 1e6, 2000)
"""Frequencies [rad/s] among which the crossover of a position loop is looked for."""


class Actuators(Part):
    """Common data of the piezo actuators of all pins."""

    mode: Literal["ideal", "voltage", "reference"] = Field(
        description="'ideal' (pins follow at once, effects of the actuators idle), 'voltage' (the reference is the "
        "amplifier's) or 'reference' (PD loop)."
    )
    sensitivity: float = quantity("m/V", "Stroke of a stack per volt, without hysteresis.", 4.5e-6, above=0, high=1e-3)
    sensor_sensitivity: float = quantity(
        "m/V", "Travel per volt of the pins' position sensors.", 4.5e-6, above=0, high=1e-3
    )
    lowest: float = quantity("V", "Lowest voltage of the amplifiers.", 0.0, low=-1e4, high=1e4)
    highest: float = quantity("V", "Highest voltage of the amplifiers.", 10.0, low=-1e4, high=1e4)
    reference_limit: float = quantity(
        "V", "Largest reference that a controller or an experiment may give.", 5.0, above=0, high=1e4
    )
    pd_pole: float = quantity("1/s", "Pole of the PD law.", 101.0, above=0, high=1e6)
    amplifier_lag: float = quantity("s", "Time constant of the amplifiers.", 4.2e-4, low=0, high=10)
    stack_lag: float = quantity("s", "Time constant of the stacks.", 1e-4, low=0, high=10)

    def problems(self) -> Iterator[tuple[str, str]]:
        """The amplifiers have a range."""
        if self.lowest >= self.highest:
            low, high = show(self.lowest, "V"), show(self.highest, "V")
            yield "lowest", f"'{low}' is not below highest '{high}'; make it smaller"

    def slowest_sensor(self, injector: PinnedInjector, gain: float = 0.0) -> float:
        """Largest lag [s] of the sensor that the position loop of a pin reads; infinite where it has no loop.

        At the crossover of the loop the lag takes 45 deg, or half of the phase margin if that is less; `gain` is the
        sensor's relative error.
        """
        if self.mode != "reference" or injector.pd_gain is None or injector.pd_zero is None:
            return np.inf
        s = 1j * CROSSOVERS
        L = (1 + gain) * injector.pd_gain * (s + injector.pd_zero) / (s + self.pd_pole)
        L *= self.sensitivity / self.sensor_sensitivity
        for name in ("amplifier_lag", "stack_lag"):
            own = getattr(injector, name)
            L /= 1 + s * (getattr(self, name) if own is None else own)
        above = np.flatnonzero(np.abs(L) >= 1)
        if not above.size:
            return np.inf
        margin = pi + float(np.unwrap(np.angle(L))[above[-1]])
        return float(np.tan(min(pi / 4, max(margin, 0.0) / 2)) / CROSSOVERS[above[-1]])

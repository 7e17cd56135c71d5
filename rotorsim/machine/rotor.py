"""Machine-file parts of the rotor: shaft, discs, drive, the plane that is measured, and probes elsewhere.

A probe stands at `angle` round the shaft, from x (0) towards y. With the unit vector e to it, the displacements x_s(z)
of the shaft and x_h of the housing against the foundation and x_f of the foundation, each (2,) [m],

========================  =============================
relative_displacement     e . (x_s - x_h)
absolute_displacement     e . (x_s + x_f)
housing_velocity          d/dt e . (x_h + x_f)
housing_acceleration      d2/dt2 e . (x_h + x_f)
========================  =============================

times sensitivity and sense. The housing is that of the bearing that the probe names, else of the nearest one, and moves
where that bearing has a `support`; so does the sleeve of the gas bearing on [effects.pedestal]. The foundation moves
with [effects.base_vibration].
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from re import ASCII, fullmatch
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from rotorsim.base.display import quote
from rotorsim.base.units import show
from rotorsim.machine.part import Part, quantity as number

MOST_ELEMENTS = 1000


class ShaftMaterial(Part):
    """An isotropic elastic material.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.ShaftMaterial(density="7850 kg/m^3", youngs_modulus="210 GPa", poisson_ratio=0.3).youngs_modulus
    210000000000.0
    """

    density: float = number("kg/m^3", "Density.", above=0, high=1e5, example=7850.0)
    youngs_modulus: float = number("Pa", "Young's modulus.", above=0, high=1e13, example=210e9)
    poisson_ratio: float = number("1", "Poisson's ratio.", above=-1, high=0.5, example=0.3)


class Section(Part):
    """A cylindrical piece of the shaft; sections follow each other from the left end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Section(length="200 mm", outer_diameter="20 mm").length
    0.2
    """

    length: float = number("m", "Length of the piece.", above=0, high=100, example=0.6)
    outer_diameter: float = number("m", "Outer diameter.", above=0, high=10, example=0.02)
    inner_diameter: float = number("m", "Diameter of the bore; 0 is solid.", 0.0, low=0, high=10, example=0.01)
    axial_force: float | None = number(
        "N", "Axial force in the piece, as of a thrust bearing; a pull is positive and stiffens it.", None,
        low=-1e9, high=1e9, example=500.0)  # fmt: skip

    def problems(self) -> Iterator[tuple[str, str]]:
        """The bore is within."""
        if self.inner_diameter >= self.outer_diameter:
            bore, outer = show(self.inner_diameter, "m"), show(self.outer_diameter, "m")
            yield "inner_diameter", f"'{bore}' is not below outer_diameter '{outer}'; make the bore smaller"


class Shaft(Part):
    """The elastic shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steel = rs.machine.ShaftMaterial(density="7850 kg/m^3", youngs_modulus="210 GPa", poisson_ratio=0.3)
    >>> piece = rs.machine.Section(length="200 mm", outer_diameter="20 mm")
    >>> rs.machine.Shaft(material=steel, sections=[piece, piece]).end
    0.4
    """

    start: float = number("m", "Coordinate z of the left end.", 0.0, low=-100, high=100)
    material: ShaftMaterial = Field(description="What the shaft is made of.")
    sections: tuple[Section, ...] = Field(min_length=1, description="Pieces of the shaft, from left to right.")
    damping_ratio: float = number(
        "1", "Modal damping ratio of the shaft's own modes.", 0.0, low=0, high=0.5, example=0.01
    )
    max_element_length: float = number("m", "Longest finite element.", 0.025, above=0, high=10)

    @property
    def length(self) -> float:
        """Length of all sections [m]."""
        return sum(s.length for s in self.sections)

    @property
    def end(self) -> float:
        """Coordinate of the right end [m]."""
        return self.start + self.length

    @property
    def mass(self) -> float:
        """Mass of all sections without discs [kg]."""
        volume = sum(pi / 4 * (s.outer_diameter**2 - s.inner_diameter**2) * s.length for s in self.sections)
        return self.material.density * volume

    def problems(self) -> Iterator[tuple[str, str]]:
        """The elements are not too many."""
        if self.length / self.max_element_length > MOST_ELEMENTS:
            longest, few = show(self.max_element_length, "m"), min(float(f"{self.length / 20:.2g}"), 10.0)
            yield "max_element_length", f"'{longest}' needs over 1000 elements; write e.g. '{show(few, 'm')}'"


class Disc(Part):
    """A rigid disc on the shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> disc = {"mass": "1.5 kg", "polar_inertia": "4e-3 kg*m^2", "diametral_inertia": "2e-3 kg*m^2"}
    >>> rs.machine.Disc(position="120 mm", **disc).position
    0.12
    """

    position: float = number("m", "Coordinate z of the disc.", low=-100, high=100, example=0.3)
    mass: float = number("kg", "Mass.", above=0, high=1e6, example=1.5)
    polar_inertia: float = number(
        "kg*m^2", "Moment of inertia about the shaft's axis.", low=0, high=1e6, example=0.0037
    )
    diametral_inertia: float = number("kg*m^2", "Moment of inertia about a diameter.", low=0, high=1e6, example=0.0019)


class Probe(Part):
    """The plane in which the displacement of the shaft is measured.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Probe(position="150 mm").position
    0.15
    """

    position: float = number(
        "m", "Coordinate z of the sensors; the first disc when there is no probe.", low=-100, high=100, example=0.3
    )


class Drive(Part):
    """Drive of the shaft, and the drag besides the film's once the drive is off."""

    inertia: float | None = number(
        "kg*m^2",
        "Moment of inertia about the axis; that of shaft and discs when not given.",
        None,
        above=0,
        high=1e6,
        example=0.004,
    )
    dry_drag: float = number("N*m", "Constant torque against the rotation.", 0.0, low=0, high=1e6, example=16e-3)
    viscous_drag: float = number("N*m*s", "Torque per speed against the rotation.", 0.0, low=0, high=1e6)
    highest_speed: float | None = number(
        "rad/s", "Highest speed the machine is made for; the sampling rate follows from it.",
        None, above=0, high=1e6, example=6283.185307179586,
    )  # fmt: skip
    speed_recovery_time: float = number(
        "s", "Time in which the drive takes deviations of the speed back.", 0.5, above=1e-3, high=1e3
    )


LONGEST_NAME = 40


class ProbePart(Part):
    """Name, direction and sign of every probe."""

    tag: ClassVar[str] = "quantity"
    name: str = Field(description="Name of the probe: its label in records, its output of an FMU.")
    angle: float = number(
        "rad",
        "Direction from the shaft to the probe, from x (0) towards y.",
        low=-7,
        high=7,
        example=0.7853981633974483,
    )
    bearing: float | None = number(
        "1", "Index among the bearings, from 0, or name of the one on whose housing it is; the nearest when not given.",
        None, low=0, high=63, multiple=1, example=1,
    )  # fmt: skip
    sense: Literal["+", "-"] = Field("+", description="'+' reads more for motion towards the probe, '-' reads less.")

    def problems(self) -> Iterator[tuple[str, str]]:
        """The name can be a label everywhere."""
        if len(self.name) > LONGEST_NAME or not fullmatch(r"[A-Za-z]\w*", self.name, ASCII):
            yield "name", f"{quote(self.name)} is not a name; write letters, digits and _, a letter first, e.g. 'DE_x'"


class ShaftProbe(ProbePart):
    """A displacement probe on the shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.ShaftProbe(name="X", angle="45 deg", quantity="relative_displacement", position="0.15 m").sense
    '+'
    """

    quantity: Literal["relative_displacement", "absolute_displacement"] = Field(
        description="'relative_displacement' (to the housing) or 'absolute_displacement' of the shaft."
    )
    position: float = number("m", "Coordinate z of its plane.", low=-100, high=100, example=0.3)
    sensitivity: float | None = number(
        "V/m", "Volts per displacement; it reads m when not given.", None, above=0, high=1e12, example=7870.0
    )


class HousingPart(ProbePart):
    """A sensor on the housing."""

    position: float | None = number(
        "m", "Coordinate z where it stands; that of the gas bearing when not given.", None, low=-100, high=100,
        example=0.3,
    )  # fmt: skip


class HousingVelocity(HousingPart):
    """A velocity sensor on the housing.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.HousingVelocity(name="V", angle="90 deg", quantity="housing_velocity").sense
    '+'
    """

    quantity: Literal["housing_velocity"] = Field(description="'housing_velocity'.")
    sensitivity: float | None = number(
        "V*s/m", "Volts per velocity; it reads m/s when not given.", None, above=0, high=1e12, example=4.0
    )


class HousingAcceleration(HousingPart):
    """An accelerometer on the housing.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.HousingAcceleration(name="A", angle="90 deg", quantity="housing_acceleration").sense
    '+'
    """

    quantity: Literal["housing_acceleration"] = Field(description="'housing_acceleration'.")
    sensitivity: float | None = number(
        "V*s^2/m", "Volts per acceleration; it reads m/s^2 when not given.", None, above=0, high=1e12, example=0.0102
    )


def _kind(probe: Any) -> str | None:
    """Tag of the part that has the quantity of a probe."""
    named = probe.get("quantity") if isinstance(probe, dict) else getattr(probe, "quantity", None)
    return KINDS.get(named) if isinstance(named, str) else None


KINDS = {
    "relative_displacement": "relative_displacement", "absolute_displacement": "relative_displacement",
    "housing_velocity": "housing_velocity", "housing_acceleration": "housing_acceleration",
}  # fmt: skip
"""Quantities and the first of the part that has them."""
AnyProbe = Annotated[
    Annotated[ShaftProbe, Tag("relative_displacement")]
    | Annotated[HousingVelocity, Tag("housing_velocity")]
    | Annotated[HousingAcceleration, Tag("housing_acceleration")],
    Discriminator(_kind),
]
SI_UNITS = {
    "relative_displacement": "m", "absolute_displacement": "m", "housing_velocity": "m/s",
    "housing_acceleration": "m/s^2",
}  # fmt: skip
"""Unit of a quantity where no sensitivity is given."""


def gain(probe: ProbePart) -> float:
    """Reading per SI value of the quantity, with its sign [1, V/m, V s/m or V s^2/m]."""
    sensitivity = getattr(probe, "sensitivity", None)
    return (1.0 if sensitivity is None else sensitivity) * (1.0 if probe.sense == "+" else -1.0)


def reading_unit(probe: ShaftProbe | HousingVelocity | HousingAcceleration) -> str:
    """Unit of its readings."""
    return SI_UNITS[probe.quantity] if probe.sensitivity is None else "V"

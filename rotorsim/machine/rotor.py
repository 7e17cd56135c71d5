"""Machine-file parts of the rotor: shaft, discs, the plane that is measured, the drive."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from pydantic import Field

from rotorsim.base.units import show
from rotorsim.machine.part import Part, quantity

MOST_ELEMENTS = 1000


class ShaftMaterial(Part):
    """An isotropic elastic material.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.ShaftMaterial(density="7850 kg/m^3", youngs_modulus="210 GPa", poisson_ratio=0.3).youngs_modulus
    210000000000.0
    """

    density: float = quantity("kg/m^3", "Density.", above=0, high=1e5, example=7850.0)
    youngs_modulus: float = quantity("Pa", "Young's modulus.", above=0, high=1e13, example=210e9)
    poisson_ratio: float = quantity("1", "Poisson's ratio.", above=-1, high=0.5, example=0.3)


class Section(Part):
    """A cylindrical piece of the shaft; sections follow each other from the left end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Section(length="200 mm", outer_diameter="20 mm").length
    0.2
    """

    length: float = quantity("m", "Length of the piece.", above=0, high=100, example=0.6)
    outer_diameter: float = quantity("m", "Outer diameter.", above=0, high=10, example=0.02)
    inner_diameter: float = quantity("m", "Diameter of the bore; 0 is solid.", 0.0, low=0, high=10, example=0.01)
    axial_force: float | None = quantity(
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

    start: float = quantity("m", "Coordinate z of the left end.", 0.0, low=-100, high=100)
    material: ShaftMaterial = Field(description="What the shaft is made of.")
    sections: tuple[Section, ...] = Field(min_length=1, description="Pieces of the shaft, from left to right.")
    damping_ratio: float = quantity(
        "1", "Modal damping ratio of the shaft's own modes.", 0.0, low=0, high=0.5, example=0.01
    )
    max_element_length: float = quantity("m", "Longest finite element.", 0.025, above=0, high=10)

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

    position: float = quantity("m", "Coordinate z of the disc.", low=-100, high=100, example=0.3)
    mass: float = quantity("kg", "Mass.", above=0, high=1e6, example=1.5)
    polar_inertia: float = quantity(
        "kg*m^2", "Moment of inertia about the shaft's axis.", low=0, high=1e6, example=0.0037
    )
    diametral_inertia: float = quantity(
        "kg*m^2", "Moment of inertia about a diameter.", low=0, high=1e6, example=0.0019
    )


class Probe(Part):
    """The plane in which the displacement of the shaft is measured.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Probe(position="150 mm").position
    0.15
    """

    position: float = quantity(
        "m", "Coordinate z of the sensors; the first disc when there is no probe.", low=-100, high=100, example=0.3
    )


class Drive(Part):
    """Drive of the shaft, and the drag besides the film's once the drive is off."""

    inertia: float | None = quantity(
        "kg*m^2",
        "Moment of inertia about the axis; that of shaft and discs when not given.",
        None,
        above=0,
        high=1e6,
        example=0.004,
    )
    dry_drag: float = quantity("N*m", "Constant torque against the rotation.", 0.0, low=0, high=1e6, example=16e-3)
    viscous_drag: float = quantity("N*m*s", "Torque per speed against the rotation.", 0.0, low=0, high=1e6)
    highest_speed: float | None = quantity(
        "rad/s", "Highest speed the machine is made for; the sampling rate follows from it.",
        None, above=0, high=1e6, example=6283.185307179586,
    )  # fmt: skip
    speed_recovery_time: float = quantity(
        "s", "Time in which the drive takes deviations of the speed back.", 0.5, above=1e-3, high=1e3
    )

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

from collections.abc import Iterable, Iterator
from itertools import accumulate
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


class ShaftPiece(Part):
    """A cylinder, tube or cone; from the left end to the right one its diameters are linear."""

    length: float = number("m", "Length of the piece.", above=0, high=100, example=0.6)
    outer_diameter: float = number(
        "m", "Outer diameter, at the left end where the right one differs.", above=0, high=10, example=0.02
    )
    inner_diameter: float = number(
        "m", "Diameter of the bore, at the left end where the right one differs; 0 is solid.", 0.0, low=0, high=10,
        example=0.01,
    )  # fmt: skip
    outer_diameter_right: float | None = number(
        "m", "Outer diameter at the right end; as at the left one when not given.", None, above=0, high=10, example=0.03
    )
    inner_diameter_right: float | None = number(
        "m", "Diameter of the bore at the right end; as at the left one when not given.", None, low=0, high=10,
        example=0.01,
    )  # fmt: skip
    material: ShaftMaterial | None = Field(None, description="Its material; that of the shaft when not given.")

    @property
    def outer(self) -> tuple[float, float]:
        """Outer diameters [m] at the left and the right end."""
        right = self.outer_diameter_right
        return self.outer_diameter, self.outer_diameter if right is None else right

    @property
    def inner(self) -> tuple[float, float]:
        """Diameters of the bore [m] at the left and the right end."""
        right = self.inner_diameter_right
        return self.inner_diameter, self.inner_diameter if right is None else right

    def diameters(self, s: float) -> tuple[float, float]:
        """Inner and outer diameter [m] at s [m] from the left end; those of the end where s lies beyond."""
        share = min(max(s / self.length, 0.0), 1.0)
        (inner, inner_right), (outer, outer_right) = self.inner, self.outer
        return inner + share * (inner_right - inner), outer + share * (outer_right - outer)

    @property
    def volume(self) -> float:
        """Volume [m3]."""
        (inner, inner_right), (outer, outer_right) = self.inner, self.outer
        if (inner, outer) == (inner_right, outer_right):
            return pi / 4 * (outer**2 - inner**2) * self.length
        return pi / 4 * self.length * (_mean_power(outer, outer_right, 2) - _mean_power(inner, inner_right, 2))

    def polar_inertia(self, density: float) -> float:
        """Moment of inertia about the axis [kg m2] at a density [kg/m3]."""
        (inner, inner_right), (outer, outer_right) = self.inner, self.outer
        if (inner, outer) == (inner_right, outer_right):
            return pi / 32 * density * self.length * (outer**4 - inner**4)
        return (
            pi / 32 * density * self.length * (_mean_power(outer, outer_right, 4) - _mean_power(inner, inner_right, 4))
        )

    def problems(self) -> Iterator[tuple[str, str]]:
        """The bore is within."""
        ends = zip(self.inner, self.outer, ("", "_right"), strict=True)
        for inner, outer, end in ends:
            if inner >= outer:
                bore, limit = show(inner, "m"), show(outer, "m")
                where = end if getattr(self, f"inner_diameter{end}") is not None else ""
                yield (
                    f"inner_diameter{where}",
                    f"'{bore}' is not below outer_diameter{end} '{limit}'; make the bore smaller",
                )
                return


def _mean_power(left: float, right: float, power: int) -> float:
    """Mean of a power of a diameter that is linear between its ends."""
    return sum(left**k * right ** (power - k) for k in range(power + 1)) / (power + 1)


class Section(ShaftPiece):
    """A piece of the shaft; sections follow each other from the left end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Section(length="200 mm", outer_diameter="20 mm", outer_diameter_right="30 mm").outer
    (0.02, 0.03)
    """

    axial_force: float | None = number(
        "N", "Axial force in the piece, as of a thrust bearing; a pull is positive and stiffens it.", None,
        low=-1e9, high=1e9, example=500.0)  # fmt: skip


class Layer(ShaftPiece):
    """A ring around the shaft, such as a sleeve or magnets, over any part of its length.

    Examples
    --------
    >>> import rotorsim as rs
    >>> size = {"length": "40 mm", "inner_diameter": "20 mm", "outer_diameter": "26 mm"}
    >>> rs.machine.Layer(position="80 mm", **size).end
    0.12
    """

    name: str | None = Field(None, description="Name of the layer.")
    position: float = number("m", "Coordinate z of its left end.", low=-100, high=100, example=0.1)
    carries: Literal["mass and stiffness", "mass"] = Field(
        "mass and stiffness", description="'mass' where it does not stiffen the shaft, as magnets and loose sleeves."
    )

    @property
    def end(self) -> float:
        """Coordinate of its right end [m]."""
        return self.position + self.length

    def overlap(self, start: float, end: float) -> tuple[float, float] | None:
        """Coordinates [m] between which it covers a span of the shaft; None where it does not."""
        left, right = max(self.position, start), min(self.end, end)
        return (left, right) if right - left > 1e-6 * self.length else None


class ShaftMode(Part):
    """Damping of one mode of the shaft as its bearings hold it at their nominal stiffness.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.ShaftMode(damping_ratio=0.004).damping_ratio
    0.004
    """

    damping_ratio: float = number("1", "Modal damping ratio.", low=0, high=0.5, example=0.004)


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
    layers: tuple[Layer, ...] = Field((), description="Rings around it: sleeves, magnets.")
    damping_ratio: float = number(
        "1", "Modal damping ratio of the shaft's own modes.", 0.0, low=0, high=0.5, example=0.01
    )
    modes: tuple[ShaftMode, ...] = Field(
        (),
        description="Modes of either plane, from the lowest, with their own damping ratios; the rest has the above.",
    )
    max_element_length: float = number("m", "Longest finite element.", 0.025, above=0, high=10)

    @property
    def damping_ratios(self) -> list[float]:
        """Damping ratios of the first modes of a plane; the last one is that of all further modes."""
        return [*(mode.damping_ratio for mode in self.modes), self.damping_ratio]

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
        """Mass of all sections and layers without discs [kg]."""
        plain = sum(piece.volume for piece in self.pieces if piece.material is None)
        others = sum(piece.material.density * piece.volume for piece in self.pieces if piece.material is not None)
        return self.material.density * plain + others

    @property
    def polar_inertia(self) -> float:
        """Moment of inertia of all sections and layers about the axis [kg m2]."""
        return sum(piece.polar_inertia((piece.material or self.material).density) for piece in self.pieces)

    @property
    def pieces(self) -> tuple[ShaftPiece, ...]:
        """Sections and layers."""
        return (*self.sections, *self.layers)

    @property
    def placed(self) -> tuple[tuple[float, Section], ...]:
        """Coordinates [m] of the left ends of the sections, and themselves."""
        starts = accumulate((s.length for s in self.sections[:-1]), initial=self.start)
        return tuple(zip(starts, self.sections, strict=True))

    def outer_diameter(self, z: float) -> float:
        """Diameter [m] over the layers at z [m], the larger one at a step."""
        slack = 1e-9 * self.length
        pieces = [*self.placed, *((layer.position, layer) for layer in self.layers)]
        found = [p.diameters(z - at)[1] for at, p in pieces if at - slack <= z <= at + p.length + slack]
        return max(found, default=0.0)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Layers lie around the shaft and not in each other, the elements are not too many."""
        for i, layer in enumerate(self.layers):
            before = [(f"layers.{k}", other.position, other) for k, other in enumerate(self.layers[:i])]
            yield from _overlap(i, layer, before)
        for i, layer in enumerate(self.layers):
            yield from _overlap(i, layer, [(f"sections.{k}", *one) for k, one in enumerate(self.placed)])
            slack = 1e-9 * self.length
            if not (self.start - slack <= layer.position and layer.end <= self.end + slack):
                reach = f"{show(self.start, 'm')} to {show(_digits(self.end), 'm')}"
                yield (
                    f"layers.{i}.length",
                    f"'{show(layer.length, 'm')}' is beyond the shaft ({reach}); move or shorten it",
                )
        if self.length / self.max_element_length > MOST_ELEMENTS:
            longest, few = show(self.max_element_length, "m"), min(float(f"{self.length / 20:.2g}"), 10.0)
            yield "max_element_length", f"'{longest}' needs over 1000 elements; write e.g. '{show(few, 'm')}'"


def _overlap(i: int, layer: Layer, others: Iterable[tuple[str, float, ShaftPiece]]) -> Iterator[tuple[str, str]]:
    """The first of other pieces, by name and coordinate [m] of its left end, that a layer is not around, if any."""
    for name, at, piece in others:
        rings = [
            (piece.diameters(z - at), layer.diameters(z - layer.position))
            for z in layer.overlap(at, at + piece.length) or ()
        ]
        inside = name.startswith("layers") and all(under[0] >= own[1] * (1 - 1e-9) for under, own in rings)
        bad = [(own[0], under[1]) for under, own in rings if own[0] < under[1] * (1 - 1e-9)]
        if bad and not inside:
            bore, reach = (show(_digits(one), "m") for one in bad[0])
            yield (
                f"layers.{i}.inner_diameter",
                f"'{bore}' is below the outer diameter '{reach}' of shaft.{name} there; layers do not overlap",
            )
            return


def _digits(value: float) -> float:
    return float(f"{value:.9g}")


class Disc(Part):
    """A rigid disc on the shaft: an impeller, a wheel, a coupling half.

    Where its centre of gravity lies off its seat, as that of an impeller beyond the end of the shaft, `position` is
    that of the centre of gravity, and a rigid arm leads from the `seat` to it. The inertias are about the centre of
    gravity.

    Examples
    --------
    >>> import rotorsim as rs
    >>> disc = {"mass": "1.5 kg", "polar_inertia": "4e-3 kg*m^2", "diametral_inertia": "2e-3 kg*m^2"}
    >>> rs.machine.Disc(position="120 mm", seat="100 mm", **disc).arm
    0.02
    """

    name: str | None = Field(None, description="Name of the disc.")
    position: float = number("m", "Coordinate z of the disc's centre of gravity.", low=-100, high=100, example=0.3)
    seat: float | None = number(
        "m", "Coordinate z where it sits on the shaft; its position when not given.", None, low=-100, high=100,
        example=0.28,
    )  # fmt: skip
    mass: float = number("kg", "Mass.", above=0, high=1e6, example=1.5)
    polar_inertia: float = number(
        "kg*m^2", "Moment of inertia about the shaft's axis.", low=0, high=1e6, example=0.0037
    )
    diametral_inertia: float = number("kg*m^2", "Moment of inertia about a diameter.", low=0, high=1e6, example=0.0019)

    @property
    def seated(self) -> float:
        """Coordinate z [m] where it sits on the shaft."""
        return self.position if self.seat is None else self.seat

    @property
    def arm(self) -> float:
        """Distance [m] of the centre of gravity from the seat, positive to the right."""
        return _digits(self.position - self.seated)


class LumpedMass(Part):
    """A mass on the shaft without moments of inertia.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.LumpedMass(position="120 mm", mass="50 g").mass
    0.05
    """

    name: str | None = Field(None, description="Name of the mass.")
    position: float = number("m", "Coordinate z of the mass.", low=-100, high=100, example=0.3)
    mass: float = number("kg", "Mass.", above=0, high=1e6, example=0.05)


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
    name: str = Field(
        description="Name of the probe, its label in records and its output of an FMU: a letter, then letters, digits "
        "and _, at most 40 characters."
    )
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

"""Machine-file parts of the measuring chain: probes at any plane, angle and quantity.

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
from re import ASCII, fullmatch
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from rotorsim.base.display import quote
from rotorsim.machine.part import Part, quantity as number

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

"""Machine-file parts of sleeves that are no plain cylinder: lobes, steps, grooves, bump foil."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Literal

from pydantic import Field

from reynolds import sleeve
from rotorsim.base.units import show
from rotorsim.machine.part import Part, quantity

TURN = 2 * pi


class Lobes(Part):
    """Arcs round the sleeve, each with a radius of curvature larger than that of the circle that they touch.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Lobes(count=3, preload=0.5).offset
    0.5
    """

    count: float = quantity("1", "Number of arcs.", low=1, high=12, multiple=1, example=3)
    preload: float = quantity(
        "1", "1 - clearance / clearance of an arc about its own centre.", low=0, high=0.95, example=0.5
    )
    offset: float = quantity("1", "Where an arc is narrowest, as a share from its leading edge.", 0.5, low=0, high=1)
    first_angle: float = quantity("rad", "Where the first arc is narrowest, from x towards y.", 0.0, low=-7, high=7)

    @property
    def form(self) -> sleeve.Lobes:
        """The lobes as the film takes them."""
        return sleeve.Lobes(int(self.count), self.preload, self.offset, self.first_angle)


class Steps(Part):
    """Equal pockets round the sleeve: Rayleigh steps, axial grooves or recesses.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Steps(count=3, depth="20 um", arc="40 deg").length is None
    True
    """

    count: float = quantity("1", "Number of pockets, evenly spaced.", low=1, high=64, multiple=1, example=3)
    depth: float = quantity("m", "Depth of a pocket.", above=0, high=1e-3, example=20e-6)
    arc: float = quantity("rad", "Angle of a pocket.", above=0, high=7, example=0.7)
    length: float | None = quantity("m", "Axial length of a pocket, about the middle; all of the film when not given.",
                                    None, above=0, high=10, example=0.02)  # fmt: skip
    first_angle: float = quantity("rad", "Middle of the first pocket, from x towards y.", 0.0, low=-7, high=7)

    @property
    def form(self) -> sleeve.Steps:
        """The pockets as the film takes them."""
        return sleeve.Steps(int(self.count), self.depth, self.arc, self.length, self.first_angle)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Pockets leave a land between them."""
        if self.count * self.arc >= TURN:
            most = show(float(f"{0.9 * TURN / self.count:.2g}"), "rad")
            yield "arc", f"'{show(self.arc, 'rad')}' leaves no land between {self.count:g} pockets; write e.g. '{most}'"


class Grooves(Part):
    """Narrow slanted grooves, by narrow-groove theory: a herringbone or a spiral.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Grooves(depth="15 um", share=0.5, angle="28 deg", on="journal").pattern
    'herringbone'
    """

    pattern: Literal["herringbone", "spiral"] = Field(
        "herringbone", description="'herringbone' pumps to the middle, 'spiral' towards +z, for a positive speed."
    )
    on: Literal["journal", "sleeve"] = Field(description="What has the grooves: the 'journal' or the 'sleeve'.")
    depth: float = quantity("m", "Depth of a groove.", above=0, high=1e-3, example=15e-6)
    share: float = quantity("1", "Share of the circumference that is groove.", above=0, high=0.95, example=0.5)
    angle: float = quantity(
        "rad", "Angle between grooves and circumference; negative for the mirror image, which pumps the other way.",
        low=-1.55, high=1.55, example=0.5,
    )  # fmt: skip
    land: float = quantity("m", "Length in the middle of a herringbone that has no grooves.", 0.0, low=0, high=10)

    @property
    def form(self) -> sleeve.Grooves:
        """The grooves as the film takes them."""
        return sleeve.Grooves(self.depth, self.share, self.angle, self.land, self.on, self.pattern)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Grooves are slanted, and a spiral has no land."""
        if self.angle == 0:
            yield "angle", "'0 rad' pumps neither way; write e.g. '28 deg', or '-28 deg' for its mirror image"
        if self.pattern == "spiral" and self.land > 0:
            yield "land", f"'{show(self.land, 'm')}' goes with a herringbone; remove it"


class Foil(Part):
    """Bump foil on the sleeve: an elastic foundation under the film with a loss factor.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Foil(stiffness="4.7 GN/m^3", loss_factor=0.2).loss_frequency
    3141.592653589793
    """

    stiffness: float = quantity("N/m^3", "Stiffness per area of the foil.", above=0, high=1e18, example=4.7e9)
    loss_factor: float = quantity("1", "Loss factor of the foil at loss_frequency.", 0.0, low=0, high=2, example=0.2)
    loss_frequency: float = quantity(
        "rad/s", "Frequency of vibration that the loss factor is for.", 1000 * pi, above=0, high=1e6
    )

    @property
    def form(self) -> sleeve.Foil:
        """The foil as the film takes it."""
        return sleeve.Foil(self.stiffness, self.loss_factor, self.loss_frequency)

r"""Forms of a sleeve beyond the plain cylinder: lobes, steps, grooves, foil; those of a thrust bearing's face.

Each form is declared once: its dataclass has units, limits and sentences, from which the part of a machine file is made
(`rotorsim.machine.part.part_of`), and its geometry. What holds for all forms asks the dataclasses (`forms`).

Angles are on the bearing, from x towards y; z is measured from the film's middle. The clearance of a bearing is the
smallest one, that of a journal in the middle at the ridges between grooves, at the land between steps, in the middle of
a lobe, or over a foil that nothing presses on. A bump foil is an elastic foundation with a loss factor:

.. math:: \tau\,\dot w + w = \frac{p - p_a}{k}, \qquad h = c + w - X\cos\theta - Y\sin\theta, \qquad
          \tau = \frac{\eta}{\omega_\eta}

w [m] is its deflection at every node, k its stiffness per area [Pa/m], eta the loss factor that this first-order
foundation has at the frequency omega_eta. Bumps do not pull on each other. The deflection at the end of an implicit
stage follows from the pressure there, so that it is no unknown of its own: the film's Jacobian contains it.

Strips of bumps along the axis bend by the mean pressure along them, as Heshmat et al. have it, and only push:

.. math:: \tau\,\dot w + w = \max\!\left(0, \frac1L\int\frac{p - p_a}{k}\,\mathrm dz\right)

Where the mean is below ambient the foil has lifted off: ambient pressure is on both sides of it, and the film there
does not act on the journal.

An orifice in a foil ends in its top sheet and moves with it: its curtain is as high as the film over the bent foil.
The hole takes no stiffness from the foil, nor does the tube that feeds it give any.

The loss factor is the same at every amplitude; bumps that stick and slip lose more or less (Larsen et al. 2014).

Cites: heshmat_1983, larsen_2014.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import pi
from typing import Literal

import numpy as np

from reynolds.grid import JUMP, FilmError, FilmGrid, Layout, cells, fill
from rotorsim.base.quantity import number
from rotorsim.base.units import show


class SleeveForm:
    """A form of a sleeve: what a film and a machine file ask of every one."""

    def problems(self) -> Iterator[tuple[str, str]]:
        """Conflicts between its values: fields and sentences."""
        return iter(())

    def misfits(self, length: float) -> Iterator[tuple[str, str]]:
        """Values that do not fit a film of a `length` [m]: fields and sentences."""
        return iter(())

    def unfed(self, reach: float) -> str:
        """Why orifices up to `reach` [m] from the middle cannot feed a film with it; empty where they can."""
        return ""

    def remedy(self, load: float, clearance: float, area: float) -> str:
        """Remedy where a `load` [N] alone closes a `clearance` [m] over an `area` [m^2]; empty where it does not."""
        return ""


@dataclass(frozen=True)
class Lobes(SleeveForm):
    """Arcs of equal length whose radius of curvature exceeds that of the circle that they touch.

    Examples
    --------
    >>> import numpy as np
    >>> from reynolds.sleeve import Lobes
    >>> Lobes(3, 0.5).height(np.array([0.0, np.pi / 3]), 20e-6).round(9)
    array([0.e+00, 1.e-05])
    """

    count: float = number("1", "Number of arcs.", low=1, high=12, multiple=1, example=3)
    preload: float = number(
        "1", "1 - clearance / clearance of an arc about its own centre.", low=0, high=0.95, example=0.5
    )
    offset: float = number("1", "Where an arc is narrowest, as a share from its leading edge.", 0.5, low=0, high=1)
    first_angle: float = number("rad", "Where the first arc is narrowest, from x towards y.", 0.0, low=-7, high=7)

    def __post_init__(self) -> None:
        if self.count < 1 or not 0 <= self.preload < 1 or not 0 <= self.offset <= 1:
            raise FilmError("lobes: count must be at least 1, preload in 0..1 (below 1), offset in 0..1")

    def height(self, theta: np.ndarray, clearance: float) -> np.ndarray:
        """Gap [m] beyond the clearance at the angles theta [rad]."""
        arc = 2 * np.pi / self.count
        before = self.offset * arc
        phase = np.mod(theta - self.first_angle + before, arc) - before
        wide = clearance / (1 - self.preload)
        return np.asarray(wide * (1 - self.preload * np.cos(phase)) - clearance)

    @property
    def ends(self) -> np.ndarray:
        """Angles [rad] of the ends of the arcs."""
        return self.first_angle + 2 * np.pi / self.count * (np.arange(self.count) - self.offset)

    @property
    def edges(self) -> np.ndarray:
        """Angles [rad] at which the gap jumps from one arc to the next; none where arcs meet alike."""
        low, high = np.cos(np.array([self.offset, 1 - self.offset]) * 2 * np.pi / self.count)
        return np.zeros(0) if self.preload == 0 or abs(high - low) < 1e-12 else self.ends


@dataclass(frozen=True)
class Steps(SleeveForm):
    """Equal pockets round the sleeve: Rayleigh steps, axial grooves or recesses.

    Their edges may lie anywhere between the lines of a grid.

    Examples
    --------
    >>> import numpy as np
    >>> from reynolds.sleeve import Steps
    >>> Steps(2, 5e-6, 1.0).inside(np.array([0.4, 0.6, np.pi]), np.zeros(3), 0.04)
    array([ True, False,  True])
    """

    count: float = number("1", "Number of pockets, evenly spaced.", low=1, high=64, multiple=1, example=3)
    depth: float = number("m", "Depth of a pocket.", above=0, high=1e-3, example=20e-6)
    arc: float = number("rad", "Angle of a pocket.", above=0, high=7, example=0.7)
    length: float | None = number(
        "m", "Axial length of a pocket, about the middle; all of the film when not given.",
        None, above=0, high=10, example=0.02,
    )  # fmt: skip
    first_angle: float = number("rad", "Middle of the first pocket, from x towards y.", 0.0, low=-7, high=7)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Pockets leave a land between them."""
        if self.count * self.arc >= 2 * pi:
            most = show(float(f"{0.9 * 2 * pi / self.count:.2g}"), "rad")
            yield "arc", f"'{show(self.arc, 'rad')}' leaves no land between {self.count:g} pockets; write e.g. '{most}'"

    def inside(self, theta: np.ndarray, z: np.ndarray, length: float) -> np.ndarray:
        """Whether places (theta, z) on a film of a length [m] are in a pocket."""
        return np.asarray(self.covers(theta) & (np.abs(z) < self.reach(length)))

    def covers(self, theta: np.ndarray) -> np.ndarray:
        """Whether the angles theta [rad] are between the two ends of a pocket."""
        pitch = 2 * np.pi / self.count
        phase = np.mod(theta - self.first_angle + pitch / 2, pitch) - pitch / 2
        return np.asarray(np.abs(phase) < self.arc / 2)

    def reach(self, length: float) -> float:
        """Distance [m] of both axial ends from the middle of a film of a length [m]."""
        return (length if self.length is None else self.length) / 2

    @property
    def edges(self) -> np.ndarray:
        """Angles [rad] of the ends of all pockets; none where pockets run into each other."""
        pitch = 2 * np.pi / self.count
        if self.arc >= pitch:
            return np.zeros(0)
        middles = self.first_angle + pitch * np.arange(self.count)
        return np.concatenate([middles - self.arc / 2, middles + self.arc / 2])


@dataclass(frozen=True)
class Grooves(SleeveForm):
    """Narrow slanted grooves, by narrow-groove theory: a herringbone about a plain land or a spiral.

    They pump inwards (a spiral towards +z) when the shaft turns from x to y; those of a negative angle, the mirror
    image, when it turns from y to x.

    Examples
    --------
    >>> from reynolds.sleeve import Grooves
    >>> Grooves(10e-6, 0.5, 0.5, on="journal").sense
    -1.0
    """

    pattern: Literal["herringbone", "spiral"] = field(
        default="herringbone", kw_only=True,
        metadata={"doc": "'herringbone' pumps to the middle, 'spiral' towards +z, for a positive speed."},
    )  # fmt: skip
    on: Literal["journal", "sleeve"] = field(
        default="sleeve", kw_only=True,
        metadata={"doc": "What has the grooves: the 'journal' or the 'sleeve'.", "stated": True},
    )  # fmt: skip
    depth: float = number("m", "Depth of a groove.", above=0, high=1e-3, example=15e-6)
    share: float = number("1", "Share of the circumference that is groove.", above=0, high=0.95, example=0.5)
    angle: float = number(
        "rad", "Angle between grooves and circumference; negative for the mirror image, which pumps the other way.",
        low=-1.55, high=1.55, example=0.5,
    )  # fmt: skip
    land: float = number("m", "Length in the middle of a herringbone that has no grooves.", 0.0, low=0, high=10)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Grooves are slanted, and a spiral has no land."""
        if self.angle == 0:
            yield "angle", "'0 rad' pumps neither way; write e.g. '28 deg', or '-28 deg' for its mirror image"
        if self.pattern == "spiral" and self.land > 0:
            yield "land", f"'{show(self.land, 'm')}' goes with a herringbone; remove it"

    def misfits(self, length: float) -> Iterator[tuple[str, str]]:
        """The land leaves grooves on both sides."""
        if self.land >= length:
            yield (
                "land",
                f"'{show(self.land, 'm')}' leaves no grooves in a film of '{show(length, 'm')}'; make it shorter",
            )

    def unfed(self, reach: float) -> str:
        """Narrow-groove theory resolves no orifice among grooves: those that feed stand on the land."""
        if self.pattern == "spiral":
            return "a spiral has no land for orifices or injectors; remove the one or the others"
        least = 2 * reach
        if self.land >= least * (1 - 1e-9):
            return ""
        return f"orifices and injectors need a land of '{show(float(f'{least:.9g}'), 'm')}'; widen it or remove them"

    @property
    def sense(self) -> float:
        """1 for grooves at rest, -1 for grooves that turn."""
        return -1.0 if self.on == "journal" else 1.0

    def slant(self, z: np.ndarray) -> np.ndarray:
        """Sign of the groove angle at z [m], 0 on the land."""
        grooved = np.abs(z) >= self.land / 2 if self.pattern == "herringbone" else np.ones_like(z, bool)
        inwards = -np.sign(z) if self.pattern == "herringbone" else np.ones_like(z)
        return np.asarray(np.where(grooved, self.sense * inwards, 0.0))


@dataclass(frozen=True)
class Foil(SleeveForm):
    """Bump foil on the sleeve: an elastic foundation under the film with a loss factor.

    Examples
    --------
    >>> from reynolds.sleeve import Foil
    >>> Foil(4.7e9, 0.2, 2000.0).time
    0.0001
    """

    bumps: Literal["points", "strips"] = field(
        default="points", kw_only=True,
        metadata={"doc": "'points' follow the pressure on them both ways, 'strips' its axial mean, and only push."},
    )  # fmt: skip
    stiffness: float = number("N/m^3", "Stiffness per area of the foil.", above=0, high=1e18, example=4.7e9)
    loss_factor: float = number("1", "Loss factor of the foil at loss_frequency.", 0.0, low=0, high=2, example=0.2)
    loss_frequency: float = number(
        "rad/s", "Frequency of vibration that the loss factor is for.", 1000 * pi, above=0, high=1e6
    )

    @property
    def time(self) -> float:
        """Relaxation time [s] of the foundation."""
        return self.loss_factor / self.loss_frequency

    def remedy(self, load: float, clearance: float, area: float) -> str:
        """A stiffer foil where the `load` [N] bends it by more than the `clearance` [m] over an `area` [m^2]."""
        if load <= self.stiffness * clearance * area:
            return ""
        least = show(float(f"{load / (clearance * area):.1g}"), "N/m^3")
        bent = show(float(f"{load / (self.stiffness * area):.2g}"), "m")
        return f"the load bends the foil by {bent}; give a foil well above '{least}'"


@dataclass(frozen=True)
class SpiralGrooves:
    """Logarithmic spirals from one edge of a thrust film, before a ring without grooves, the land.

    They pump as stated when the shaft turns from x to y, the other way when it turns from y to x.

    Examples
    --------
    >>> from reynolds.sleeve import SpiralGrooves
    >>> SpiralGrooves(15e-6, 0.6, 0.3, 4e-3).pumps
    'inwards'
    """

    pumps: Literal["inwards", "outwards"] = field(
        default="inwards", kw_only=True,
        metadata={"doc": "Where they pump to for a positive speed: 'inwards' or 'outwards'; the land is at that edge."},
    )  # fmt: skip
    depth: float = number("m", "Depth of a groove.", above=0, high=1e-3, example=15e-6)
    share: float = number("1", "Share of the circumference that is groove.", above=0, high=0.95, example=0.6)
    angle: float = number("rad", "Angle between grooves and circumference.", above=0, high=1.55, example=0.3)
    land: float = number("m", "Width of the ring without grooves.", 0.0, low=0, high=10, example=4e-3)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Conflicts between its values: none."""
        return iter(())


@dataclass(frozen=True)
class RingFeed:
    """Orifices between the supply and the inner edge of a thrust film.

    Examples
    --------
    >>> from reynolds.sleeve import RingFeed
    >>> round(1e6 * RingFeed(8, 0.2e-3).open_area, 3)
    0.201
    """

    count: float = number("1", "Number of orifices.", low=1, high=64, multiple=1, example=8)
    diameter: float = number("m", "Diameter of an orifice.", above=0, high=0.01, example=0.2e-3)
    discharge: float = number("1", "Discharge coefficient of an orifice.", 0.8, above=0, high=2)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Conflicts between its values: none."""
        return iter(())

    @property
    def open_area(self) -> float:
        """Discharge coefficient times area of all orifices [m^2]."""
        return self.count * self.discharge * pi / 4 * self.diameter**2


@dataclass(frozen=True)
class Sleeve:
    """Form of a sleeve, parts of which may be there or not; without any it is a plain cylinder.

    Examples
    --------
    >>> from reynolds.sleeve import Sleeve, Steps
    >>> Sleeve(steps=(Steps(3, 5e-6, 0.5),)).textured
    True
    """

    lobes: Lobes | None = None
    steps: tuple[Steps, ...] = ()
    grooves: Grooves | None = None
    foil: Foil | None = None

    @property
    def forms(self) -> dict[str, SleeveForm]:
        """Forms that are there by their paths: 'lobes', 'steps.0', 'grooves', 'foil'."""
        rows = {f"steps.{i}": row for i, row in enumerate(self.steps)}
        found = {"lobes": self.lobes, **rows, "grooves": self.grooves, "foil": self.foil}
        return {path: form for path, form in found.items() if form is not None}

    @property
    def effective(self) -> Sleeve:
        """The sleeve without forms that leave the gap as it is: no preload, no depth, no share of the sleeve."""
        lobes = self.lobes if self.lobes is not None and self.lobes.preload > 0 else None
        steps = tuple(row for row in self.steps if row.depth > 0 and row.arc > 0)
        there = self.grooves is not None and self.grooves.depth > 0 and self.grooves.share > 0
        return Sleeve(lobes, steps, self.grooves if there else None, self.foil)

    def unfed(self, reach: float) -> Iterator[tuple[str, str]]:
        """Paths of the forms with which orifices up to `reach` [m] from the middle cannot feed a film, and why."""
        return ((path, why) for path, form in self.forms.items() if (why := form.unfed(reach)))

    def problems(self, length: float) -> Iterator[tuple[str, str]]:
        """Forms that do not fit a film of a `length` [m] or each other: paths below the sleeve and sentences."""
        for path, form in self.forms.items():
            yield from ((f"{path}.{name}", sentence) for name, sentence in form.misfits(length))
        if self.grooves is not None and self.steps:
            yield "steps", "do not go with grooves in the same film; remove the ones or the others"

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules of `reynolds` that compute it and not a plain cylinder."""
        foil, textured = self.foil is not None, self.textured
        needed = {"sleeve": foil, "texture": textured, "differences": foil or textured}
        return tuple(name for name, there in needed.items() if there)

    @property
    def textured(self) -> bool:
        """Whether the gap is not smooth: steps, grooves, lobes between which it jumps."""
        return bool(self.steps) or self.grooves is not None or self.jumps

    @property
    def jumps(self) -> bool:
        """Whether the gap jumps between lobes."""
        return self.lobes is not None and self.lobes.edges.size > 0

    def recesses(self, length: float) -> tuple[Steps, ...]:
        """Pockets as long as a film of a `length` [m], which leave no land at their angles."""
        return tuple(row for row in self.steps if row.length is None or row.length >= length)

    def edges(self, length: float) -> np.ndarray:
        """Angles [rad] of the ends of lobes and of pockets as long as a film of a `length` [m]."""
        lobes = np.zeros(0) if self.lobes is None else self.lobes.ends
        return np.concatenate([lobes, *(row.edges for row in self.recesses(length))])

    def arc(self, clearance: float) -> tuple[float, float]:
        """Clearance [m] of an arc about its own centre, and the distance of that from the middle."""
        wide = clearance if self.lobes is None else clearance / (1 - self.lobes.preload)
        return wide, wide - clearance

    @property
    def symmetric(self) -> bool:
        """Whether both halves are mirror images."""
        return self.grooves is None or self.grooves.pattern == "herringbone"

    def height(self, theta: np.ndarray, clearance: float) -> np.ndarray:
        """Smooth part of the gap [m] beyond the clearance, at angles theta [rad]."""
        return np.zeros_like(theta) if self.lobes is None else self.lobes.height(theta, clearance)


PLAIN = Sleeve()
NO_STEPS = Steps(1, 0.0, 0.0)


class Pieces:
    """Cells cut at the edges of pockets, lands and lobes, in theta (between lines) and in z (between rows).

    A cell has `most` pieces one behind another, whose lengths are shares of the cell and may be 0: `lines` (n_theta,
    most) and `rows` (patches, most). The `middles` of pieces (n_theta, most) are shares of the cell. About a jump
    between lobes a piece differs by `lift` [m] from the thickness that the cell's two lines have there, and by `rises`
    (n_theta, 2, most) [m] from that of either. `line_cover` and `row_cover` (..., n_steps) say
    which pockets are there, `slant` (patches, most) the sign of the groove angle.
    """

    def __init__(self, layout: Layout, grid: FilmGrid, sleeve: Sleeve, clearance: float) -> None:
        self.most, lobes = layout.pieces, sleeve.lobes
        steps = (*sleeve.steps, *[NO_STEPS] * (layout.n_steps - len(sleeve.steps)))
        jumps = np.zeros(0) if lobes is None else lobes.edges
        cuts = (np.concatenate([jumps, *(s.edges for s in steps)]) / grid.dtheta) % grid.n_theta
        arc = 2 * np.pi / max(jumps.size, 1)
        first = jumps[0] if jumps.size else 0.0

        def along(places: np.ndarray) -> np.ndarray:
            """Pockets at places counted in lines, and which arc they are in."""
            theta = places * grid.dtheta
            side = np.floor((theta - first) / arc) if jumps.size else 0 * theta
            return np.stack([*(s.covers(theta) for s in steps), side], axis=-1)

        rows = np.arange(layout.half - 1, grid.n_rows)
        low = 0.0 if grid.half else grid.dz - grid.length / 2
        ends = [s.reach(grid.length) for s in steps]
        if sleeve.grooves is not None and sleeve.grooves.pattern == "herringbone":
            ends.append(sleeve.grooves.land / 2)
        z_cuts = (np.array([*ends, *(-end for end in ends)]) - low) / grid.dz

        def across(places: np.ndarray) -> np.ndarray:
            """Pockets at places counted in rows, and the slant of the grooves."""
            z = low + places * grid.dz
            slant = np.zeros_like(z) if sleeve.grooves is None else sleeve.grooves.slant(z)
            return np.stack([*(np.abs(z) < s.reach(grid.length) for s in steps), slant], axis=-1)

        def depths(others: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
            """Difference between pieces of one axis: depths with all pieces `others` of the other one, arc or slant."""

            def at(kinds: np.ndarray) -> np.ndarray:
                there = kinds[..., None, :-1] * others[:, :-1] > 0
                found = np.zeros(there.shape[:-1])
                for n, step in enumerate(steps):
                    found = np.where(there[..., n], step.depth, found)
                return np.concatenate([found, kinds[..., -1:]], axis=-1)

            return at

        lines_seen, rows_seen = (
            depths(np.unique(kind(0.5 * (ends[1:] + ends[:-1])), axis=0))
            for kind, ends in (
                (across, np.unique([-1, grid.n_rows, *z_cuts])),
                (along, np.unique([0, grid.n_theta, *cuts])),
            )
        )
        begins = np.arange(grid.n_theta)
        self.lines, keys, middles = self._cut(begins, cuts, along, lines_seen, grid.n_theta)
        self.middles = middles - begins[:, None]
        self.line_cover = keys[..., :-1]
        self.lift, self.rises = np.zeros_like(self.lines), np.zeros((begins.size, 2, self.most))
        if lobes is not None and jumps.size:
            nodes, pieces = (sleeve.height(theta * grid.dtheta, clearance) for theta in (begins, middles))
            cell = np.floor(np.concatenate([cuts - ON_A_LINE, cuts + ON_A_LINE])).astype(int) % begins.size
            self.lift[cell] = (pieces - self._between(nodes))[cell]
            self.rises[cell] = (pieces[:, None] - np.stack([nodes, np.roll(nodes, -1)], 1)[..., None])[cell]
        self.rows, keys, _ = self._cut(rows, z_cuts, across, rows_seen, 0)
        self.row_cover, self.slant = keys[..., :-1], keys[..., -1]

    def _cut(
        self,
        begins: np.ndarray,
        cuts: np.ndarray,
        kind: Callable[[np.ndarray], np.ndarray],
        seen: Callable[[np.ndarray], np.ndarray],
        period: int,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lengths, kinds and middles of the pieces of cells that begin at the numbers `begins`.

        Pieces whose kinds are `seen` alike are one.
        """
        lengths, middles = np.zeros((2, begins.size, self.most))
        lengths[:, 0], middles[:] = 1.0, begins[:, None] + 0.5
        kinds = np.array(kind(middles), float)
        for cell, begin in enumerate(begins):
            inside = (cuts - begin) % period if period else cuts - begin
            inside = np.sort(inside[(inside > ON_A_LINE) & (inside < 1 - ON_A_LINE)])
            bounds = begin + np.concatenate([[0.0], inside[np.diff(inside, prepend=0.0) > ON_A_LINE], [1.0]])
            width, middle = np.diff(bounds), 0.5 * (bounds[1:] + bounds[:-1])
            found = kind(middle)
            _, first, which = np.unique(seen(found), axis=0, return_index=True, return_inverse=True)
            found, size = found[first], np.bincount(which.ravel(), width)
            place = np.bincount(which.ravel(), width * middle) / size
            order = np.argsort(place)
            for piece, values in ((lengths, size), (kinds, found), (middles, place)):
                piece[cell, : order.size] = values[order]
        return lengths, kinds, middles

    def flow(self, sleeve: Sleeve, clearance: float, grid: FilmGrid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Conductances [m3] of the pieces along the circumference and the axis and the drag [m] along the former, with
        a journal in the middle, (n_theta, most, patches, most)."""
        from reynolds.texture import mean_flow  # which loads the compiler; a form is read from a file without

        depth, share, slant = self.texture(sleeve)
        h = (clearance + self._between(sleeve.height(grid.theta, clearance)) + self.lift)[..., None, None]
        along, across, drag, aside = getattr(mean_flow, "py_func", mean_flow)(h, depth, share, 0.0)
        angle, sense = (0.0, 1.0) if sleeve.grooves is None else (sleeve.grooves.angle, sleeve.grooves.sense)
        turned = np.abs(slant) * np.sin(angle) ** 2
        more = (across - along) * turned
        return along + more, across - more, drag + sense * turned * (aside - drag)

    def carried(self, sleeve: Sleeve, clearance: float, grid: FilmGrid) -> tuple[np.ndarray, np.ndarray]:
        """Shares (line, patch, 2, 2, piece, piece) of a patch that its pieces give its four nodes, and the integrals of
        exp(i theta) over them, sums (line, patch, 2, 2) less those of a patch without edges.

        Along both axes the pressure falls from side to side as the resistance of pockets and grooves that is passed,
        for a journal in the middle.
        """
        along, across, _ = self.flow(sleeve, clearance, grid)
        lines, passed = self.lines[:, :, None, None], []
        for axis, one in ((1, lines / along), (3, self.rows / across)):
            part = (one.cumsum(axis=axis) - 0.5 * one) / one.sum(axis=axis, keepdims=True)
            passed.append(np.stack([1 - part, part], axis=-1))
            if axis == 1:
                half = 0.5 * one / one.sum(axis=1, keepdims=True)
        shares = np.einsum("isjt,isjta,isjtb->ijabst", lines * self.rows, *passed)
        falls = np.stack([half, -half], axis=-1)
        whole, rising = (turn[:, :, None, None, None] for turn in self.turns(grid))
        turned = (passed[0] + falls) * whole - 2 * falls * rising
        moments = np.einsum("jt,isjta,isjtb->ijab", self.rows, turned, passed[1])
        uncut = self.turns(grid, whole=True)
        plain = 0.5 * np.stack([uncut[0] - uncut[1], uncut[1]], axis=-1)
        return shares, moments - plain[:, 0, None, :, None]

    def turns(self, grid: FilmGrid, whole: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Integrals (n_theta, most) of exp(i theta) over the pieces, and with a factor that rises from 0 to 1 on each;
        of `whole` cells (n_theta, 1) if asked for.

        Both in cells and over those that the trapezoidal rule makes too small, sinc^2 of half a cell: the force of
        pressures that fall straight from line to line has that factor everywhere.
        """
        one = np.ones((grid.n_theta, 1))
        middle, length = (0.5 * one, one) if whole else (self.middles, self.lines)
        step = 1j * grid.dtheta
        low = np.arange(grid.n_theta)[:, None] + middle - 0.5 * length
        a = np.where(length > 0, step * length, 1.0)
        e = np.exp(a)
        scale = length * np.exp(step * low) / np.sinc(0.5 * grid.dtheta / np.pi) ** 2
        return scale * (e - 1) / a, scale * (e / a - (e - 1) / a**2)

    def pushing(self, grid: FilmGrid) -> np.ndarray:
        """Forces (n_theta, most, 4) [m2] x and y of a unit pressure on a piece, over the whole patch in z, and of one
        that rises from 0 to 1 on it."""
        area = grid.dy * grid.dz * (2 if grid.half else 1)
        return np.stack([-area * part for turn in self.turns(grid) for part in (turn.real, turn.imag)], axis=-1)

    def _between(self, nodes: np.ndarray) -> np.ndarray:
        """Values (n_theta, most) in the middles of pieces that nodes (n_theta,) have there by a straight line."""
        return nodes[:, None] + (np.roll(nodes, -1) - nodes)[:, None] * self.middles

    def texture(self, sleeve: Sleeve) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Depth [m], groove share and slant of every piece, (n_theta, most, patches, most)."""
        shape = (*self.lines.shape, *self.rows.shape)
        slant = np.broadcast_to(self.slant, shape)
        depth, share = np.zeros(shape), np.zeros(shape)
        if (grooves := sleeve.grooves) is not None:
            depth, share = (np.where(slant != 0, value, 0.0) for value in (grooves.depth, grooves.share))
        for n, step in enumerate(sleeve.steps):
            inside = (self.line_cover[..., n, None, None] > 0) & (self.row_cover[..., n] > 0)
            depth, share = np.where(inside, step.depth, depth), np.where(inside, 1.0, share)
            slant = np.where(inside, 0.0, slant)
        return depth, share, slant


ON_A_LINE = 1e-9
"""Share of a cell within which an edge counts as on the line."""


def fill_texture(w: np.ndarray, layout: Layout, grid: FilmGrid, sleeve: Sleeve, clearance: float) -> None:
    """Write steps, grooves and jumps into the workspace: per patch between four nodes, the pieces of the patches that
    edges cut, and the mean depth about the nodes."""
    pieces = Pieces(layout, grid, sleeve, clearance)
    texture = pieces.texture(sleeve)
    area = (pieces.lines[:, :, None, None] * pieces.rows).transpose(0, 2, 1, 3)  # line, patch, piece, piece
    largest = area.reshape(*area.shape[:2], -1).argmax(axis=2)[..., None]
    mixed = np.broadcast_to((pieces.lift != 0).any(axis=1)[:, None], area.shape[:2])
    parts = []
    for values in texture:
        of_patch = values.transpose(0, 2, 1, 3).reshape(*area.shape[:2], -1)
        parts.append(np.take_along_axis(of_patch, largest, axis=2)[..., 0])
        mixed = mixed | ((of_patch != parts[-1][..., None]) & (area > 0).reshape(of_patch.shape)).any(axis=2)
    angle = 0.0 if sleeve.grooves is None else sleeve.grooves.angle
    turned = np.abs(parts[2])
    _fill_patches(w, layout, layout.depth, parts[0])
    _fill_patches(w, layout, layout.share, parts[1])
    _fill_patches(w, layout, layout.cos_squared, np.cos(turned * angle) ** 2)
    _fill_patches(w, layout, layout.sin_cos, parts[2] * np.sin(angle) * np.cos(angle))
    _fill_patches(w, layout, layout.patch, np.ones_like(turned))
    _fill_patches(w, layout, layout.mixed, mixed)
    # the midplane's cell is half a cell whose face counts whole: its patch below is the mirror image
    middle = np.arange(turned.shape[1]) == 0 if grid.half else np.zeros(turned.shape[1], bool)
    _fill_patches(w, layout, layout.patch_south, np.broadcast_to(np.where(middle, 2.0, 1.0), turned.shape))
    for offset, values in (
        (layout.line_piece, pieces.lines), (layout.line_lift, pieces.lift), (layout.line_cover, pieces.line_cover),
        (layout.row_piece, pieces.rows), (layout.row_slant, pieces.slant), (layout.row_cover, pieces.row_cover),
        (layout.step_depth, np.array([step.depth for step in sleeve.steps])),
        (layout.line_middle, pieces.middles), (layout.line_turn, pieces.pushing(grid)),
    ):  # fmt: skip
        w[offset : offset + values.size] = values.ravel()
    if (grooves := sleeve.grooves) is not None:
        w[layout.groove : layout.groove + 4] = (
            grooves.depth, grooves.share, np.cos(angle) ** 2, np.sin(angle) * np.cos(angle)
        )  # fmt: skip
    carried, moments = pieces.carried(sleeve, clearance, grid)
    deeper = (texture[0] * texture[1]).transpose(0, 2, 1, 3)[:, :, None, None] + pieces.rises[:, None, :, None, :, None]
    fill(w, layout.deep, layout, _about_nodes((carried * deeper).sum(axis=(4, 5)), grid), 0.0)
    cut = mixed[..., None, None]
    more = _about_nodes(np.where(cut, carried.sum(axis=(4, 5)) - 0.25, 0.0), grid)
    fill(w, layout.broad, layout, 1 + more, 1.0)
    turned = _about_nodes(np.where(cut, moments, 0.0), grid)
    inside = cells(layout)
    area = -np.hypot(w[layout.force_x + inside], w[layout.force_y + inside])
    for force, ahead, part, own in (
        (layout.force_x, layout.ahead_x, turned.real, np.cos(grid.theta)),
        (layout.force_y, layout.ahead_y, turned.imag, np.sin(grid.theta)),
    ):
        w[force + inside] += area * part
        # over the ambient pressure, which the edge has
        w[force + inside[:, -1] + 1] = -(area * part).sum(axis=1)
        fill(w, ahead, layout, part - own[:, None] * more, 0.0)


def _about_nodes(quarters: np.ndarray, grid: FilmGrid) -> np.ndarray:
    """Sums (n_theta, n_rows) about the nodes of what the quarters (line, patch, 2, 2) of the patches hold."""
    about = quarters[:, :, 0] + np.roll(quarters[:, :, 1], 1, axis=0)
    before, behind = about[..., 1], about[..., 0]
    # the row at the midplane of a half bearing has the same patch on either side
    below = np.hstack([behind[:, :1], before[:, :-1]]) if grid.half else before[:, :-1]
    return np.asarray(below + (behind if grid.half else behind[:, 1:]))


def stretches(sleeve: Sleeve, grid: FilmGrid, clearance: float) -> np.ndarray:
    """Stretches (n, STRETCH) between lines of the grid and edges of lobes and pockets, within which the form is smooth.

    Pockets count where they are as long as the film: else the land at their ends is closer.
    """
    lobes, step = sleeve.lobes, grid.dtheta
    arc = 2 * np.pi / (1 if lobes is None else lobes.count)
    first = 0.0 if lobes is None else lobes.first_angle - lobes.offset * arc
    cuts = np.concatenate([np.arange(grid.n_theta), (sleeve.edges(grid.length) / step) % grid.n_theta])
    cuts = np.unique(np.round(cuts, 9) % grid.n_theta)
    ends = np.append(cuts[1:], grid.n_theta)
    middle = 0.5 * (cuts + ends) * step
    pit = np.zeros_like(middle)
    for row in sleeve.recesses(grid.length):
        pit = np.where(row.inside(middle, 0 * middle, grid.length), row.depth, pit)
    about = np.zeros_like(middle)
    if lobes is not None:
        about = first + arc * np.floor((middle - first) / arc) + lobes.offset * arc
    line = np.floor(0.5 * (cuts + ends))
    wide, lobe = sleeve.arc(clearance)
    columns = [line, cuts - line, ends - line, about, pit]
    for place in (cuts * step, ends * step):
        form = wide - lobe * np.cos(place - about) + pit
        columns += [np.cos(place), np.sin(place), form, lobe * np.sin(place - about)]
    columns.append(np.abs(columns[7] - np.roll(columns[11], 1)) > JUMP)
    return np.stack(columns, axis=1)


def _fill_patches(w: np.ndarray, layout: Layout, offset: int, values: np.ndarray) -> None:
    """Write (n_theta, patches) values, each at the node below and before it, into lines and ghost lines."""
    for i in range(-1, layout.n_theta + 1):
        start = offset + layout.first + i * layout.stride + layout.half - 1
        w[start : start + values.shape[1]] = values[i % layout.n_theta]

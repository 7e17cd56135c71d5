r"""Forms of a sleeve that is no plain cylinder: lobes, steps, grooves, foil.

Angles are on the bearing, from x towards y; z is measured from the film's middle. The clearance of a bearing is the
smallest one, that of a journal in the middle at the ridges between grooves, at the land between steps, in the middle of
a lobe, or over a foil that nothing presses on. A bump foil is an elastic foundation with a loss factor:

.. math:: \tau\,\dot w + w = \frac{p - p_a}{k}, \qquad h = c + w - X\cos\theta - Y\sin\theta, \qquad
          \tau = \frac{\eta}{\omega_\eta}

w [m] is its deflection at every node, k its stiffness per area [Pa/m], eta the loss factor that this first-order
foundation has at the frequency omega_eta. Bumps do not pull on each other. The deflection at the end of an implicit
stage follows from the pressure there, so that it is no unknown of its own: the film's Jacobian contains it.

Cites: heshmat_1983.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from reynolds.errors import FilmError
from reynolds.grid import Grid, Layout, fill


@dataclass(frozen=True)
class Lobes:
    """Arcs of equal length whose radius of curvature exceeds that of the circle that they touch.

    `preload` is 1 - clearance / (clearance of an arc about its own centre); `offset` is where along an arc it is
    narrowest, as a share of its length from the edge the surface enters at; `first_angle` [rad] is where the first arc
    is narrowest.

    Examples
    --------
    >>> import numpy as np
    >>> from reynolds.sleeve import Lobes
    >>> Lobes(3, 0.5).height(np.array([0.0, np.pi / 3]), 20e-6).round(9)
    array([0.e+00, 1.e-05])
    """

    count: int
    preload: float
    offset: float = 0.5
    first_angle: float = 0.0

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


@dataclass(frozen=True)
class Steps:
    """Equal pockets round the sleeve: a Rayleigh step, an axial groove, a recess.

    depth [m], arc [rad] and length [m] (None: that of the film) of each; `first_angle` [rad] is the middle of the
    first. Their edges go to the nearest lines of the grid.

    Examples
    --------
    >>> import numpy as np
    >>> from reynolds.sleeve import Steps
    >>> Steps(2, 5e-6, 1.0).inside(np.array([0.4, 0.6, np.pi]), np.zeros(3), 0.04)
    array([ True, False,  True])
    """

    count: int
    depth: float
    arc: float
    length: float | None = None
    first_angle: float = 0.0

    def inside(self, theta: np.ndarray, z: np.ndarray, length: float) -> np.ndarray:
        """Whether places (theta, z) on a film of a length [m] are in a pocket."""
        pitch = 2 * np.pi / self.count
        phase = np.mod(theta - self.first_angle + pitch / 2, pitch) - pitch / 2
        reach = (length if self.length is None else self.length) / 2
        return np.asarray((np.abs(phase) < self.arc / 2) & (np.abs(z) < reach))


@dataclass(frozen=True)
class Grooves:
    """Narrow slanted grooves: a herringbone about a plain land, or a spiral that pumps towards +z.

    depth [m]; `share` of the circumference that is groove; `angle` [rad] from the circumferential direction; `land`
    [m], length without grooves in the middle of a herringbone; on the journal or on the sleeve. They pump inwards when
    the shaft turns from x to y; those of a negative angle, the mirror image, when it turns from y to x.

    Examples
    --------
    >>> from reynolds.sleeve import Grooves
    >>> Grooves(10e-6, 0.5, 0.5, on="journal").sense
    -1.0
    """

    depth: float
    share: float
    angle: float
    land: float = 0.0
    on: Literal["journal", "sleeve"] = "sleeve"
    pattern: Literal["herringbone", "spiral"] = "herringbone"

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
class Foil:
    """Bump foil as an elastic foundation: stiffness per area [Pa/m], loss factor at `loss_frequency` [rad/s].

    Examples
    --------
    >>> from reynolds.sleeve import Foil
    >>> Foil(4.7e9, 0.2, 2000.0).time
    0.0001
    """

    stiffness: float
    loss_factor: float = 0.0
    loss_frequency: float = 2 * np.pi * 500

    @property
    def time(self) -> float:
        """Relaxation time [s] of the foundation."""
        return self.loss_factor / self.loss_frequency


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
    def textured(self) -> bool:
        """Whether there are steps or grooves."""
        return bool(self.steps) or self.grooves is not None

    def recesses(self, length: float) -> tuple[Steps, ...]:
        """Pockets as long as a film of a `length` [m], which leave no land at their angles."""
        return tuple(row for row in self.steps if row.length is None or row.length >= length)

    def edges(self, length: float) -> np.ndarray:
        """Angles [rad] of the ends of lobes and of pockets as long as a film of a `length` [m]."""
        found = [np.zeros(0)]
        if self.lobes is not None:
            found.append(
                self.lobes.first_angle
                + 2 * np.pi / self.lobes.count * (np.arange(self.lobes.count) - self.lobes.offset)
            )
        for row in self.recesses(length):
            middles = row.first_angle + 2 * np.pi / row.count * np.arange(row.count)
            found += [middles - row.arc / 2, middles + row.arc / 2]
        return np.concatenate(found)

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


def fill_texture(w: np.ndarray, layout: Layout, grid: Grid, sleeve: Sleeve) -> None:
    """Write steps and grooves into the workspace: per patch between four nodes, and their mean depth at the nodes."""
    rows = np.arange(layout.half - 1, grid.n_rows)
    z = (rows + 0.5) * grid.dz if grid.half else (rows + 1.5) * grid.dz - grid.length / 2
    theta, z = np.meshgrid(grid.theta + 0.5 * grid.dtheta, z, indexing="ij")
    depth, share, angle = (np.zeros_like(theta) for _ in range(3))
    if (grooves := sleeve.grooves) is not None:
        slant = grooves.slant(z)
        depth, share = (np.where(slant != 0, value, 0.0) for value in (grooves.depth, grooves.share))
        angle = slant * grooves.angle
    for step in sleeve.steps:
        inside = step.inside(theta, z, grid.length)
        depth, share = np.where(inside, step.depth, depth), np.where(inside, 1.0, share)
    _fill_patches(w, layout, layout.depth, depth)
    _fill_patches(w, layout, layout.share, share)
    _fill_patches(w, layout, layout.cos_squared, np.cos(angle) ** 2)
    _fill_patches(w, layout, layout.patch, np.ones_like(angle))
    # the midplane's cell is half a cell whose face counts whole: its patch below is the mirror image
    _fill_patches(w, layout, layout.patch_south, np.where((z == z.min()) & bool(layout.half), 2.0, 1.0))
    _fill_patches(w, layout, layout.sin_cos, np.sin(angle) * np.cos(angle))
    mean = depth * share
    mean = 0.5 * (mean + np.roll(mean, 1, axis=0))
    # the row at the midplane of a half bearing has the same patch on either side
    below = mean[:, :-1] if not grid.half else np.hstack([mean[:, :1], mean[:, :-1]])
    fill(w, layout.deep, layout, 0.5 * (below + (mean if grid.half else mean[:, 1:])), 0.0)


def stretches(sleeve: Sleeve, grid: Grid, clearance: float) -> np.ndarray:
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
    return np.stack(columns, axis=1)


def _fill_patches(w: np.ndarray, layout: Layout, offset: int, values: np.ndarray) -> None:
    """Write (n_theta, patches) values, each at the node below and before it, into lines and ghost lines."""
    for i in range(-1, layout.n_theta + 1):
        start = offset + layout.first + i * layout.stride + layout.half - 1
        w[start : start + values.shape[1]] = values[i % layout.n_theta]

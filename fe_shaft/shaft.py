r"""Parts of a rotor as values: materials, shaft elements, rigid masses, linear bearings; checks of all that is given.

A disc is rigid and thin enough to sit on one node.  A ring of width w, bore d_i and diameter d_o has

.. math:: m = \tfrac{\pi}{4}\rho w (d_o^2 - d_i^2), \quad I_p = \tfrac{m}{8}(d_o^2 + d_i^2), \quad
          I_d = \tfrac{I_p}{2} + \tfrac{m w^2}{12}

Source: Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), chapter 5.

A linear bearing has constant coefficients, or tables over shaft speed and whirl frequency. Its force on the shaft is
-[k] (x, y) - [c] (dx, dy), relative to the ground or to the node `n_link` of a pedestal. Between the entries of a table
coefficients are linear; outside it they are refused, or held constant on request.

A table over the speed is that of a shaft that turns from x to y. A shaft that turns the other way is its mirror image:
coefficients at abs(Omega) with the cross terms of the opposite sign. Constant coefficients do not know of the rotation
and hold for either sense.

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isclose, isfinite, pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotorsim.base.errors import RotorsimError


class ShaftError(RotorsimError, ValueError):
    """Raised for an element, a rotor or an analysis with an unusable input; names it, its value and limit."""


def positive(owner: str, **values: float) -> None:
    """Raise ShaftError unless every value is above 0."""
    for name, value in values.items():
        if not value > 0:
            raise ShaftError(f"{owner}: {name} = {value:g} must be positive.", argument=name, value=value)


def finite(owner: str, **values: float) -> None:
    """Raise ShaftError unless every value is a finite number."""
    for name, value in values.items():
        if not np.isfinite(value):
            raise ShaftError(
                f"{owner}: {name} = {value:g} is not a finite number; give one.", argument=name, value=value
            )


def not_negative(owner: str, **values: float) -> None:
    """Raise ShaftError unless every value is 0 or more."""
    for name, value in values.items():
        if not value >= 0:
            raise ShaftError(f"{owner}: {name} = {value:g} must not be negative.", argument=name, value=value)


def grid(owner: str, values: ArrayLike, increasing: bool = True) -> NDArray[np.float64]:
    """The values (n,) as an array; raises ShaftError if they are none, not finite or not `increasing`."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    if array.ndim != 1 or not array.size:
        raise ShaftError(f"{owner}: shape {np.shape(values)}; give a list of at least one number.")
    if not np.all(np.isfinite(array)):
        bad = int(np.flatnonzero(~np.isfinite(array))[0])
        raise ShaftError(f"{owner}: value {bad} is {array[bad]:g}; give finite numbers only.")
    if increasing and np.any(np.diff(array) <= 0):
        bad = int(np.flatnonzero(np.diff(array) <= 0)[0]) + 1
        raise ShaftError(f"{owner}: value {bad}, {array[bad]:g}, is not above the one before it; sort them, each once.")
    return array


COEFFICIENTS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
"""Stiffness and damping of a bearing, by axis of the force and of the motion."""
SWITCHES = ("shear_effects", "rotary_inertia", "gyroscopic")
"""Terms of a shaft element that can be left out."""
SOFT = 1e-6
"""Share of Young's modulus up to which a layer is meant as mass alone: ROSS has no other word for it."""


@dataclass(frozen=True)
class Material:
    """Isotropic elastic material; of `G_s` and `Poisson` give one: E = 2 G_s (1 + Poisson) gives the other.

    Parameters
    ----------
    name : str
    rho : float
        Density [kg/m3]; positive, because the mass matrix must be.
    E : float
        Young's modulus [Pa].
    G_s : float, optional
        Shear modulus [Pa].
    Poisson : float, optional
        Poisson's ratio [1].

    Raises
    ------
    ShaftError
        If a modulus or the density is not positive, or if `G_s` and `Poisson` are both missing or contradict.

    Examples
    --------
    >>> import fe_shaft
    >>> titanium = fe_shaft.Material("titanium", rho=4430.0, E=114e9, Poisson=0.34)
    >>> round(titanium.G_s / 1e9, 1)
    42.5
    """

    name: str
    rho: float
    E: float
    G_s: float = None  # type: ignore[assignment]  # a float after __post_init__
    Poisson: float = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        """Derive the missing elastic constant and check the rest."""
        positive(f"material {self.name!r}", rho=self.rho, E=self.E)
        if self.G_s is None and self.Poisson is None:
            raise ShaftError(f"material {self.name!r}: shear stiffness unknown; give G_s [Pa] or Poisson.")
        if self.G_s is None:
            object.__setattr__(self, "G_s", self.E / (2 * (1 + self.Poisson)))
        if self.Poisson is None:
            object.__setattr__(self, "Poisson", self.E / (2 * self.G_s) - 1)
        positive(f"material {self.name!r}", G_s=self.G_s)
        if not isclose(self.E, 2 * self.G_s * (1 + self.Poisson), rel_tol=1e-9):
            raise ShaftError(
                f"material {self.name!r}: G_s = {self.G_s:g} Pa and Poisson = {self.Poisson:g} contradict "
                f"E = {self.E:g} Pa (E = 2 G_s (1 + Poisson)); give only one of them."
            )


steel = Material("steel", rho=7810.0, E=211e9, G_s=81.2e9)
"""Steel: 7810 kg/m3, 211 GPa, shear modulus 81.2 GPa."""


@dataclass(frozen=True)
class ShaftElement:
    """One piece of shaft between two nodes: a cylinder, a tube or a cone.

    Parameters
    ----------
    L : float
        Length [m].
    idl, odl : float
        Inner and outer diameter at the left end [m].
    idr, odr : float, optional
        The same at the right end [m]; default to the left end. Between the ends they are linear.
    material : Material
    n : int, optional
        Number of the element, which is the number of its left node; by default its place in the rotor's list. Elements
        of one number are layers of one span and share its nodes.
    shear_effects, rotary_inertia, gyroscopic : bool
        Switches of the three terms that a Timoshenko element has beyond an Euler element.
    axial_force : float
        Tension, positive when it pulls [N]; it stiffens the shaft.
    torque : float
        Torque that the element carries, positive about +z on its right end [N m].
    alpha, beta : float
        Damping at rest: C = alpha M [1/s] + beta K [s].
    eta_v : float
        Viscous material damping in the turning frame [s]: C = eta_v K, and a circulatory stiffness Omega eta_v N.
    eta_h : float
        Hysteretic material damping in the turning frame, the loss factor of the shaft [1]; for answers in frequency.
    internal : bool
        Two internal coordinates in each plane (elements.py): error of fourth instead of second order.
    stiff : bool
        False for a layer that carries mass alone, such as a sleeve with a loose fit.

    Raises
    ------
    ShaftError
        If a size or a damping is impossible.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.ShaftElement(0.25, 0.0, 0.05, odr=0.04, material=fe_shaft.steel).odr
    0.04
    """

    L: float
    idl: float
    odl: float
    idr: float = None  # type: ignore[assignment]  # a float after __post_init__
    odr: float = None  # type: ignore[assignment]
    material: Material = steel
    n: int | None = None
    shear_effects: bool = True
    rotary_inertia: bool = True
    gyroscopic: bool = True
    axial_force: float = 0.0
    torque: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    eta_v: float = 0.0
    eta_h: float = 0.0
    internal: bool = False
    stiff: bool = True

    def __post_init__(self) -> None:
        """Fill in the right end and refuse impossible shapes."""
        object.__setattr__(self, "idr", self.idl if self.idr is None else self.idr)
        object.__setattr__(self, "odr", self.odl if self.odr is None else self.odr)
        positive("shaft element", L=self.L, odl=self.odl, odr=self.odr)
        for side, inner, outer in (("l", self.idl, self.odl), ("r", self.idr, self.odr)):
            if not 0 <= inner < outer:
                raise ShaftError(
                    f"shaft element: id{side} = {inner:g} m must be at least 0 and below od{side} = {outer:g} m."
                )
        finite("shaft element", axial_force=self.axial_force, torque=self.torque)
        damping = {name: getattr(self, name) for name in ("alpha", "beta", "eta_v", "eta_h")}
        not_negative("shaft element", **damping)

    @property
    def tapered(self) -> bool:
        """Whether the ends differ."""
        return (self.idr, self.odr) != (self.idl, self.odl)

    @property
    def area(self) -> float:
        """Area of the cross section at the left end [m2]."""
        return pi / 4 * (self.odl**2 - self.idl**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter at the left end [m4]."""
        return pi / 64 * (self.odl**4 - self.idl**4)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        outer = self.odl**2 + self.odl * self.odr + self.odr**2
        inner = self.idl**2 + self.idl * self.idr + self.idr**2
        return self.material.rho * self.L * pi / 12 * (outer - inner)


@dataclass(frozen=True)
class DiskElement:
    """Rigid disc on node `n`: mass `m` [kg], diametral and polar moments of inertia `Id`, `Ip` [kg m2].

    Its centre of gravity, to which `Id` belongs, stands at `offset` [m] from the node along z, on a rigid arm.
    `alpha` damps it at rest as that of a shaft element does: C = alpha M [1/s].

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.DiskElement(2, m=1.5, Id=2e-3, Ip=4e-3).Ip
    0.004
    """

    n: int
    m: float
    Id: float
    Ip: float
    alpha: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse negative inertia."""
        finite(f"disc at node {self.n}", offset=self.offset)
        if not (min(self.m, self.Id, self.Ip) >= 0 and isfinite(self.m + self.Id + self.Ip)):
            raise ShaftError(
                f"disc at node {self.n}: m = {self.m:g} kg, Id = {self.Id:g}, Ip = {self.Ip:g} kg m2; "
                "none may be negative or NaN."
            )
        not_negative(f"disc at node {self.n}", alpha=self.alpha)

    @classmethod
    def from_geometry(cls, n: int, material: Material, width: float, i_d: float, o_d: float) -> DiskElement:
        """Ring of `width`, bore `i_d` and outer diameter `o_d` [m] on node `n` (equations of the module).

        Raises
        ------
        ShaftError
            If the width or the ring's wall is not positive.
        """
        positive(f"disc at node {n}", width=width)
        if not 0 <= i_d < o_d:
            raise ShaftError(f"disc at node {n}: bore {i_d:g} m must be at least 0 and below o_d = {o_d:g} m.")
        m = material.rho * pi / 4 * (o_d**2 - i_d**2) * width
        Ip = m / 8 * (o_d**2 + i_d**2)
        return cls(n, m, Ip / 2 + m * width**2 / 12, Ip)


@dataclass(frozen=True)
class PointMass:
    """Mass `m` [kg] without inertia on node `n`, for instance the pedestal under a bearing; `mx`, `my` override it.

    `alpha` damps it at rest: C = alpha M [1/s].

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.PointMass(7, m=5.0).m
    5.0
    """

    n: int
    m: float = 0.0
    mx: float = None  # type: ignore[assignment]  # a float after __post_init__
    my: float = None  # type: ignore[assignment]
    alpha: float = 0.0

    def __post_init__(self) -> None:
        """Fill in both directions; refuse negative mass."""
        object.__setattr__(self, "mx", self.m if self.mx is None else self.mx)
        object.__setattr__(self, "my", self.m if self.my is None else self.my)
        if not min(self.mx, self.my) >= 0:
            raise ShaftError(
                f"point mass at node {self.n}: mx = {self.mx:g} kg, my = {self.my:g} kg; none may be negative or NaN."
            )
        not_negative(f"point mass at node {self.n}", alpha=self.alpha)


_NAMES = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
HOLD = "hold"


@dataclass(frozen=True, eq=False)
class BearingElement:
    """Linear bearing on node `n`.

    Parameters
    ----------
    n : int
        Node.
    kxx, kxy, kyx, kyy : float or array
        Stiffness [N/m]; `kyy` defaults to `kxx`, the cross terms to 0. An array is a table: (n_speed,), or
        (n_speed, n_whirl) where both axes are given, or (n_whirl,) with `whirl_frequency` alone.
    cxx, cxy, cyx, cyy : float or array
        Damping [N s/m]; `cyy` defaults to `cxx`, the cross terms to 0.
    frequency : array (n_speed,), optional
        Speeds of the shaft at which the tables stand [rad/s], ascending from 0 or above; a shaft that turns the other
        way has the same table with cross terms of the opposite sign.
    whirl_frequency : array (n_whirl,), optional
        Whirl frequencies at which the tables stand [rad/s], ascending.
    n_link : int, optional
        Node that carries the bearing; the ground without it. A number behind the shaft's last node is a pedestal,
        which moves in x and y and needs a PointMass and a bearing of its own.
    extrapolate : {'error', 'hold'}
        What to do outside a table.
    mxx, myy : float
        Mass that moves with the shaft against the ground or `n_link` [kg], as gas or oil in a seal does; no weight.

    Raises
    ------
    ShaftError
        If a table holds NaN, is unsorted, does not fit its axes or begins below 0.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.BearingElement(0, kxx=[1e6, 2e6], cxx=[100.0, 80.0], frequency=[0.0, 500.0]).n
    0
    """

    n: int
    kxx: ArrayLike
    cxx: ArrayLike
    kyy: ArrayLike | None = None
    kxy: ArrayLike = 0.0
    kyx: ArrayLike = 0.0
    cyy: ArrayLike | None = None
    cxy: ArrayLike = 0.0
    cyx: ArrayLike = 0.0
    frequency: ArrayLike | None = None
    whirl_frequency: ArrayLike | None = None
    n_link: int | None = None
    extrapolate: str = "error"
    mxx: float = 0.0
    myy: float = 0.0

    def __post_init__(self) -> None:
        """Make the bearing isotropic where the y direction is not given; check the tables."""
        owner = f"bearing at node {self.n}"
        for name, other in (("kyy", "kxx"), ("cyy", "cxx")):
            if getattr(self, name) is None:
                object.__setattr__(self, name, getattr(self, other))
        for axis in ("frequency", "whirl_frequency"):
            if getattr(self, axis) is not None:
                object.__setattr__(self, axis, _from_rest(f"{owner}: {axis} [rad/s]", getattr(self, axis)))
        if self.extrapolate not in ("error", HOLD):
            raise ShaftError(f"{owner}: extrapolate = {self.extrapolate!r}; choose 'error' or 'hold'.")
        finite(owner, mxx=self.mxx, myy=self.myy)
        not_negative(owner, mxx=self.mxx, myy=self.myy)
        for name in _NAMES:
            object.__setattr__(self, name, self._checked(name, owner))

    @property
    def axes(self) -> tuple[NDArray[np.float64], ...]:
        """Axes of the tables [rad/s]: speed, whirl frequency, as far as they are given."""
        return tuple(np.asarray(a) for a in (self.frequency, self.whirl_frequency) if a is not None)

    @property
    def constant(self) -> bool:
        """Whether no coefficient depends on speed or whirl frequency."""
        return not self.axes

    def _checked(self, name: str, owner: str) -> Any:
        value = np.asarray(getattr(self, name), dtype=float)
        if not np.all(np.isfinite(value)):
            raise ShaftError(f"{owner}: {name} holds {value[~np.isfinite(value)].flat[0]:g}; give finite numbers only.")
        if value.ndim == 0:
            return float(value)
        sizes = tuple(len(axis) for axis in self.axes)
        if value.shape != sizes:
            raise ShaftError(
                f"{owner}: {name} has shape {value.shape}, but its axes have {sizes or 'no'} entries; "
                "give `frequency` and `whirl_frequency` that fit."
            )
        return value

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Stiffness (2, 2) [N/m] of a constant bearing, else of the tables' first entry."""
        return self._matrix("k", lambda value: np.asarray(value).flat[0])

    @property
    def damping(self) -> NDArray[np.float64]:
        """Damping (2, 2) [N s/m] of a constant bearing, else of the tables' first entry."""
        return self._matrix("c", lambda value: np.asarray(value).flat[0])

    def stiffness_at(self, speed: float, whirl: float | None = None) -> NDArray[np.float64]:
        """Stiffness (2, 2) [N/m] at `speed` [rad/s], the mirror image's where it is negative.

        The `whirl` frequency is the speed where it is not given.
        """
        return self._at("k", speed, whirl)

    def damping_at(self, speed: float, whirl: float | None = None) -> NDArray[np.float64]:
        """Damping (2, 2) [N s/m], likewise."""
        return self._at("c", speed, whirl)

    def _at(self, kind: str, speed: float, whirl: float | None) -> NDArray[np.float64]:
        if self.constant:
            return self._matrix(kind, lambda value: value)
        point = {"frequency": abs(speed), "whirl_frequency": abs(speed if whirl is None else whirl)}
        weights = [self._weights(axis, x) for axis, x in point.items() if getattr(self, axis) is not None]
        found = self._matrix(kind, lambda value: _contract(value, weights))
        return mirrored(found) if speed < 0 and self.frequency is not None else found

    def _matrix(self, kind: str, read: Any) -> NDArray[np.float64]:
        return np.array([[read(getattr(self, f"{kind}{row}{column}")) for column in "xy"] for row in "xy"], dtype=float)

    def _weights(self, axis: str, x: float) -> NDArray[np.float64]:
        """Weights (n,) of the entries along an axis."""
        grid = np.asarray(getattr(self, axis))
        if not grid[0] * (1 - 1e-9) - 1e-9 <= x <= grid[-1] * (1 + 1e-9) and self.extrapolate != HOLD:
            what = "speed" if axis == "frequency" else "whirl frequency"
            raise ShaftError(
                f"bearing at node {self.n}: {what} {x:g} rad/s is outside its table, {grid[0]:g} to {grid[-1]:g} "
                "rad/s; extend the table or set extrapolate='hold'."
            )
        return np.array([np.interp(x, grid, unit) for unit in np.eye(len(grid))])


def mirrored(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (..., 2, 2) of the mirror image, y to -y: cross terms change their sign.

    Examples
    --------
    >>> import numpy as np
    >>> from fe_shaft.shaft import mirrored
    >>> mirrored(np.array([[2.0, 1.0], [-1.0, 2.0]])).tolist()
    [[2.0, -1.0], [1.0, 2.0]]
    """
    return coefficients * np.array([[1.0, -1.0], [-1.0, 1.0]])


def _from_rest(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """An ascending axis (n,) of magnitudes; raises ShaftError for a negative one."""
    found = grid(name, values)
    if found[0] < 0:
        raise ShaftError(
            f"{name}: the table begins at {found[0]:g}; begin at 0 or above, negative ones are the mirror image."
        )
    return found


def _contract(value: Any, weights: list[NDArray[np.float64]]) -> float:
    if np.ndim(value) == 0:
        return float(value)
    for weight in weights:
        value = weight @ value
    return float(value)

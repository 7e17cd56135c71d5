r"""What a rotor is made of: materials, shaft pieces, discs and linear bearings (values only, no matrices).

A disc is rigid and thin enough to sit on one node.  A ring of width w, bore d_i and diameter d_o has

.. math:: m = \tfrac{\pi}{4}\rho w (d_o^2 - d_i^2), \quad I_p = \tfrac{m}{8}(d_o^2 + d_i^2), \quad
          I_d = \tfrac{I_p}{2} + \tfrac{m w^2}{12}

Source: Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isclose, pi

import numpy as np
from numpy.typing import NDArray


def _positive(owner: str, **values: float) -> None:
    for name, value in values.items():
        if not value > 0:
            raise ValueError(f"{owner}: {name} = {value:g} must be positive.")


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
    ValueError
        If a modulus or the density is not positive, or if `G_s` and `Poisson` are both missing or contradict.
    """

    name: str
    rho: float
    E: float
    G_s: float = None  # type: ignore[assignment]  # a float after __post_init__
    Poisson: float = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        """Derive the missing elastic constant and check the rest."""
        _positive(f"material {self.name!r}", rho=self.rho, E=self.E)
        if self.G_s is None and self.Poisson is None:
            raise ValueError(f"material {self.name!r}: shear stiffness unknown; give G_s [Pa] or Poisson.")
        if self.G_s is None:
            object.__setattr__(self, "G_s", self.E / (2 * (1 + self.Poisson)))
        if self.Poisson is None:
            object.__setattr__(self, "Poisson", self.E / (2 * self.G_s) - 1)
        _positive(f"material {self.name!r}", G_s=self.G_s)
        if not isclose(self.E, 2 * self.G_s * (1 + self.Poisson), rel_tol=1e-9):
            raise ValueError(
                f"material {self.name!r}: G_s = {self.G_s:g} Pa and Poisson = {self.Poisson:g} contradict "
                f"E = {self.E:g} Pa (E = 2 G_s (1 + Poisson)); give only one of them."
            )


steel = Material("steel", rho=7810.0, E=211e9, G_s=81.2e9)


@dataclass(frozen=True)
class ShaftElement:
    """One cylindrical piece of shaft between two nodes.

    Parameters
    ----------
    L : float
        Length [m].
    idl, odl : float
        Inner and outer diameter at the left end [m].
    idr, odr : float, optional
        The same at the right end [m]; default to the left end, and must equal it.
    material : Material
    n : int, optional
        Number of the element, which is the number of its left node; by default its place in the rotor's list.
    shear_effects, rotary_inertia, gyroscopic : bool
        Switches of the three terms that a Timoshenko element has beyond an Euler element.

    Raises
    ------
    ValueError
        If a size is impossible or the element is tapered.
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

    def __post_init__(self) -> None:
        """Fill in the right end and refuse impossible shapes."""
        object.__setattr__(self, "idr", self.idl if self.idr is None else self.idr)
        object.__setattr__(self, "odr", self.odl if self.odr is None else self.odr)
        _positive("shaft element", L=self.L, odl=self.odl)
        if not 0 <= self.idl < self.odl:
            raise ValueError(f"shaft element: idl = {self.idl:g} m must be at least 0 and below odl = {self.odl:g} m.")
        if (self.idr, self.odr) != (self.idl, self.odl):
            raise ValueError(
                f"shaft element: tapered from {self.idl:g}/{self.odl:g} m to {self.idr:g}/{self.odr:g} m "
                "(inner/outer diameter), but only cylinders are modelled; use several short cylinders."
            )

    @property
    def area(self) -> float:
        """Area of the cross section [m2]."""
        return pi / 4 * (self.odl**2 - self.idl**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter [m4]."""
        return pi / 64 * (self.odl**4 - self.idl**4)

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.material.rho * self.area * self.L


@dataclass(frozen=True)
class DiskElement:
    """Rigid disc on node `n`: mass `m` [kg], diametral and polar moments of inertia `Id`, `Ip` [kg m2]."""

    n: int
    m: float
    Id: float
    Ip: float

    def __post_init__(self) -> None:
        """Refuse negative inertia."""
        if min(self.m, self.Id, self.Ip) < 0:
            raise ValueError(
                f"disc at node {self.n}: m = {self.m:g} kg, Id = {self.Id:g}, Ip = {self.Ip:g} kg m2; "
                "none may be negative."
            )

    @classmethod
    def from_geometry(cls, n: int, material: Material, width: float, i_d: float, o_d: float) -> DiskElement:
        """Ring of `width`, bore `i_d` and outer diameter `o_d` [m] on node `n` (equations of the module).

        Raises
        ------
        ValueError
            If the width or the ring's wall is not positive.
        """
        _positive(f"disc at node {n}", width=width)
        if not 0 <= i_d < o_d:
            raise ValueError(f"disc at node {n}: bore {i_d:g} m must be at least 0 and below o_d = {o_d:g} m.")
        m = material.rho * pi / 4 * (o_d**2 - i_d**2) * width
        Ip = m / 8 * (o_d**2 + i_d**2)
        return cls(n, m, Ip / 2 + m * width**2 / 12, Ip)


@dataclass(frozen=True)
class BearingElement:
    """Linear bearing from node `n` to the ground; the force on the shaft is -[k] (x, y) - [c] (dx, dy).

    Parameters
    ----------
    n : int
        Node.
    kxx, kxy, kyx, kyy : float
        Stiffness [N/m]; `kyy` defaults to `kxx`, the cross terms to 0.
    cxx, cxy, cyx, cyy : float
        Damping [N s/m]; `cyy` defaults to `cxx`, the cross terms to 0.
    """

    n: int
    kxx: float
    cxx: float
    kyy: float = None  # type: ignore[assignment]  # a float after __post_init__
    kxy: float = 0.0
    kyx: float = 0.0
    cyy: float = None  # type: ignore[assignment]
    cxy: float = 0.0
    cyx: float = 0.0

    def __post_init__(self) -> None:
        """Make the bearing isotropic where the y direction is not given."""
        object.__setattr__(self, "kyy", self.kxx if self.kyy is None else self.kyy)
        object.__setattr__(self, "cyy", self.cxx if self.cyy is None else self.cyy)

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Stiffness matrix (2, 2) [N/m]."""
        return np.array([[self.kxx, self.kxy], [self.kyx, self.kyy]], dtype=float)

    @property
    def damping(self) -> NDArray[np.float64]:
        """Damping matrix (2, 2) [N s/m]."""
        return np.array([[self.cxx, self.cxy], [self.cyx, self.cyy]], dtype=float)

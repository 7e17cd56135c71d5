r"""Rigid masses on a node: discs and point masses.

A disc is rigid and thin enough to sit on one node.  A ring of width w, bore d_i and diameter d_o has

.. math:: m = \tfrac{\pi}{4}\rho w (d_o^2 - d_i^2), \quad I_p = \tfrac{m}{8}(d_o^2 + d_i^2), \quad
          I_d = \tfrac{I_p}{2} + \tfrac{m w^2}{12}

Source: Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines (2010), chapter 5.

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi

from fe_shaft.checks import ShaftError, not_negative, positive
from fe_shaft.shaft import Material


@dataclass(frozen=True)
class DiskElement:
    """Rigid disc on node `n`: mass `m` [kg], diametral and polar moments of inertia `Id`, `Ip` [kg m2].

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

    def __post_init__(self) -> None:
        """Refuse negative inertia."""
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

r"""Gas film of a thrust bearing: a ring of even gap, plain or with spiral grooves, by narrow-groove theory.

The faces stay parallel, so that pressure and gap have the same value all round. With s = ln r the annulus is a strip on
which the film's equation is that of `reynolds.residual`, and spirals of one angle are straight:

.. math:: r^2\,\partial_t(p\,\bar H) + \partial_s \Phi = 0, \qquad
          \Phi = \pm\frac{\Omega r^2}{2}\sin\beta\cos\beta\,(S - T)\,p
                 - \frac{A\sin^2\beta + B\cos^2\beta}{24\mu}\,\partial_s p^2

Phi [W/rad] is the mass flow outwards times R_g T, + for grooves that pump outwards; A, B, S, T are those of a patch of
`reynolds.texture`, H its mean thickness, beta the angle between grooves and circumference. The torque is that on the
smooth face, the same for grooves in the runner or in the plate,

.. math:: M = 2\pi\int r^2\left(\mu\Omega r\left(\overline{1/h} + 3\sin^2\!\beta\,(W - T^2/B)\right)
              \pm \tfrac12\sin\beta\cos\beta\,(S - T)\,\partial_r p\right)\mathrm dr

with W the mean of 1/h of groove and ridge. Nodes are exact for a plain ring and for grooves without flow; loads
converge with the square of the step. Assumes: ideal isothermal gas, no inertia, parallel faces, so many grooves that
the pressure hardly changes across one.

Source: Muijderman (1966), Malanoski & Pan (1965); Vohr & Chow (1965) for the mean flow.

Cites: hamrock_2004, malanoski_1965, muijderman_1966, vohr_1965.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_banded

from reynolds.grid import FilmError
from reynolds.injector import nozzle, nozzle_coefficients, nozzle_table
from reynolds.sleeve import RingFeed, SpiralGrooves
from reynolds.texture import mean_flow
from rotorsim.base.units import TO_UM

Array = NDArray[np.float64]
STEP = 1e-20
"""Imaginary step, relative to the value, of a derivative."""
ITERATIONS = 60
"""Most iterations of a steady film."""
TOLERANCE = 1e-12
"""Relative change of pressure at which they end."""
LEAST = 0.3
"""Smallest share of a pressure that an iteration leaves."""


@dataclass(frozen=True)
class SteadyThrust:
    """Steady thrust film: absolute pressure (n,) [Pa] at the radii `r` (n,) [m], and what follows from it.

    `load` [N] pushes the faces apart, `friction_torque` [N m] is against the rotation, `flow` [kg/s] leaves the film at
    its outer edge and `inner_flow` enters it at the inner one.
    """

    r: Array
    pressure: Array
    load: float
    friction_torque: float
    flow: float
    inner_flow: float


@dataclass(frozen=True)
class GasThrustBearing:
    """A gas thrust bearing with inner and outer radius [m].

    The outer edge is open to the ambient; the inner one is 'open' to it too, 'closed', or 'fed' with the supply
    pressure, through `feed` if there are orifices. The pressure of a closed or fed inner edge acts down to the hub.

    Examples
    --------
    >>> import reynolds
    >>> ring = reynolds.GasThrustBearing(0.01, 0.03, inner_edge="fed")
    >>> round(ring.steady(20e-6, supply_pressure=0.4e6).load, 1)
    451.2
    """

    inner_radius: float
    outer_radius: float
    grooves: SpiralGrooves | None = None
    viscosity: float = 1.85e-5
    ambient_pressure: float = 101325.0
    temperature: float = 293.15
    gas_constant: float = 287.05
    heat_capacity_ratio: float = 1.4
    mean_free_path: float = field(default=0.0, kw_only=True)
    """Mean free path [m] at ambient pressure of a gas that slips at the walls."""
    inner_edge: Literal["open", "closed", "fed"] = field(default="open", kw_only=True)
    hub_radius: float | None = field(default=None, kw_only=True)
    """Radius [m] within which the pressure of the inner edge does not act; None for the inner radius."""
    feed: RingFeed | None = field(default=None, kw_only=True)
    n_radial: int = field(default=128, kw_only=True)
    """Intervals from edge to edge, at least."""

    def __post_init__(self) -> None:
        if not 0 < self.inner_radius < self.outer_radius:
            raise FilmError(
                f"inner_radius = {self.inner_radius} m: must be above 0 and below {self.outer_radius} m",
                argument="inner_radius", value=self.inner_radius,
            )  # fmt: skip
        if not 0 <= self.hub < self.inner_radius * (1 + 1e-12):
            raise FilmError(
                f"hub_radius = {self.hub} m: must be 0 to {self.inner_radius} m", argument="hub_radius", value=self.hub
            )
        if self.grooves is not None and not self.grooves.land < self.outer_radius - self.inner_radius:
            raise FilmError(
                f"land = {self.grooves.land} m: leaves no grooves; make it narrower",
                argument="land",
                value=self.grooves.land,
            )

    @property
    def hub(self) -> float:
        """Radius [m] within which the pressure of the inner edge does not act."""
        return self.inner_radius if self.hub_radius is None else self.hub_radius

    @cached_property
    def _recess(self) -> float:
        """Area over 2 pi [m^2] inside the inner edge that its pressure acts on."""
        return 0.0 if self.inner_edge == "open" else 0.5 * (self.inner_radius**2 - self.hub**2)

    @cached_property
    def _rings(self) -> tuple[Array, Array, Array]:
        """Radii (n + 1,) [m] of the nodes, one at the land's edge, and groove depth [m] and share (n,) between them."""
        low, high, grooves = self.inner_radius, self.outer_radius, self.grooves
        if grooves is None:
            r = np.geomspace(low, high, self.n_radial + 1)
            return r, np.zeros(self.n_radial), np.zeros(self.n_radial)
        inwards = grooves.pumps == "inwards"
        edge = low + grooves.land if inwards else high - grooves.land
        inside = np.geomspace(low, edge, self._intervals(low, edge) + 1)
        r = np.concatenate([inside[:-1], np.geomspace(edge, high, self._intervals(edge, high) + 1)])
        grooved = (0.5 * (r[1:] + r[:-1]) > edge) == inwards
        return r, np.where(grooved, grooves.depth, 0.0), np.where(grooved, grooves.share, 0.0)

    def _intervals(self, low: float, high: float) -> int:
        share = np.log(high / low) / np.log(self.outer_radius / self.inner_radius)
        return int(np.ceil(self.n_radial * share - 1e-9))

    @cached_property
    def _step(self) -> Array:
        return np.diff(np.log(self._rings[0]))

    @cached_property
    def _squares(self) -> Array:
        """Mean (n,) of r^2 [m^2] over ln r between the nodes."""
        return np.asarray(0.5 * np.diff(self._rings[0] ** 2) / self._step)

    @cached_property
    def _halves(self) -> tuple[Array, Array]:
        """Areas over 2 pi (n,) [m^2] of the inner and the outer half of every ring between two nodes."""
        r = self._rings[0]
        middle = r[1:] * r[:-1]
        return 0.5 * (middle - r[:-1] ** 2), 0.5 * (r[1:] ** 2 - middle)

    @property
    def _direction(self) -> tuple[float, float]:
        """Angle [rad] of the grooves and the sign of what they pump, + outwards."""
        grooves = self.grooves
        return (0.0, 0.0) if grooves is None else (grooves.angle, 1.0 if grooves.pumps == "outwards" else -1.0)

    def _means(self, gap: complex, pressure: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        """A, B [m^3], S, T [m] of every ring at its mean pressure."""
        _, depth, share = self._rings
        slip = 6 * self.mean_free_path * self.ambient_pressure / pressure
        A, B, S, T = getattr(mean_flow, "py_func", mean_flow)(gap, depth, share, slip)
        return A, B, S + 0 * slip, T + 0 * slip

    def _flows(self, gap: complex, speed: float, inner: NDArray[Any], outer: NDArray[Any]) -> NDArray[Any]:
        """Mass flow outwards times R_g T over 2 pi (n,) through every ring, from the pressures of its two nodes."""
        pressure = 0.5 * (inner + outer)
        A, B, S, T = self._means(gap, pressure)
        angle, sign = self._direction
        pumped = 0.5 * sign * speed * self._squares * np.sin(angle) * np.cos(angle) * (S - T) * pressure
        conductance = (A * np.sin(angle) ** 2 + B * np.cos(angle) ** 2) / (24 * self.viscosity)
        return np.asarray(pumped - conductance * (outer**2 - inner**2) / self._step)

    def _supplied(self, pressure: float, supply: float) -> tuple[float, float]:
        """Mass flow of the orifices into the inner edge, as `_flows`, and its derivative after the pressure there."""
        if self.feed is None:
            return 0.0, 0.0
        table = nozzle_coefficients(self.heat_capacity_ratio, self.gas_constant, self.temperature)
        plain = getattr(nozzle_table, "py_func", nozzle_table)(table, 0)
        flow, _, slope = nozzle.py_func(supply, pressure, plain)
        scale = self.feed.open_area * self.gas_constant * self.temperature / (2 * pi)
        return scale * flow, scale * slope

    @property
    def _held(self) -> bool:
        """Whether the pressure of the inner edge is given."""
        return self.inner_edge == "open" or (self.inner_edge == "fed" and self.feed is None)

    def _jacobian(self, gap: float, speed: float, p: Array, slope: float) -> Array:
        """Derivatives (3, n + 1) of every node's balance after the pressures, as `solve_banded` takes them."""
        step = STEP * self.ambient_pressure
        inner, outer = p[:-1], p[1:]
        by_inner = self._flows(gap, speed, inner + 1j * step, outer).imag / step
        by_outer = self._flows(gap, speed, inner, outer + 1j * step).imag / step
        rows = np.zeros((3, p.size))
        rows[1, :-1] += by_inner
        rows[1, 1:] -= by_outer
        rows[0, 1:], rows[2, :-1] = by_outer, -by_inner
        rows[1, 0] -= slope
        rows[1, -1], rows[2, -2] = 1.0, 0.0
        if self._held:
            rows[1, 0], rows[0, 1] = 1.0, 0.0
        return rows

    def _solve(self, gap: float, speed: float, supply: float) -> Array:
        """Pressures (n + 1,) [Pa] of the steady film."""
        if not gap > 0:
            raise FilmError(
                f"film: h = {gap * TO_UM:.3g} um: the faces touch; move them apart", argument="gap", value=gap
            )
        pa = self.ambient_pressure
        edge = supply if self.inner_edge == "fed" else pa
        along = np.log(self._rings[0] / self.inner_radius) / np.log(self.outer_radius / self.inner_radius)
        p = np.sqrt(edge**2 + (pa**2 - edge**2) * along)
        for _ in range(ITERATIONS):
            flows = self._flows(gap, speed, p[:-1], p[1:])
            balance = np.zeros_like(p)
            balance[:-1] += flows
            balance[1:] -= flows
            fed, slope = self._supplied(float(p[0]), supply)
            balance[0] -= fed
            balance[-1] = 0.0
            if self._held:
                balance[0] = 0.0
            change = solve_banded((1, 1), self._jacobian(gap, speed, p, slope), -balance)
            p = np.maximum(p + change, LEAST * p)
            if np.abs(change).max() < TOLERANCE * p.max():
                return np.asarray(p)
        raise FilmError(
            f"film: no steady thrust film at a gap of {gap * TO_UM:.3g} um, speed {speed} rad/s; refine n_radial"
        )

    def steady(self, gap: float, speed: float = 0.0, supply_pressure: float = 0.0) -> SteadyThrust:
        """Steady film at a gap [m] over the ridges, a speed [rad/s] and a gauge supply pressure [Pa].

        Raises FilmError where the faces touch or nothing converges.

        Examples
        --------
        >>> from reynolds.thrust import GasThrustBearing, SpiralGrooves
        >>> spiral = GasThrustBearing(5e-3, 12e-3, SpiralGrooves(15e-6, 0.6, 0.3, 2e-3))
        >>> spiral.steady(8e-6, speed=6000.0).load > spiral.steady(12e-6, speed=6000.0).load
        True
        """
        p = self._solve(gap, speed, supply_pressure + self.ambient_pressure)
        flows = self._flows(gap, speed, p[:-1], p[1:]) * 2 * pi / (self.gas_constant * self.temperature)
        return SteadyThrust(self._rings[0], p, float(self._push @ (p - self.ambient_pressure)),
                            self._torque(gap, speed, p), float(flows[-1]), float(flows[0]))  # fmt: skip

    @cached_property
    def _push(self) -> Array:
        """Areas (n + 1,) [m^2] that the pressure of every node acts on."""
        inner, outer = self._halves
        area = np.concatenate([inner, [0.0]]) + np.concatenate([[0.0], outer])
        area[0] += self._recess
        return np.asarray(2 * pi * area)

    def _torque(self, gap: float, speed: float, p: Array) -> float:
        r, depth, share = self._rings
        pressure = 0.5 * (p[1:] + p[:-1])
        _, B, S, T = self._means(gap, pressure)
        angle, sign = self._direction
        slip = 6 * self.mean_free_path * self.ambient_pressure / pressure
        shear = share / (gap + depth + slip / 3) + (1 - share) / (gap + slip / 3)
        W = share / (gap + depth + slip) + (1 - share) / (gap + slip)
        sheared = self.viscosity * speed * (shear + 3 * np.sin(angle) ** 2 * (W - T**2 / B)) * np.diff(r**4) / 4
        leant = 0.5 * sign * np.sin(angle) * np.cos(angle) * (S - T) * self._squares * np.diff(p)
        return float(2 * pi * (sheared + leant).sum())

    def dynamic_stiffness(
        self, gap: float, speed: float = 0.0, supply_pressure: float = 0.0, s: ArrayLike = 0.0
    ) -> NDArray[np.complex128]:
        """K + s C (n,) [N/m] at complex frequencies s (n,) [1/s]: the load that a gap wider by exp(s t) takes away.

        Examples
        --------
        >>> import reynolds
        >>> ring = reynolds.GasThrustBearing(0.01, 0.03)
        >>> bool(ring.dynamic_stiffness(20e-6, s=1e3j)[0].imag > 0)
        True
        """
        supply = supply_pressure + self.ambient_pressure
        p = self._solve(gap, speed, supply)
        step = STEP * gap
        opened = self._flows(gap + 1j * step, speed, p[:-1], p[1:]).imag / step
        by_gap = np.concatenate([opened, [0.0]]) - np.concatenate([[0.0], opened])
        held, opens = self._storage(gap, p)
        rows = self._jacobian(gap, speed, p, self._supplied(float(p[0]), supply)[1]).astype(complex)
        fixed = np.arange(p.size) == p.size - 1
        fixed[0] = self._held
        found = []
        for one in np.atleast_1d(np.asarray(s, complex)):
            matrix = rows.copy()
            matrix[1] += np.where(fixed, 0.0, one * held)
            found.append(self._push @ solve_banded((1, 1), matrix, np.where(fixed, 0.0, by_gap + one * opens)))
        return np.array(found)

    def _storage(self, gap: float, p: Array) -> tuple[Array, Array]:
        """Derivatives (n + 1,) of pressure times volume over 2 pi at every node after pressure and gap."""
        inner, outer = self._halves
        _, depth, share = self._rings
        thick = gap + depth * share
        held = np.concatenate([inner * thick, [0.0]]) + np.concatenate([[0.0], outer * thick])
        area = np.concatenate([inner, [0.0]]) + np.concatenate([[0.0], outer])
        held[0] += self._recess * gap
        area[0] += self._recess
        return held, area * p

    def coefficients(
        self, gap: float, speed: float = 0.0, frequency: ArrayLike = 0.0, supply_pressure: float = 0.0
    ) -> tuple[Array, Array]:
        """Axial stiffness K [N/m] and damping C [N s/m], each (n,), at frequencies (n,) [rad/s].

        Examples
        --------
        >>> import reynolds
        >>> K, C = reynolds.GasThrustBearing(0.01, 0.03).coefficients(20e-6, frequency=[100.0, 1e5])
        >>> bool(K[1] > K[0] and C[1] < C[0])
        True
        """
        omega = np.atleast_1d(np.asarray(frequency, float))
        rate = np.where(omega == 0, 1e-3, omega)
        Z = self.dynamic_stiffness(gap, speed, supply_pressure, 1j * rate)
        return Z.real, Z.imag / rate

"""Single gas journal bearing: steady state, frequency-dependent coefficients, march in time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reynolds import kernels
from reynolds.grid import FilmError, FilmGrid, Layout, cells
from reynolds.injector import Injector
from reynolds.perturbation import LinearFilm, common_kernels, dynamic_stiffness, linear_film, tilted_film
from reynolds.sleeve import PLAIN, Sleeve
from reynolds.transient import GAMMA, MID, STAGE, settle_film
from reynolds.workspace import FilmGas, FilmModel, interval_pressure
from rotorsim.base.units import TO_UM

Array = NDArray[np.float64]
NEARER = 0.4
"""Share of the smallest gap by which a journal comes nearer to a foil before the film settles again."""
TOO_NEAR = 1e-3
"""Smallest gap, in clearances, from which a journal comes nearer to a foil."""


@dataclass(frozen=True)
class SteadyFilm:
    """Steady film: pressure (n_theta, n_z) [Pa, absolute] at the interval centres `z`, force (2,) [N] on the journal.

    A pressure is the mean of the two adjacent nodes, so that the force is exactly the sum of (p - pa) over the
    cells where no edge of a pocket, land or lobe cuts them; `p_max` is the highest nodal value. `mass_flow` (n_inj,)
    [kg/s] through each injector into the film, `plenum` (n_inj,) [Pa, absolute], `friction_torque` [N m] against the
    rotation, `h_min` [m], `edge_flow` [kg/s] out of the two edges.
    """

    pressure: Array
    theta: Array
    z: Array
    force: Array
    mass_flow: Array
    plenum: Array
    edge_flow: float
    friction_torque: float
    h_min: float
    p_max: float
    converged: bool


@dataclass(frozen=True)
class Coefficients:
    """Dynamic coefficients (n_freq, 2, 2):  dF = -(K + i omega C) dX;  K [N/m], C [N s/m]."""

    K: Array
    C: Array
    whirl_frequency: Array


@dataclass(frozen=True)
class March:
    """A film marched in time: `force` (n, 2) [N] at every step's end and the relative `mass_defect` of the balance."""

    time: Array
    force: Array
    pressure: Array
    mass_defect: float


@dataclass(frozen=True)
class GasBearing:
    """A gas journal bearing with radius, length and clearance [m]; see `reynolds.residual` for the equation.

    Half the bearing is solved when it is symmetric about its midplane. n_theta is a multiple of 4; n_z, even, counts
    the intervals over the full length. Without supply pressure the injectors still vent the film.

    Examples
    --------
    >>> import reynolds
    >>> bearing = reynolds.GasBearing(0.02, 0.04, 25e-6, n_theta=32, n_z=8)
    >>> bearing.steady((5e-6, 0.0), speed=600.0).converged
    True
    """

    radius: float
    length: float
    clearance: float
    viscosity: float = 1.85e-5
    ambient_pressure: float = 101325.0
    temperature: float = 293.15
    gas_constant: float = 287.05
    injectors: tuple[Injector, ...] = ()
    n_theta: int = 64
    n_z: int = 16
    heat_capacity_ratio: float = 1.4
    mean_free_path: float = field(default=0.0, kw_only=True)
    """Mean free path [m] at ambient pressure of a gas that slips at the walls; about 68 nm in air."""
    symmetric: bool | None = field(default=None, kw_only=True)
    """Solve one half: True, False, or None to decide by the injectors and the sleeve."""
    sleeve: Sleeve = field(default=PLAIN, kw_only=True)
    """Form of the sleeve: lobes, steps, grooves, foil."""

    def __post_init__(self) -> None:
        for name in ("radius", "length", "viscosity", "ambient_pressure", "temperature", "gas_constant"):
            if not getattr(self, name) > 0:
                raise FilmError(f"{name} = {getattr(self, name)}: must be positive")

    @cached_property
    def model(self) -> FilmModel:
        """Grid, gas and injectors as the kernels' workspace takes them."""
        even = self.sleeve.symmetric and all(i.offset == 0 for i in self.injectors)
        half = even if self.symmetric is None else self.symmetric
        gas = FilmGas(
            self.viscosity, self.ambient_pressure, self.temperature, self.gas_constant, self.heat_capacity_ratio,
            self.mean_free_path,
        )  # fmt: skip
        grid = FilmGrid(self.radius, self.length, self.n_theta, self.n_z, half)
        return FilmModel(grid, self.clearance, gas, tuple(self.injectors), sleeve=self.sleeve)

    @cached_property
    def _built(self) -> tuple[Layout, Array, NDArray[np.int64]]:
        return self.model.build()

    def steady(
        self,
        journal: ArrayLike = (0.0, 0.0),
        speed: float = 0.0,
        supply_pressure: float = 0.0,
        pins: ArrayLike | None = None,
    ) -> SteadyFilm:
        """Steady film for a journal held at (X, Y) [m].

        speed [rad/s], supply_pressure [Pa, gauge], pins (n_inj,) [m] (None: each injector's own).
        Raises FilmError where the journal touches the sleeve or nothing converges.

        Examples
        --------
        >>> film = bearing.steady((5e-6, 0.0), speed=600.0)
        >>> bool(film.force[0] < 0)
        True
        """
        w, F, converged = self._solve(journal, speed, supply_pressure, pins)
        return self._result(w, F, speed, converged)

    def coefficients(
        self,
        journal: ArrayLike = (0.0, 0.0),
        speed: float = 0.0,
        whirl_frequency: ArrayLike = 0.0,
        supply_pressure: float = 0.0,
        pins: ArrayLike | None = None,
    ) -> Coefficients:
        """K and C (n_freq, 2, 2) at the whirl frequencies [rad/s] by linear perturbation of the steady film.

        Examples
        --------
        >>> bearing.coefficients((5e-6, 0.0), 600.0, [0.0, 300.0]).K.shape
        (2, 2, 2)
        """
        w, F, _ = self._solve(journal, speed, supply_pressure, pins)
        film = linear_film(self.model, self._built[0], w, self._built[2], F, speed, common_kernels(self._built[0]))
        return _over_frequency(film, whirl_frequency)

    def tilt_coefficients(
        self,
        journal: ArrayLike = (0.0, 0.0),
        speed: float = 0.0,
        whirl_frequency: ArrayLike = 0.0,
        supply_pressure: float = 0.0,
        pins: ArrayLike | None = None,
    ) -> Coefficients:
        """K [N m/rad] and C [N m s/rad] (n_freq, 2, 2) of the moment against tilts (dX/dz, dY/dz) of the journal.

        The moment is the integral of z times the force; the whole film is solved. Raises FilmError as `steady`, and for
        pockets and for lobes that jump.

        Examples
        --------
        >>> bearing.tilt_coefficients((5e-6, 0.0), 600.0, [0.0, 300.0]).K.shape
        (2, 2, 2)
        """
        whole = replace(self, symmetric=False)
        w, F, _ = whole._solve(journal, speed, supply_pressure, pins)
        layout, _, ix = whole._built
        film = tilted_film(whole.model, layout, w, ix, F, speed, common_kernels(layout))
        return _over_frequency(film, whirl_frequency)

    def march(
        self,
        path: Any,
        duration: float,
        dt: float,
        speed: float = 0.0,
        supply_pressure: float = 0.0,
        pins: ArrayLike | None = None,
        tolerance: float = 1e-9,
    ) -> March:
        """March the film from its steady state at path(0) with the journal at path(t) -> (X, Y) [m]; dt [s].

        Examples
        --------
        >>> path = lambda t: (5e-6 * np.cos(300.0 * t), 5e-6 * np.sin(300.0 * t))
        >>> bearing.march(path, 0.01, 1e-4, speed=600.0).force.shape
        (100, 2)
        """
        layout, _, ix = self._built
        w, F, _ = self._solve(path(0.0), speed, supply_pressure, pins)
        for array in (layout.p_1, layout.p_2, layout.p_3):
            w[array : array + layout.length] = w[layout.p : layout.p + layout.length]
        steps = round(duration / dt)
        begin = np.arange(steps) * dt
        times = np.concatenate([[0.0], np.stack([begin + GAMMA * dt, begin + dt], axis=1).ravel()])
        positions = np.array([path(t) for t in times], float)
        forces, flows = np.zeros((steps, 2)), np.zeros((2 * steps, 3))
        done = kernels.march_film(w, ix, F, layout, speed, dt, tolerance, positions, forces, flows)
        if done < 0:
            raise FilmError(f"film: no convergence with dt = {dt} s; take a smaller step")
        return March(times[2::2], forces, interval_pressure(self.model, layout, w), _mass_defect(flows, self.model, dt))

    def _solve(
        self, journal: ArrayLike, speed: float, supply_pressure: float, pins: ArrayLike | None
    ) -> tuple[Array, Any, bool]:
        layout, w0, ix = self._built
        w = w0.copy()
        position = np.asarray(journal, float)
        w[layout.journal : layout.journal + 2] = position
        F = self.model.record()[0]
        if not np.isfinite(position).all():
            raise FilmError(f"film: the journal at {position} m has no place; give two finite numbers")
        if layout.foil == 0:
            _apart(kernels.least_gap(w, F, layout))
        w[layout.static_a : layout.static_a + 4] = (1.0, 0.0, 0.0, 1.0)
        extensions = [i.pin for i in self.injectors] if pins is None else np.asarray(pins, float)
        if len(extensions) != len(self.injectors):
            raise FilmError(f"pins: {len(extensions)} values for {len(self.injectors)} injectors; give one each")
        for k, (injector, pin) in enumerate(zip(self.injectors, extensions, strict=True)):
            w[layout.pin_conductance + k] = injector.conductance(float(pin))
            w[layout.supply + k] = supply_pressure + self.ambient_pressure
        if not self._settle(w, ix, F, position, speed):
            raise FilmError(f"film: no steady state at journal {position}, speed {speed} rad/s; refine the grid")
        _apart(kernels.least_gap(w, F, layout))
        return w, F, True

    def _settle(self, w: Array, ix: NDArray[np.int64], F: Any, position: Array, speed: float) -> bool:
        """Bring the film to its steady state with the journal at a position [m]; whether it has one.

        Beyond the clearance the film has to bend a foil on the way: the journal comes near in steps.
        """
        layout, way = self._built[0], float(np.hypot(*position))
        near = layout.foil == 0 or way < self.clearance
        gone = way if near else 0.5 * self.clearance
        while True:
            w[layout.journal : layout.journal + 2] = position if gone == way else gone / way * position
            w[layout.static_rhs : layout.static_rhs + 2] = w[layout.journal : layout.journal + 2]
            if not settle_film(
                w, layout,
                lambda iadt, tolerance: kernels.pseudo_step(
                    w, ix, F, layout, speed * self.radius, iadt, tolerance, 0.0
                ),
            ):  # fmt: skip
                return False
            if gone == way:
                return True
            gap = float(kernels.least_gap(w, F, layout))
            if not gap > TOO_NEAR * self.clearance:
                return False
            gone = min(way, gone + NEARER * gap)

    def _result(self, w: Array, F: Any, speed: float, converged: bool) -> SteadyFilm:
        layout, model = self._built[0], self.model
        n = layout.n_inj
        escaping = _edge_flow(model, layout, w)
        return SteadyFilm(
            pressure=interval_pressure(model, layout, w),
            theta=model.grid.theta,
            z=model.grid.z,
            force=w[layout.force : layout.force + 2].copy(),
            mass_flow=w[layout.film_flow : layout.film_flow + n].copy(),
            plenum=w[layout.plenum : layout.plenum + n].copy(),
            edge_flow=escaping,
            friction_torque=float(kernels.friction_torque(w, F, layout, speed)),
            h_min=float(kernels.least_gap(w, F, layout)),
            p_max=float(w[layout.p + cells(layout)].max()),
            converged=converged,
        )


def _over_frequency(film: LinearFilm, frequency: ArrayLike) -> Coefficients:
    """K and C at frequencies [rad/s]; the damping at 0 is that of the slowest motion."""
    omega = np.atleast_1d(np.asarray(frequency, float))
    Z = np.stack([dynamic_stiffness(film, value) for value in omega])
    C = Z.imag / np.where(omega == 0, 1.0, omega)[:, None, None]
    for i in np.flatnonzero(omega == 0):
        C[i] = dynamic_stiffness(film, 1e-3).imag / 1e-3
    return Coefficients(Z.real, C, omega)


def _apart(gap: float) -> None:
    """Raise FilmError where the journal touches the sleeve: a gap [m] that is not positive."""
    if not gap > 0:
        raise FilmError(
            f"film: h_min = {gap * TO_UM:.3g} um: the journal touches the sleeve; move it inwards",
            argument="journal",
            value=gap,
        )


def _edge_flow(model: FilmModel, layout: Layout, w: Array) -> float:
    grid, gas = model.grid, model.gas
    last = layout.flow_z + layout.first + np.arange(layout.n_theta) * layout.stride + layout.n_rows - 1
    out = w[last].sum()
    if not grid.half:
        out -= w[last - layout.n_rows].sum()
    return float(out * grid.dy * grid.dz / (gas.gas_constant * gas.temperature) * (2 if grid.half else 1))


def _mass_defect(flows: Array, model: FilmModel, dt: float) -> float:
    """Largest |held - begun - in + out| over the march, relative to the mass injected (or held, without injection).

    The integrals are the method's own: a step of TR-BDF2 takes the rates of its start, its stage and its end with
    weights that follow from the two stage equations.
    """
    rate = flows[:, 0] * model.record()["source"][0] - flows[:, 1]
    held = flows[1::2, 2]
    mid, end = rate[0::2], rate[1::2]
    old = np.concatenate([[np.nan], end[:-1]])
    change = STAGE * dt * (MID * (old + mid) + end)
    defect = np.diff(held) - change[1:]
    injected = np.cumsum(flows[1::2, 0] * model.record()["source"][0] * dt)
    scale = injected[-1] if injected[-1] > 0 else held.mean()
    return float(np.abs(np.cumsum(defect)).max() / scale)

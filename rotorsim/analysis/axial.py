r"""Axial equilibrium and mode of a rotor between its thrust bearings.

A rotor of mass m that is displaced by z towards +z stands where the films carry the axial load F,

.. math:: \sum_k \sigma_k W_k(c_k + \sigma_k z) + F = 0,

sigma_k being the direction in which film k pushes, and swings about there with a frequency s of

.. math:: m s^2 + \sum_k Z_k(s) = 0,

Z_k(s) = K + s C the film's dynamic stiffness (`reynolds.thrust`), which depends on the frequency. Lateral motion and
tilt are left out: the faces stay parallel.

Cites: malanoski_1965.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from reynolds import FilmError
from reynolds.thrust import GasThrustBearing
from rotorsim.base.errors import ConvergenceError, DataError, NoLiftOffError
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.machine.gas_film import Gas, ThrustBearing
from rotorsim.machine.schema import Machine

NEAREST = 0.02
"""Smallest gap, in clearances, at which an equilibrium is looked for."""
FURTHEST = 20.0
"""Largest displacement, in clearances, that is looked at where one side has no film."""
DRAWN = 0.6
"""Largest displacement that is drawn, in clearances."""
POINTS = 31
"""Points of a curve."""
SAME = 1e-10
"""Relative change of a frequency at which its iteration ends."""
ITERATIONS = 60
"""Iterations after which a frequency is not found."""
OSCILLATES = 1e-9
"""Distance of the damping ratio from 1 up to which a mode does not oscillate."""


@dataclass(frozen=True)
class ThrustState:
    """A thrust bearing at the equilibrium: gap [m], load [N], K [N/m] at frequency 0, K and C [N s/m] at the mode's wn.

    Friction power [W], flow [kg/s] to the ambient at the outer edge, and the largest pressure [Pa, absolute].
    """

    name: str
    gap: float
    load: float
    static_stiffness: float
    stiffness: float
    damping: float
    power: float
    flow: float
    p_max: float


@dataclass(frozen=True)
class AxialState:
    """Axial equilibrium of a rotor: displacement [m], the films, and the axial mode, wn [rad/s] and damping ratio.

    With the mode's eigenvalue s these are abs(s), the undamped frequency, and -Re s / abs(s). Where the mode is
    `overdamped` the rotor creeps back without oscillation, as exp(-wn t).
    """

    speed: float
    pressure: float
    mass: float
    load: float
    displacement: float
    films: tuple[ThrustState, ...]
    wn: float
    zeta: float

    @property
    def overdamped(self) -> bool:
        """Whether the axial mode does not oscillate."""
        return self.zeta > 1 - OSCILLATES

    @property
    def least_gap(self) -> float:
        """Smallest gap [m] of all films."""
        return min(one.gap for one in self.films)


@dataclass(frozen=True, eq=False)
class AxialCurves:
    """Axial state at the highest speed, or why there is none, with curves to draw.

    Forces (films, n) [N] towards +z over displacements (n,) [m] at that speed; wn [rad/s] and damping ratio (m,) of the
    mode over speeds (m,) [rad/s], NaN where the films do not carry. `carried` is None where that is not known.
    """

    state: AxialState | None
    refused: str
    carried: bool | None
    displacements: np.ndarray
    forces: np.ndarray
    speeds: np.ndarray
    wn: np.ndarray
    zeta: np.ndarray


def thrust_films(machine: Machine) -> tuple[GasThrustBearing, ...]:
    """Films of the thrust bearings of a machine, with its gas and its slip.

    Examples
    --------
    >>> [round(one.outer_radius, 4) for one in rs.analysis.thrust_films(rs.load_machine("grooved_turbo_rotor"))]
    [0.013, 0.013]
    """
    slip = sum(getattr(one, "mean_free_path", 0.0) for one in machine.effects.get("slip", ()))
    return tuple(_film(one, machine.gas, slip) for one in machine.thrust_bearings)


def _film(one: ThrustBearing, gas: Gas, mean_free_path: float) -> GasThrustBearing:
    """The film of a thrust bearing with a gas, and with its mean free path [m] where it slips."""
    return GasThrustBearing(
        0.5 * one.inner_diameter, 0.5 * one.outer_diameter, one.grooves, gas.mu, gas.ambient_pressure, gas.temperature,
        gas.R, gas.kappa, mean_free_path=mean_free_path, inner_edge=one.inner_edge,
        hub_radius=None if one.hub_diameter is None else 0.5 * one.hub_diameter, feed=one.feed,
    )  # fmt: skip


def axial_state(machine: Machine, speed: float, pressure: float = 0.0) -> AxialState:
    """Axial equilibrium of a rotor at a speed [rad/s] and a gauge supply pressure [Pa], and its axial mode.

    Raises
    ------
    DataError
        For a machine without thrust bearings and for a pressure below vacuum.
    NoLiftOffError
        Where the films do not carry the load.
    ConvergenceError
        Where a film or the mode does not converge.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.axial_state(rs.load_machine("grooved_turbo_rotor"), 20000.0)
    >>> found.zeta > 0
    True
    """
    if not machine.thrust_bearings:
        raise DataError(
            f"{machine.name} has no thrust bearings; add [[thrust_bearings]]", argument="machine", value=machine.name
        )
    machine.gas.absolute(pressure)
    films, load = thrust_films(machine), machine.axial_load or 0.0
    try:
        z = _displacement(machine, films, load, speed, pressure)
        gaps = [one.gap(z) for one in machine.thrust_bearings]
        s = _frequency(films, gaps, machine.mass, speed, pressure)
        found = tuple(
            _state(name, film, gap, speed, pressure, abs(s))
            for name, film, gap in zip(machine.thrust_names, films, gaps, strict=True)
        )
    except FilmError as error:
        raise ConvergenceError(f"axial equilibrium: {error}") from error
    return AxialState(speed, pressure, machine.mass, load, z, found, abs(s), -s.real / abs(s))


def axial_forces(machine: Machine, displacements: np.ndarray, speed: float, pressure: float = 0.0) -> np.ndarray:
    """Forces (films, n) [N] towards +z of the thrust bearings on a rotor at displacements (n,) [m].

    Examples
    --------
    >>> turbo = rs.load_machine("grooved_turbo_rotor")
    >>> rs.analysis.axial_forces(turbo, np.array([0.0]), 20000.0).sum(axis=0).round(6).tolist()
    [0.0]
    """
    return np.array([
        [one.sign * film.steady(one.gap(z), speed, pressure).load for z in displacements]
        for one, film in zip(machine.thrust_bearings, thrust_films(machine), strict=True)
    ])  # fmt: skip


def axial_curves(machine: Machine, speed: float, pressure: float, beyond: float) -> AxialCurves:
    """Axial state at a speed [rad/s], forces over the displacement, and the mode up to `beyond` times the speed."""
    carried: bool | None
    try:
        state, refused, carried = axial_state(machine, speed, pressure), "", True
    except (NoLiftOffError, ConvergenceError) as error:
        state, refused, carried = None, str(error), False if isinstance(error, NoLiftOffError) else None
    room = min(one.clearance for one in machine.thrust_bearings)
    z = np.linspace(-DRAWN, DRAWN, POINTS) * room
    speeds = np.linspace(0, beyond * speed, POINTS)
    modes = np.array([_mode(machine, float(one), pressure) for one in speeds])
    return AxialCurves(state, refused, carried, z, axial_forces(machine, z, speed, pressure), speeds, *modes.T)


def _mode(machine: Machine, speed: float, pressure: float) -> tuple[float, float]:
    try:
        found = axial_state(machine, speed, pressure)
    except (NoLiftOffError, ConvergenceError):
        return float("nan"), float("nan")
    return found.wn, found.zeta


def _displacement(
    machine: Machine, films: tuple[GasThrustBearing, ...], load: float, speed: float, pressure: float
) -> float:
    """Displacement [m] at which the films carry the load."""
    own = machine.thrust_bearings
    widest = max(one.clearance for one in own)

    def left(z: float) -> float:
        return load + sum(
            one.sign * film.steady(one.gap(z), speed, pressure).load for one, film in zip(own, films, strict=True)
        )

    low = max([-(1 - NEAREST) * one.clearance for one in own if one.sign > 0], default=-FURTHEST * widest)
    high = min([(1 - NEAREST) * one.clearance for one in own if one.sign < 0], default=FURTHEST * widest)
    first, last = left(low), left(high)
    if not (first > 0 > last):
        sign, missing = (1, -first) if first <= 0 else (-1, last)
        raise NoLiftOffError(_not_carried(machine, sign, missing, speed))
    return float(brentq(left, low, high, xtol=1e-12 * widest, rtol=1e-14))


def _not_carried(machine: Machine, sign: int, missing: float, speed: float) -> str:
    """Sentence on bearings that push towards `sign` and lack a force [N], or on a rotor that none of them holds."""
    gaps = [NEAREST * one.clearance * TO_UM for one in machine.thrust_bearings if one.sign == sign]
    way, at = "+z" if sign > 0 else "-z", f"axial equilibrium: at {speed * TO_RPM:.0f} rpm"
    if not gaps:
        return f"{at} nothing pushes the rotor towards {way}; give a load or a thrust bearing that does"
    if not missing:
        return f"{at} the thrust bearings do not push towards {way}; raise the speed, or the pressure of fed ones"
    return (
        f"{at} the thrust bearings that push towards {way} lack {missing:.3g} N against the load and the other ones at "
        f"a gap of {min(gaps):.2g} um; raise the speed or the pressure, or take load away"
    )


def _frequency(
    films: tuple[GasThrustBearing, ...], gaps: list[float], mass: float, speed: float, pressure: float
) -> complex:
    """Frequency [1/s] of the axial mode, by the secant method."""

    def left(s: complex) -> complex:
        parts = (f.dynamic_stiffness(gap, speed, pressure, s)[0] for f, gap in zip(films, gaps, strict=True))
        return mass * s**2 + sum(parts)

    K = left(0).real
    if not K > 0:
        raise NoLiftOffError(f"axial equilibrium: the stiffness is {K:.3g} N/m, so that the rotor does not stay there")
    before = 1j * np.sqrt(K / mass)
    at, value = before * (1 + 0.05j), left(before)
    for _ in range(ITERATIONS):
        now = left(at)
        step = now * (at - before) / (now - value)
        before, value = at, now
        at -= step
        if abs(step) < SAME * abs(at):
            return complex(at)
    raise ConvergenceError("axial mode: its frequency does not converge; check the thrust bearings' recesses")


def _state(
    name: str, film: GasThrustBearing, gap: float, speed: float, pressure: float, frequency: float
) -> ThrustState:
    steady = film.steady(gap, speed, pressure)
    K, C = film.coefficients(gap, speed, [0.0, frequency], pressure)
    return ThrustState(name, gap, steady.load, float(K[0]), float(K[1]), float(C[1]), steady.friction_torque * speed,
                       steady.flow, float(steady.pressure.max()))  # fmt: skip

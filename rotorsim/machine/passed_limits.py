r"""Limits of a machine that a run passes: speed of the rim, temperature of a film.

The rim of the rotor's widest part, of radius R, moves at v = Omega R. A solid disc bears there, at its centre,

.. math:: \sigma = \frac{3 + \nu}{8}\,\rho v^2

Cites: timoshenko_1970.
"""

from __future__ import annotations

import numpy as np

from rotorsim.base.constants import MPA, TO_RPM
from rotorsim.effects.film.gas_heating import NOMINAL
from rotorsim.machine.limits import HOT, Limits
from rotorsim.machine.rim_speed import largest_radius
from rotorsim.machine.rotor import Material
from rotorsim.machine.sampling import FEWEST, highest_sampled
from rotorsim.machine.schema import Machine


def spin_stress(material: Material, rim: float) -> float:
    """Stress [Pa] at the centre of a solid disc whose rim moves at `rim` [m/s]."""
    return (3 + material.poisson_ratio) / 8 * material.density * rim**2


def hottest(machine: Machine) -> float:
    """Limit of the temperature [K]; infinite where none is given and the gas is fed warmer than `HOT`."""
    given = limits_of(machine).temperature
    if given is not None:
        return given
    return HOT if machine.gas.temperature < HOT else np.inf


def limits_of(machine: Machine) -> Limits:
    """The limits of a machine, the default ones where its file gives none."""
    return machine.limits or Limits()


def first_passed(machine: Machine, speed: np.ndarray, rises: np.ndarray | None = None) -> tuple[int, str] | None:
    """First sample beyond a limit, and the sentence; None if there is none.

    Parameters
    ----------
    machine : Machine
    speed : array (n,)
        Speeds [rad/s].
    rises : array (n, k), optional
        Temperatures [K] above that of the gas, of any bodies.
    """
    at, radius = largest_radius(machine)
    limit, rims = limits_of(machine).tip_speed, np.abs(speed) * radius
    warm, highest = _temperatures(machine, speed, rises), hottest(machine)
    beyond = np.flatnonzero((rims > limit * (1 + 1e-12)) | (warm > highest))
    if not beyond.size:
        return None
    first = int(beyond[0])
    if warm[first] > highest:
        what = f"{warm[first] - 273.15:.4g} degC in a film, above limits.temperature {highest - 273.15:.4g} degC"
    else:
        stress = spin_stress(machine.shaft.material, float(rims[first]))
        what = (
            f"the rim of {at}, radius {1e3 * radius:.3g} mm, moves at {rims[first]:.5g} m/s, above limits.tip_speed "
            f"{limit:g} m/s (a solid disc of the shaft's material bears {stress / MPA:.3g} MPa there)"
        )
    return first, at_speed(float(speed[first]), what)


def speed_limit(machine: Machine) -> tuple[float, str]:
    """Highest speed [rad/s] that a run of a machine may have, and the limit that it reaches there."""
    at, radius = largest_radius(machine)
    limit = limits_of(machine).tip_speed
    found = [
        (highest_sampled(machine), f"a turn has {FEWEST} samples there"),
        (limit / radius, f"the rim of {at} moves at limits.tip_speed {limit:g} m/s there"),
    ]
    rise, heating = friction_heat(machine)
    room = hottest(machine) - machine.gas.temperature - rise
    if machine.films and heating > 0 and room >= 0:
        text = f"a film has limits.temperature {hottest(machine) - 273.15:.4g} degC there"
        found.append((NOMINAL * np.sqrt(room / heating), text))
    return min(found)


def friction_heat(machine: Machine) -> tuple[float, float]:
    """Rise [K] of the films' temperature at rest and the one that the nominal speed adds, stated by effects."""
    effects = machine.effects.get("gas_heating", ())
    return sum(e.rise for e in effects), sum(e.heating for e in effects)  # type: ignore[attr-defined]


def at_speed(speed: float, what: str) -> str:
    """Why a run ended at a speed [rad/s]."""
    return f"ended at {speed * TO_RPM:.0f} rpm: {what}"


def _temperatures(machine: Machine, speed: np.ndarray, rises: np.ndarray | None) -> np.ndarray:
    """Highest temperature (n,) [K] in the films: that of the gas, and what friction adds where an effect states it."""
    warm = np.full(len(speed), machine.gas.temperature if machine.films else -np.inf)
    rise, heating = friction_heat(machine)
    warm = warm + rise + heating * (speed / NOMINAL) ** 2
    if rises is not None and rises.size:
        warm = warm + np.maximum(rises.max(axis=1), 0.0)
    return warm

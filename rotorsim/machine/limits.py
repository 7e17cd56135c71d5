r"""Limits that a run of a machine may reach: speed of the rim, samples in a turn, temperature of a film.

The rim of the rotor's widest part, of radius R, moves at v = Omega R. A solid disc bears there, at its centre,

.. math:: \sigma = \frac{3 + \nu}{8}\,\rho v^2

Speeds that would burst any rotor are questioned before a run (`ask_rim_speed`): the range of usual speeds alone lets
6000 Hz pass where 6000 rpm are meant; a small spindle turns that fast, a rotor with a disc of 160 mm would have burst.

Cites: timoshenko_1970.
"""

from __future__ import annotations

import warnings
from math import pi, sqrt

import numpy as np

from rotorsim.base.errors import DataError, Unusual
from rotorsim.base.units import MPA, TO_RPM, show
from rotorsim.effects.film.gas_heating import NOMINAL
from rotorsim.machine.numerics import FEWEST, HOT, PER_TURN, Limits, highest_sampled, rate_for
from rotorsim.machine.rotor import ShaftMaterial
from rotorsim.machine.schema import Machine

DEFAULT = Limits()
"""Limits of a machine whose file gives none."""


def spin_stress(material: ShaftMaterial, rim: float) -> float:
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
    return machine.limits or DEFAULT


def first_passed(machine: Machine, speed: np.ndarray, rises: np.ndarray | None = None) -> tuple[int, str] | None:
    """First sample beyond a limit, and the sentence; None if there is none.

    `speed` (n,) is in rad/s, `rises` (n, k) are temperatures [K] of any bodies above that of the gas.
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
        stress = spin_stress(_material(machine, at), float(rims[first]))
        what = (
            f"the rim of {at}, radius {1e3 * radius:.3g} mm, moves at {rims[first]:.5g} m/s, above limits.tip_speed "
            f"{limit:g} m/s (a solid disc of its material bears {stress / MPA:.3g} MPa there)"
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


FASTEST = 1000.0
"""Rim speed [m/s] that flywheels of carbon fibre hold; discs of steel burst at 500 to 700 m/s."""


def largest_radius(machine: Machine) -> tuple[str, float]:
    """Path and outer radius [m] of the part of the rotor that reaches furthest; a disc counts as uniform: m R^2 / 2."""
    radii = {f"shaft.sections.{i}": max(s.outer) / 2 for i, s in enumerate(machine.shaft.sections)}
    radii |= {f"shaft.layers.{i}": max(layer.outer) / 2 for i, layer in enumerate(machine.shaft.layers)}
    radii |= {f"discs.{i}": sqrt(2 * disc.polar_inertia / disc.mass) for i, disc in enumerate(machine.discs)}
    return max(radii.items(), key=lambda item: item[1])


def _material(machine: Machine, path: str) -> ShaftMaterial:
    """Material of the part of the rotor at a path; discs are taken to be made of the shaft's."""
    _, kind, number = ("." + path).rsplit(".", 2)
    own = None if kind == "discs" else getattr(machine.shaft, kind)[int(number)].material
    return own or machine.shaft.material


def at_the_rim(machine: Machine, speed: float) -> str:
    """Words on a rotational speed [rad/s] at which the rim is faster than `FASTEST`; empty for a slower one."""
    place, radius = largest_radius(machine)
    rim = abs(speed) * radius
    if rim <= FASTEST:
        return ""
    what = f"moves the rim of {place}, radius {1e3 * radius:.3g} mm, at {rim:.4g} m/s"
    return f"{what} (rotors of steel burst at 500 to 700 m/s)"


def ask_rim_speed(machine: Machine, speed: float, path: str = "speed") -> None:
    """Warn of a rotational speed [rad/s] at which the rim is faster than `FASTEST`; `path` names the speed."""
    if fast := at_the_rim(machine, speed):
        warnings.warn(
            f"{path}: '{show(speed, 'rad/s')}' ({speed / (2 * pi):.4g} Hz) {fast}; check whether rpm or Hz are meant",
            Unusual,
            stacklevel=3,
        )


def check_speed(machine: Machine, speed: float) -> None:
    """Raise DataError for a speed [rad/s] at which a turn has too few samples, with the rate that it needs.

    No rate is advised for a speed at which the rim would burst.
    """
    if abs(speed) <= highest_sampled(machine) * (1 + 1e-9):
        return
    needed = rate_for(PER_TURN * abs(speed) / (2 * pi))
    own = 2 * pi / (abs(speed) * machine.sampling_time)
    fast = at_the_rim(machine, speed)
    way = f"lower it: it {fast}" if fast else f"give the machine solver.sampling_rate = '{show(needed, 'Hz')}'"
    raise DataError(
        f"speed = {abs(speed) * TO_RPM:.6g} rpm: a turn has {own:.2g} samples at "
        f"{show(float(f'{1 / machine.sampling_time:.9g}'), 'Hz')} and needs {FEWEST}; {way}",
        argument="speed",
        value=speed,
    )

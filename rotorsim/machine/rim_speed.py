"""Rim speed check: warning for rotational speeds that would burst the rotor.

The range of usual speeds alone lets 6000 Hz pass where 6000 rpm are meant: a small spindle turns that fast, a rotor
with a disc of 160 mm would have burst.
"""

from __future__ import annotations

import warnings
from math import pi, sqrt
from typing import TYPE_CHECKING

from rotorsim.base.errors import Unusual
from rotorsim.base.units import show

if TYPE_CHECKING:
    from rotorsim.machine.schema import Machine

FASTEST = 1000.0
"""Rim speed [m/s] that flywheels of carbon fibre hold; discs of steel burst at 500 to 700 m/s."""


def largest_radius(machine: Machine) -> tuple[str, float]:
    """Path and outer radius [m] of the part of the rotor that reaches furthest; a disc counts as uniform: m R^2 / 2."""
    radii = {f"shaft.sections.{i}": s.outer_diameter / 2 for i, s in enumerate(machine.shaft.sections)}
    radii |= {f"discs.{i}": sqrt(2 * disc.polar_inertia / disc.mass) for i, disc in enumerate(machine.discs)}
    return max(radii.items(), key=lambda item: item[1])


def ask_rim_speed(machine: Machine, speed: float, path: str = "speed") -> None:
    """Warn of a rotational speed [rad/s] at which the rim is faster than `FASTEST`; `path` names the speed."""
    place, radius = largest_radius(machine)
    rim = abs(speed) * radius
    if rim > FASTEST:
        warnings.warn(
            f"{path}: '{show(speed, 'rad/s')}' ({speed / (2 * pi):.4g} Hz) moves the rim of {place}, radius "
            f"{1e3 * radius:.3g} mm, at {rim:.4g} m/s (rotors of steel burst at 500 to 700 m/s); check whether rpm or "
            "Hz are meant",
            Unusual,
            stacklevel=3,
        )

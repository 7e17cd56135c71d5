"""Operating controls of the live rig: speed, pressure, references, hammer, and the switches."""

from __future__ import annotations

from rotorsim.base.constants import RPM
from rotorsim.base.quantity import Quantity
from rotorsim.live.page.control import Control, control_of
from rotorsim.machine import Machine

OFF, P_LAW, PAUSE = "off", "P", "pause"
SWITCHES: dict[str, tuple[str, ...]] = {
    "drive": ("speed", "torque", "coast"),
    "sense": ("forward", "backward"),
    "noise": ("on", "off"),
    "pace": ("pause", "0.1x", "1x", "fastest"),
}
"""Positions of every switch but `controller`, whose positions are off, P and the laws that were given."""
BEARING = "bearing"
"""Switch of a machine with several films: whose journal and pressure are drawn."""
START = {"drive": "speed", "sense": "forward", "noise": "on", "pace": "1x", "controller": OFF}
HIGHEST = 30_000 * RPM
"""Highest speed [rad/s] that can be set on a machine whose file states none; a drive takes 3 s to it."""
TORQUE = Quantity("N*m", "Drive torque, in the sense that is set.", low=0.0, high=5.0)
IMPULSE = Quantity("N*s", "Of a hammer's hit on the disc, five samples long.", low=0.0, high=0.2)
PRESSURE = Quantity("Pa", "Gauge pressure.", low=0.0, high=1e6)
PACES = {"pause": 0.0, "0.1x": 0.1, "1x": 1.0, "fastest": float("inf")}


def switches(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Positions of the switches of a machine, but `controller`."""
    return SWITCHES | ({BEARING: machine.film_names} if len(machine.films) > 1 else {})


def driven_axes(machine: Machine) -> str:
    """Axes whose reference drives a pin."""
    return "".join(axis for axis in "xy" if any(i.reference.endswith(axis) for i in machine.injectors))


def operating(machine: Machine) -> dict[str, Control]:
    """Operating controls by key."""
    limit = 5.0 if machine.actuators is None else machine.actuators.reference_limit
    highest = machine.drive.highest_speed or HIGHEST
    speed = Quantity("rad/s", "Speed the drive holds.", low=0.0, high=highest)
    acceleration = Quantity("rad/s^2", "Limit of the drive.", low=RPM, high=highest / 3)
    found = [
        control_of("speed", speed, power=1),
        control_of("acceleration", acceleration, 500 * RPM * highest / HIGHEST),
        control_of("torque", TORQUE, power=1),
        control_of("impulse", IMPULSE, 0.01 * min(machine.mass, 1.0)),
    ]
    if machine.injectors or any(film.orifices for film in machine.films):
        found.append(control_of("pressure", PRESSURE, 0.3e6, "MPa", power=1))
    reference = Quantity("V", "Constant.", low=-limit, high=limit)
    found += [control_of(f"reference_{axis}", reference, power=1) for axis in driven_axes(machine)]
    return {control.key: control for control in found}

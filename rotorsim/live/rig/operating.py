"""Operating controls of the live rig: speed, pressure, references, hammer, and the switches."""

from __future__ import annotations

from rotorsim.base.constants import RPM
from rotorsim.live.page.control import Control
from rotorsim.machine import Machine

OFF, P_LAW, PAUSE = "off", "P", "pause"
SWITCHES: dict[str, tuple[str, ...]] = {
    "drive": ("speed", "torque", "coast"),
    "sense": ("forward", "backward"),
    "noise": ("on", "off"),
    "pace": ("pause", "0.1x", "1x", "fastest"),
}
"""Positions of every switch but `controller`, whose positions are off, P and the laws that were given."""
START = {"drive": "speed", "sense": "forward", "noise": "on", "pace": "1x", "controller": OFF}
PACES = {"pause": 0.0, "0.1x": 0.1, "1x": 1.0, "fastest": float("inf")}


def driven_axes(machine: Machine) -> str:
    """Axes whose reference drives a pin."""
    return "".join(axis for axis in "xy" if any(i.reference.endswith(axis) for i in machine.injectors))


def operating(machine: Machine) -> dict[str, Control]:
    """Operating controls by key."""
    limit = 5.0 if machine.actuators is None else machine.actuators.reference_limit
    found = [
        Control("speed", "speed", "rpm", RPM, 0.0, 30_000 * RPM, 0.0, doc="Speed the drive holds.", power=1),
        Control("acceleration", "acceleration", "rpm/s", RPM, RPM, 10_000 * RPM, 500 * RPM, doc="Limit of the drive."),
        Control("torque", "torque", "N*m", 1.0, 0.0, 5.0, 0.0, doc="Drive torque, forward.", power=1),
        Control("impulse", "impulse", "mN*s", 1e-3, 0.0, 0.2, 0.01, doc="Of a hammer's hit on the disc, 1 ms long."),
    ]
    if machine.injectors:
        found.append(Control("pressure", "pressure", "MPa", 1e6, 0.0, 1e6, 0.3e6, doc="Gauge pressure.", power=1))
    for axis in driven_axes(machine):
        key = f"reference_{axis}"
        found.append(Control(key, f"reference {axis}", "V", 1.0, -limit, limit, 0.0, doc="Constant.", power=1))
    return {control.key: control for control in found}

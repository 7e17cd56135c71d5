"""What is fitted before anything is named: the calibration of the machine, its smooth trends, and the sensors' zeros.

These are never named. The seat gap stays fixed (measured by the stroke of the piezos): with discharge coefficient and
common actuator gain it makes an exact null vector.
"""

from __future__ import annotations

from rotorsim.discrepancy.knobs import Knob
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine.rotor import LinearBearing


def calibration(twin: Twin, points: int = 6) -> tuple[Knob, ...]:
    """Knobs of a machine's calibration; trends only where there are at least four operating points."""
    machine, slots = twin.machine, twin.slots
    knobs = [Knob("offset_x", 1e-7, 5e-5), Knob("offset_y", 1e-7, 5e-5)]
    if "unbalance" in slots:
        table = slots["unbalance"]
        size = 2e-7 * machine.mass / 3.5
        knobs += [Knob(f"unbalance.{table}.me~phase.{p}", 4 * size, 40 * size) for p in "cs"]
    if machine.film is None:
        knobs += linear(twin)
    else:
        knobs += gas(twin)
        if points >= 4:
            knobs += trends(twin)
    return tuple(knobs)


MESH = Knob("mesh", 1.0, 0.5)
"""Direction of the solver's error, which is corrected for: what is left of it is within half of it."""
LAW = Knob("law", 1.0, 0.1)
"""Direction from one injector law to the other."""


def gas(twin: Twin) -> list[Knob]:
    """Film, injectors, actuators, ball bearing."""
    slots = twin.slots
    knobs = [Knob("shaft_damping", 0.1, 0.3, -0.9, 3.0)]
    if "clearance_growth" in slots:
        knobs += [Knob("clearance_growth.0.temperature", 1.0, 3.0, -15, 15)]
    if "ball_bearing" in slots:
        knobs += [Knob("ball_bearing.0.softening", 0.05, 0.3, -0.9, 0.9)]
    if "discharge_drift" in slots:
        knobs += [Knob("discharge_drift.0.drift", 0.02, 0.10, -0.5, 0.5)]
        knobs += [Knob("curtain_discharge", 0.03, 0.10, -0.5, 0.5)]
        knobs += [Knob(f"plenum_volume.{slots['plenum_volume']}.change", 0.05, 0.20, -0.7, 3.0)]
    if twin.machine.injectors:
        knobs += [Knob("actuator_x", 0.02, 0.05, -0.5, 0.5), Knob("actuator_y", 0.02, 0.05, -0.5, 0.5)]
    return knobs


def trends(twin: Twin) -> list[Knob]:
    """Smooth trends of stiffness, damping and gain over pressure and speed."""
    if "discharge_drift" not in twin.slots:
        return []
    volume = f"plenum_volume.{twin.slots['plenum_volume']}.change"
    sizes = {"discharge_drift.0.drift": (0.02, 0.015), volume: (0.05, 0.05)}
    return [Knob(key, step, sd, trend=trend) for trend in ("pressure", "speed") for key, (step, sd) in sizes.items()]


def linear(twin: Twin) -> list[Knob]:
    """Stiffness and damping of linear bearings, the shaft's own damping and stiffness."""
    knobs = [Knob("shaft_damping", 0.1, 0.5, -0.9, 5.0), Knob("shaft_stiffness", 3e-4, 0.03, -0.3, 0.3)]
    for i, bearing in enumerate(twin.machine.bearings):
        if not isinstance(bearing, LinearBearing):
            continue
        for axis in "xy":
            if bearing.kxx > 0:
                knobs.append(Knob(f"bearing.{i}.k{axis}", 0.02, 0.3, -0.9, 3.0))
            if bearing.cxx > 0:
                knobs.append(Knob(f"bearing.{i}.c{axis}", 0.1, 0.5, -0.9, 5.0))
    return knobs

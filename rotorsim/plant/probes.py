"""Probes of a machine as rows of factors of the motion, and the coordinates of their readings in a record."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.machine.probes import AnyProbe, ShaftProbe, gain, reading_unit
from rotorsim.machine.schema import Machine
from rotorsim.plant.kernels.rig_layout import AROUND
from rotorsim.plant.mesh import Mesh

FACTORS: dict[str, dict[int, float]] = {
    "relative_displacement": {0: -1.0},
    "absolute_displacement": {6: 1.0},
    "housing_velocity": {2: 1.0, 8: 1.0},
    "housing_acceleration": {4: 1.0, 10: 1.0},
}
"""Places of x among the motion around the shaft (`rig_layout.AROUND`) that a quantity has, and their factors."""


ORDER = {"relative_displacement": 0, "housing_velocity": 1, "housing_acceleration": 2}
"""Time derivative of the housing's displacement that is in a quantity."""


def probe_rows(mesh: Mesh) -> np.ndarray:
    """Factors (probes, 3 n + AROUND): of the n coordinates, their velocities and accelerations, the motion around."""
    machine, n = mesh.machine, mesh.reduced.Phi.shape[1]
    rows = np.zeros((len(machine.probes), 3 * n + AROUND))
    for row, probe in zip(rows, machine.probes, strict=True):
        direction = gain(probe) * along(probe.angle)
        if isinstance(probe, ShaftProbe):
            row[:n] = direction @ mesh.shape_between(probe.position)
        mounted, order = machine.housing_of(probe), ORDER.get(probe.quantity)
        if mounted is not None and order is not None:
            sign = -1.0 if order == 0 else 1.0
            row[n * order : n * (order + 1)] += sign * direction @ mesh.housing(mounted)
        for place, factor in FACTORS[probe.quantity].items():
            row[3 * n + place : 3 * n + place + 2] = factor * direction
    return rows


def along(angle: float) -> np.ndarray:
    """Unit vector (2,) at an angle [rad] from x towards y, exact at right angles."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    return np.where(np.abs(direction) < 1e-15, 0.0, direction)


def position(machine: Machine, probe: AnyProbe) -> float:
    """Coordinate z [m] of a probe; NaN for one of a housing that no bearing has."""
    if probe.position is not None:
        return float(probe.position)
    mounted = machine.housing_of(probe)
    if mounted is not None:
        return machine.bearings[mounted].position
    return float("nan") if machine.film is None else machine.film.position


def probe_coordinates(machine: Machine) -> dict[str, Any]:
    """Coordinates of `probe_measured` in a record; empty for a machine without probes."""
    probes = machine.probes
    if not probes:
        return {}
    return {
        "probe": [p.name for p in probes],
        "probe_quantity": [p.quantity for p in probes],
        "probe_position": [position(machine, p) for p in probes],
        "probe_angle": [p.angle for p in probes],
        "probe_gain": [gain(p) for p in probes],
        "probe_unit": [reading_unit(p) for p in probes],
    }

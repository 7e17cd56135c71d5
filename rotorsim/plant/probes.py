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


def probe_rows(mesh: Mesh, n_shaft: int) -> np.ndarray:
    """Factors (probes, n_shaft + AROUND) of the modal displacements of the shaft and of the motion around it."""
    rows = np.zeros((len(mesh.machine.probes), n_shaft + AROUND))
    for row, probe in zip(rows, mesh.machine.probes, strict=True):
        direction = gain(probe) * along(probe.angle)
        if isinstance(probe, ShaftProbe):
            row[:n_shaft] = direction @ mesh.shape_between(probe.position)
        for place, factor in FACTORS[probe.quantity].items():
            row[n_shaft + place : n_shaft + place + 2] = factor * direction
    return rows


def along(angle: float) -> np.ndarray:
    """Unit vector (2,) at an angle [rad] from x towards y, exact at right angles."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    return np.where(np.abs(direction) < 1e-15, 0.0, direction)


def position(machine: Machine, probe: AnyProbe) -> float:
    """Where a probe stands along the shaft [m]; NaN for one of a housing that no bearing has."""
    if probe.position is not None:
        return float(probe.position)
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

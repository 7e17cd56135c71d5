"""Tables of run-up vectors as trials of a diagnosis, and what a twin makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.discrepancy.data.changes import known_changes
from rotorsim.discrepancy.data.sensors import check_plane, check_ring
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.data.sweeps import Sweep, make_sweeps
from rotorsim.discrepancy.fit.parameters import contributions, setting
from rotorsim.discrepancy.residuals.comparison import ParameterPoint
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.machine import Machine

if TYPE_CHECKING:
    import xarray as xr


def vector_trials(machine: Machine, opened: Sequence[tuple[str, xr.Dataset]], role: str | None = None) -> list[Trial]:
    """Trials of tables of vectors; of six rows one is held out and one untouched, where no role is stated for all."""
    for name, vectors in opened:
        check_plane(machine, vectors.attrs.get("disc_position"), name)
    found = [
        replace(sweep, changes=known_changes(machine, vectors.attrs.get("changes"), name))
        for name, vectors in opened
        for sweep in make_sweeps(vectors, name, machine.film is not None, role or str(vectors.attrs.get("role", "")))
    ]
    for sweep in found:
        check_ring(machine, sweep)
    return list(found)


def simulated(twin: Twin, sweep: Sweep, point: ParameterPoint) -> np.ndarray:
    """Simulated vectors (1, 2, 1 + orders x rows) [m] of the twin at a point."""
    values = setting(twin, contributions(point.values, sweep.speed, sweep.pressure, sweep.changes), point.fixed)
    return sweep.lines(twin.run(values, sweep.rows, sweep.pressure)[:, :2])

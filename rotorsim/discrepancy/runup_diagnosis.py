"""Diagnosis from run-up vectors: 1X, 2X, 3X amplitude and phase over speed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.base.cache import Cache
from rotorsim.discrepancy.data.changes import known_changes
from rotorsim.discrepancy.data.intake import record_notes
from rotorsim.discrepancy.data.sensors import check_plane
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.data.sweeps import Sweep, make_sweeps, rate_notes
from rotorsim.discrepancy.diagnosis import work_on
from rotorsim.discrepancy.fit.parameters import contributions, setting
from rotorsim.discrepancy.residuals.comparison import Point
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.machine import Machine

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.discrepancy.outcome.result import Diagnosis

TOLERANCE = 0.01
"""Tolerance of vectors: how they were tracked is not known."""


def diagnose_vectors(
    machine: Machine,
    opened: Sequence[tuple[str, xr.Dataset]],
    effects: Iterable[str] | None,
    tolerance: float,
    progress: Callable[[str], None],
    cache: Cache | None = None,
) -> Diagnosis:
    """Diagnosis of tables of vectors; of six rows one is held out and one untouched."""
    for name, vectors in opened:
        check_plane(machine, vectors.attrs.get("disc_position"), name)
    trials = [
        replace(sweep, changes=known_changes(machine, vectors.attrs.get("changes"), name))
        for name, vectors in opened
        for sweep in make_sweeps(vectors, name, machine.film is not None)
    ]
    found = work_on(machine, list[Trial](trials), effects, max(tolerance, TOLERANCE), progress, cache=cache)
    return replace(found, notes=(*record_notes(opened), *rate_notes(opened), *found.notes))


def simulated(twin: Twin, sweep: Sweep, point: Point) -> np.ndarray:
    """Simulated vectors (1, 2, 1 + orders x rows) [m] of the twin at a point."""
    values = setting(twin, contributions(point.values, sweep.speed, sweep.pressure, sweep.changes), point.fixed)
    return sweep.lines(twin.run(values, sweep.rows, sweep.pressure)[:, :2])

"""Compilation of a plant's kernels ahead of its first run."""

from __future__ import annotations

import numpy as np

from rotorsim.plant.columns import COLUMNS
from rotorsim.plant.plant import Plant


def compile_kernels(plant: Plant) -> None:
    """Compile what a run of the plant calls, by an equilibrium, whatever its outcome, and a run of no samples.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.compile_kernels(plant)
    """
    a = plant.assembly
    w = a.w.copy()
    a.module.settle(w, a.w, a.ix, a.P, 0.0, a.machine.gas.ambient_pressure)
    a.module.run(w, a.ix, a.P, np.empty((0, 6)), np.empty((0, len(COLUMNS))), a.steps_per_sample)

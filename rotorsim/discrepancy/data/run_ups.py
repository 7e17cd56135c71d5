"""Run-ups and coast-downs over time among the records of a diagnosis: taken as tables of vectors.

A record counts as one if it has an angle, its speed sweeps and nothing excites the rotor but its own turning.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identification.records.prefilter import measured
from identification.records.schema import notes_of, with_notes
from rotorsim.base.constants import TO_RPM
from rotorsim.discrepancy.data.runup_vectors import SWEEP, runup_vectors
from rotorsim.discrepancy.data.sweeps import RECORDED, SETTLING, TURNS, stated_turns

if TYPE_CHECKING:
    import xarray as xr

LEAST = 2.0
"""Smallest range of speed [rad/s] of a sweep."""
BLOCK = 0.05
"""Time [s] over which speeds are averaged."""


def is_table(record: xr.Dataset) -> bool:
    """Whether a Dataset is a table of vectors over the speed, not a record over time."""
    return "speed" in record.dims


def with_tables(opened: Sequence[tuple[str, xr.Dataset]]) -> list[tuple[str, xr.Dataset]]:
    """Records and tables by name, with the table of vectors in place of every record whose speed sweeps."""
    return [(name, _table(record, name) if sweeps(record) else record) for name, record in opened]


def sweeps(record: xr.Dataset) -> bool:
    """Whether a record over time is a run-up or coast-down of which vectors can be made."""
    angle, speed = (None if is_table(record) else measured(record, name) for name in ("angle", "speed"))
    if angle is None or angle.ndim == 0 or any(_moves(record, name) for name in ("reference", "disc_force")):
        return False
    time = np.asarray(record["time"].values, float)
    if speed is None or speed.ndim == 0:
        speed = np.abs(np.gradient(np.unwrap(angle), time)) if len(time) > 1 else np.zeros(0)
    block = max(round(BLOCK * len(time) / max(float(np.ptp(time)), 1e-300)), 1)
    slow = speed[: len(speed) // block * block].reshape(-1, block).mean(axis=1)[1:]
    return bool(len(slow) and np.ptp(slow) > max(LEAST, SWEEP * np.abs(slow).max()))


def _moves(record: xr.Dataset, name: str) -> bool:
    return name in record and bool(np.ptp(record[name].values, axis=0).any())


def _table(record: xr.Dataset, name: str) -> xr.Dataset:
    """Vectors of windows of the stated number of revolutions, with the record's role and a note.

    The beginning is left out: a simulated record starts at rest in equilibrium.
    """
    turns = int(stated_turns(record, name)) if "turns" in record.attrs else int(TURNS)
    time = record["time"].values
    table = runup_vectors(record.isel(time=time >= time[0] + SETTLING).assign_attrs(record=name), turns)
    low, high = np.sort(table["speed"].values[[0, -1]]) * TO_RPM
    taken = (
        f"its speed sweeps from {low:.0f} to {high:.0f} rpm: taken as {table.sizes['speed']} vectors, "
        f"each over {turns} revolutions"
    )
    role = {"role": record.attrs["role"]} if "role" in record.attrs else {}
    return with_notes(table.assign_attrs({RECORDED: 1, **role}), [*notes_of(table), taken])

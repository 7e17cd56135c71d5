"""In-memory record of a short run, with the interface of `Recording`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import make_record
from rotorsim.experiments.recording import snapshot_variables

if TYPE_CHECKING:
    import xarray as xr

LONGEST = 300.0
"""Simulated time [s] up to which a record is held in memory, some 0.3 GB; longer ones pass through a file."""


class Memory:
    """Growing record in memory."""

    def __init__(self, probes: dict[str, Any] | None = None, bearings: Sequence[str] = ()) -> None:
        self.samples, self._probes, self._bearings = 0, probes, tuple(bearings)
        self._blocks: list[dict[str, np.ndarray]] = []
        self._snapshots: list[tuple[float, float, np.ndarray]] = []
        self._grid: tuple[np.ndarray, np.ndarray] | None = None
        self._attrs: dict[str, Any] = {}

    def write(self, time: np.ndarray, values: dict[str, np.ndarray]) -> None:
        """Append samples."""
        self._blocks.append({"time": time, **values})
        self.samples += len(time)

    def snapshot(self, time: float, speed: float, theta: np.ndarray, z: np.ndarray, pressure: np.ndarray) -> None:
        """Keep the film pressure of one instant, as `Simulation.film_snapshot` gives it."""
        self._grid = theta, z
        self._snapshots.append((time, speed, pressure.copy()))

    def note(self, **attrs: Any) -> None:
        """Add attributes."""
        self._attrs |= attrs

    def dataset(self) -> xr.Dataset:
        """The record, as `Recording` would have written it."""
        names = self._blocks[0]
        values = {name: np.concatenate([block[name] for block in self._blocks]) for name in names}
        record = make_record(values.pop("time"), values, self._attrs, self._probes, self._bearings)
        if self._grid is None:
            return record
        times, speeds, pressures = (np.array(part) for part in zip(*self._snapshots, strict=True))
        kept = zip(
            snapshot_variables(self._grid[1].ndim > 1).items(), (*self._grid, pressures, times, speeds), strict=True
        )
        made = {name: (dims, values, {"units": u, "long_name": text}) for (name, (dims, u, text)), values in kept}
        coordinates = {name: made.pop(name) for name in list(made)[:2]}
        return record.assign(made).assign_coords(coordinates)

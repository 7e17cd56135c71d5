"""In-memory record of a short run, with the interface of `Recording`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from identification import make_record

if TYPE_CHECKING:
    import xarray as xr

LONGEST = 300.0
"""Simulated time [s] up to which a record is held in memory, some 0.3 GB; longer ones pass through a file."""


class Memory:
    """Growing record in memory."""

    def __init__(self, probes: dict[str, Any] | None = None) -> None:
        self.samples, self._probes = 0, probes
        self._blocks: list[dict[str, np.ndarray]] = []
        self._snapshots: list[tuple[float, float, np.ndarray]] = []
        self._grid: tuple[np.ndarray, np.ndarray] | None = None
        self._attrs: dict[str, Any] = {}

    def write(self, time: np.ndarray, values: dict[str, np.ndarray]) -> None:
        """Append samples."""
        self._blocks.append({"time": time, **values})
        self.samples += len(time)

    def snapshot(self, time: float, speed: float, theta: np.ndarray, z: np.ndarray, pressure: np.ndarray) -> None:
        """Keep the film pressure of one instant."""
        self._grid = theta, z
        self._snapshots.append((time, speed, pressure.copy()))

    def note(self, **attrs: Any) -> None:
        """Add attributes."""
        self._attrs |= attrs

    def dataset(self) -> xr.Dataset:
        """The record, as `Recording` would have written it."""
        names = self._blocks[0]
        values = {name: np.concatenate([block[name] for block in self._blocks]) for name in names}
        record = make_record(values.pop("time"), values, self._attrs, self._probes)
        if self._grid is None:
            return record
        times, speeds, pressures = zip(*self._snapshots, strict=True)
        return record.assign(
            film_pressure=(
                ("snapshot", "theta", "z"),
                np.array(pressures),
                _attributes("Pa", "film pressure, absolute"),
            ),
            snapshot_time=("snapshot", np.array(times), _attributes("s", "time of the snapshot")),
            snapshot_speed=("snapshot", np.array(speeds), _attributes("rad/s", "shaft speed at the snapshot")),
        ).assign_coords(
            theta=("theta", self._grid[0], _attributes("rad", "angle on the bearing")),
            z=("z", self._grid[1], _attributes("m", "axial position")),
        )


def _attributes(units: str, long_name: str) -> dict[str, str]:
    return {"units": units, "long_name": long_name}

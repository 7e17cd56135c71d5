"""A record with everything that figures and captions need of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.errors import MachineFileError
from rotorsim.experiments.tracking import RPM, summarise, track_orders, waterfall
from rotorsim.machine import Machine


@dataclass(frozen=True)
class Run:
    """A record, its tracked orders, spectra and summary, and its machine where the record tells it."""

    record: xr.Dataset
    tracked: xr.Dataset
    spectra: xr.Dataset
    summary: dict[str, Any]
    machine: Machine | None

    @property
    def swept(self) -> bool:
        """Whether the speed went one way and far enough to draw things against it."""
        speed = self.spectra["speed"].values
        one_way = abs(np.abs(np.diff(speed)).sum() - abs(speed[-1] - speed[0])) <= 1e-6 * np.abs(speed).max()
        return bool(one_way and np.ptp(speed) > 0.02 * np.abs(speed).max())

    @property
    def has_snapshots(self) -> bool:
        """Whether film pressures were kept."""
        return "film_pressure" in self.record and self.record.sizes["snapshot"] > 0

    @property
    def peaks(self) -> list[dict[str, Any]]:
        """Peaks of the summary without those below a thousandth of the largest."""
        least = 1e-3 * max((p["um"] for p in self.summary["peaks"]), default=0.0)
        return [p for p in self.summary["peaks"] if p["um"] > least]

    @property
    def reach(self) -> list[float]:
        """Both ends of the axis against which things are drawn: speed [rpm], or time [s] where it is constant."""
        if self.swept:
            return [self.summary["speed_rpm"]["min"], self.summary["speed_rpm"]["max"]]
        return self.time_reach

    @property
    def time_reach(self) -> list[float]:
        """Both ends of the record [s]."""
        first = float(self.record["time"].isel(time=0))
        return [first, first + self.summary["duration_s"]]

    def abscissa(self, data: xr.Dataset) -> tuple[np.ndarray, str]:
        """Speed [rpm] of a dataset's entries and its label; time [s] where the speed is constant."""
        if self.swept:
            return data["speed"].values * RPM, "shaft speed [rpm]"
        return data["time"].values, "time [s]"


def analyse(record: xr.Dataset) -> Run:
    """Track, transform and summarise an open record; spectra reach 4X of the highest speed, at least 100 Hz."""
    tracked = track_orders(record)
    fastest = float(np.abs(_some_speeds(record)).max())
    spectra = waterfall(record, max_frequency=max(100.0, 4 * fastest / (2 * np.pi)))
    try:
        machine = Machine.from_text(str(record.attrs.get("machine", "")))
    except MachineFileError:
        machine = None
    return Run(record, tracked, spectra, summarise(record, tracked, spectra), machine)


def _some_speeds(record: xr.Dataset) -> np.ndarray:
    """Some 200 speeds along the record [rad/s]."""
    chosen = np.unique(np.linspace(0, record.sizes["time"] - 1, 200).astype(int))
    return np.asarray(record["speed"].isel(time=chosen).values, float)

"""Analysed record of a run: orders, spectra, summary and machine, computed on demand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.constants import TO_RPM
from rotorsim.base.errors import MachineFileError
from rotorsim.experiments.run_summary import summarise
from rotorsim.machine import Machine
from rotorsim.signals.orders import track_orders
from rotorsim.signals.record_blocks import blocks, need, prepared, sampling_time, sensed_name
from rotorsim.signals.spectra import waterfall
from rotorsim.signals.static_gain import Holds, rest

RUNS = ("runup", "coastdown")
"""Experiments in which the speed is swept."""
STEADILY = 0.02
"""Permitted deviation of a speed from its trend, or in all if it counts as constant, over the highest."""


@dataclass(frozen=True)
class Run:
    """A prepared record (`compute.prepare`), its tracked orders, spectra and summary, and its machine if stated."""

    record: xr.Dataset

    @cached_property
    def tracked(self) -> xr.Dataset:
        """Orders, see `track_orders`."""
        return track_orders(self.record)

    @cached_property
    def spectra(self) -> xr.Dataset:
        """Spectra along the record, see `waterfall`."""
        return waterfall(self.record, max_frequency=self.highest_frequency)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Numbers of the run, see `summarise`."""
        return summarise(self.record, self.tracked, self.spectra)

    @cached_property
    def holds(self) -> Holds:
        """Rests of a staircase, see `rest`; raises MissingError."""
        return rest(self.record, self.output)

    @cached_property
    def machine(self) -> Machine | None:
        """The machine, if the record holds one that can be read."""
        try:
            return Machine.from_text(str(self.record.attrs.get("machine", "")))
        except MachineFileError:
            return None

    @property
    def kind(self) -> str:
        """The experiment's name; empty for a record that does not state it."""
        return str(self.record.attrs.get("experiment", ""))

    @property
    def simulated(self) -> bool:
        """Whether the record comes from a plant and not from a rig."""
        return "machine" in self.record.attrs or "disc" in self.record

    @property
    def output(self) -> str:
        """The displacement that an identification would see."""
        return sensed_name(self.record)

    @cached_property
    def fastest(self) -> float:
        """Highest speed [rad/s], whichever way."""
        return float(np.nanmax([np.nanmax(np.abs(block["speed"])) for block in blocks(self.record, ["speed"])]))

    @property
    def highest_frequency(self) -> float:
        """Where spectra end [Hz]: 4X, at least 100 Hz in a run-up and 300 Hz otherwise; 12X of a slow roll."""
        turning, half = self.fastest / (2 * np.pi), 0.5 / sampling_time(self.record)
        if self.kind == "slow_roll" and turning > 0:
            return min(12 * turning, half)
        return min(max(100.0 if self.kind in RUNS else 300.0, 4 * turning), half)

    @property
    def speed_known(self) -> bool:
        """Whether the record holds the speed or the angle."""
        return "speed" not in str(self.record.attrs.get("assumed", "")).split()

    @property
    def angle_known(self) -> bool:
        """Whether the record holds the shaft angle."""
        return "angle" not in str(self.record.attrs.get("assumed", "")).split()

    @cached_property
    def revolutions(self) -> float:
        """How often the shaft turned between both ends of the record, by its angle or else its mean speed."""
        if self.angle_known:
            ends = np.asarray(self.record["angle"].isel(time=[0, -1]).values, float)
            return float(abs(ends[1] - ends[0])) / (2 * np.pi)
        duration = sampling_time(self.record) * (self.record.sizes["time"] - 1)
        return abs(self.mean_speed) * duration / (2 * np.pi)

    @property
    def mean_speed(self) -> float:
        """Mean over the spectra's stretches [rad/s]."""
        return float(self.spectra["speed"].mean())

    @property
    def self_excitable(self) -> bool:
        """Whether motion below 1X indicates whirl: the shaft turns, and no input moves the disc."""
        return self.angle_known and self.revolutions >= 1 and not self.driven

    @cached_property
    def driven(self) -> dict[str, tuple[int, ...]]:
        """Axes along which `reference` and `disc_force` change in the record."""
        names = [k for k in ("reference", "disc_force") if k in self.record]
        moved = {k: np.zeros(2, bool) for k in names}
        for block in blocks(self.record, names) if names else ():
            for k in names:
                first = np.asarray(self.record[k].isel(time=0).values, float)
                moved[k] |= np.any(block[k] != first, axis=0)
        return {k: tuple(int(i) for i in np.flatnonzero(v)) for k, v in moved.items() if v.any()}

    @property
    def swept(self) -> bool:
        """Whether the speed went one way and far enough to draw things against it."""
        speed = self.spectra["speed"].values
        most = np.abs(speed).max()
        one_way = np.abs(np.diff(speed)).sum() - abs(speed[-1] - speed[0]) <= STEADILY * most
        return bool(one_way and np.ptp(speed) > STEADILY * most)

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
        first, last = np.asarray(self.record["time"].isel(time=[0, -1]).values, float)
        return [float(first), float(last)]

    def abscissa(self, data: xr.Dataset) -> tuple[np.ndarray, str]:
        """Speed [rpm] of a dataset's entries and its label; time [s] where the speed is constant."""
        if self.swept:
            return data["speed"].values * TO_RPM, "shaft speed [rpm]"
        return data["time"].values, "time [s]"

    def need_turning(self, least: float = 1.0) -> None:
        """Raise MissingError unless the shaft's angle is known and turns so many revolutions."""
        need(self.angle_known, "The record holds no shaft angle, so nothing can be drawn over it.")
        need(self.revolutions > 1e-3, "The shaft stands still.")
        need(self.revolutions >= least,
             f"The shaft turns {self.revolutions:.2g} revolutions; this figure takes {least:g}.")  # fmt: skip


def analyse(record: xr.Dataset) -> Run:
    """An open record with what figures need of it; raises DataError for one without a displacement of the disc."""
    return Run(prepared(record))

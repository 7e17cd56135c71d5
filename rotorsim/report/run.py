"""Analysed record of a run, computed on demand, and the registry of the sections that a page makes of it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from identification.records.sensors import ATTRIBUTE
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.units import TO_RPM
from rotorsim.experiments.summary import summarise
from rotorsim.machine import Machine
from rotorsim.signals.orders import find_resonances, track_orders
from rotorsim.signals.record_blocks import (
    READINGS,
    MissingError,
    blocks,
    displacement_name,
    need,
    prepared,
    probe_names,
    probe_units,
    sampling_time,
    sensed_name,
)
from rotorsim.signals.spectra import waterfall
from rotorsim.signals.static_gain import Holds, rest

RUNS = ("runup", "coastdown")
"""Experiments in which the speed is swept."""
STEADILY = 0.02
"""Permitted deviation of a speed from its trend, or in all if it counts as constant, over the highest."""


@dataclass(frozen=True)
class AnalysedRun:
    """A prepared record (`prepared`), its tracked orders, spectra and summary, and its machine if stated."""

    record: xr.Dataset

    @property
    def lone(self) -> str:
        """Name of the probe that stands in for the disc's x where no two see x and y; empty otherwise."""
        return str(self.record.attrs.get(LONE, ""))

    @property
    def others(self) -> list[str]:
        """Names of the displacement probes that a lone one stands in for."""
        named = zip(probe_names(self.record), probe_units(self.record), strict=True) if self.lone else ()
        return [name for name, unit in named if unit == "m" and name != self.lone]

    @property
    def axes(self) -> dict[str, str]:
        """Label of each axis that was measured."""
        return {"x": f"probe {self.lone}"} if self.lone else {"x": "disc x", "y": "disc y"}

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
        """True if the record comes from a plant, False if from a rig."""
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
        """End [Hz] of spectra: 4X, at least 100 Hz in a run-up and 300 Hz otherwise; 12X of a slow roll."""
        turning, half = self.fastest / (2 * np.pi), 0.5 / sampling_time(self.record)
        if self.kind == "slow_roll" and turning > 0:
            return min(12 * turning, half)
        return min(max(100.0 if self.kind in RUNS else 300.0, 4 * turning), half)

    @property
    def speed_known(self) -> bool:
        """True if the record holds the speed or the angle."""
        return "speed" not in str(self.record.attrs.get("assumed", "")).split()

    @property
    def angle_known(self) -> bool:
        """True if the record holds the shaft angle."""
        return "angle" not in str(self.record.attrs.get("assumed", "")).split()

    @cached_property
    def revolutions(self) -> float:
        """Number of turns of the shaft between both ends of the record, by its angle or else its mean speed."""
        if self.angle_known:
            ends = np.asarray(self.record["angle"].isel(time=[0, -1]).values, float)
            return float(abs(ends[1] - ends[0])) / (2 * np.pi)
        duration = sampling_time(self.record) * (self.record.sizes["time"] - 1)
        return abs(self.mean_speed) * duration / (2 * np.pi)

    @property
    def turning(self) -> float:
        """1X [Hz] of a constant speed; 0 where it is unknown or changes."""
        return 0.0 if self.swept else abs(self.mean_speed) / (2 * np.pi)

    @property
    def mean_speed(self) -> float:
        """Mean over the spectra's stretches [rad/s]."""
        return float(self.spectra["speed"].mean())

    @property
    def self_excitable(self) -> bool:
        """True if motion below 1X indicates whirl: the shaft turns, and no input moves the disc."""
        return self.angle_known and self.revolutions >= 1 and not self.driven

    @cached_property
    def driven(self) -> dict[str, tuple[int, ...]]:
        """Axes along which reference, force on the disc and acceleration of the base change in the record."""
        names = [k for k in ("reference", "disc_force", "base_acceleration") if k in self.record]
        moved = {k: np.zeros(2, bool) for k in names}
        for block in blocks(self.record, names) if names else ():
            for k in names:
                first = np.asarray(self.record[k].isel(time=0).values, float)
                moved[k] |= np.any(block[k] != first, axis=0)
        return {k: tuple(int(i) for i in np.flatnonzero(v)) for k, v in moved.items() if v.any()}

    @property
    def swept(self) -> bool:
        """True if the speed went one way and far enough to draw things against it."""
        speed = self.spectra["speed"].values
        most = np.abs(speed).max()
        one_way = np.abs(np.diff(speed)).sum() - abs(speed[-1] - speed[0]) <= STEADILY * most
        return bool(one_way and np.ptp(speed) > STEADILY * most)

    @property
    def has_snapshots(self) -> bool:
        """True if the record holds film pressures."""
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
        """Raise MissingError unless the shaft's angle is known and turns `least` revolutions."""
        need(self.angle_known, "The record holds no shaft angle, so nothing can be drawn over it.")
        need(self.revolutions > 1e-3, "The shaft stands still.")
        need(self.revolutions >= least,
             f"The shaft turns {self.revolutions:.2g} revolutions; this figure takes {least:g}.")  # fmt: skip


@dataclass(frozen=True)
class VectorRun(AnalysedRun):
    """Run-up vectors, in place of a record over time."""

    @cached_property
    def tracked(self) -> xr.Dataset:
        """Complex amplitudes over the speed, as `track_orders` has them."""
        lag = self.record["phase"].transpose("speed", "order", "axis").values
        size = self.record["amplitude"].transpose("speed", "order", "axis").values
        speed = self.record["speed"].values
        return xr.Dataset(
            {"amplitude": (("window", "order", "axis"), size * np.exp(-1j * lag))},
            {
                "speed": ("window", speed),
                "time": ("window", np.zeros(speed.size)),
                "order": self.record["order"].values,
                "axis": self.record["axis"].values,
            },
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Peaks and speeds."""
        orders, axes = self.tracked["order"].values, self.tracked["axis"].values
        peaks = [peak for n in orders for axis in axes for peak in find_resonances(self.tracked, int(n), str(axis))[:1]]
        rpm = self.tracked["speed"].values * TO_RPM
        ends = {"min": float(rpm.min()), "max": float(rpm.max()), "first": float(rpm[0]), "last": float(rpm[-1])}
        return {"peaks": peaks, "start_transient_s": 0.0, "speed_rpm": ends}

    @property
    def axes(self) -> dict[str, str]:
        """Label of each axis that was measured."""
        return {str(axis): f"disc {axis}" for axis in self.tracked["axis"].values}

    @property
    def swept(self) -> bool:
        """Vectors always go over the speed."""
        return True

    @property
    def speed_known(self) -> bool:
        """Vectors always state the speed."""
        return True


LONE = "lone_probe"
"""Attribute of an analysed record whose only displacement is that of a probe."""


def analyse(record: xr.Dataset) -> AnalysedRun:
    """An open record with what figures need of it; raises DataError for one without any displacement."""
    return VectorRun(record) if "order" in record.dims else AnalysedRun(prepared(_with_lone_probe(record)))


def _with_lone_probe(record: xr.Dataset) -> xr.Dataset:
    """The record with the readings of its first displacement probe as x, and nothing as y, where it has no motion."""
    if READINGS not in record or any(name in record for name in ("disc", "disc_measured")):
        return record
    name = next((n for n, unit in zip(probe_names(record), probe_units(record), strict=True) if unit == "m"), None)
    if name is None:
        return record
    reading = np.asarray(record[READINGS].isel(probe=probe_names(record).index(name)).values, float)
    motion = np.column_stack([reading, np.zeros(reading.size)])
    attrs = {"units": "m", "long_name": f"displacement seen by the probe {name}"}
    found = record.assign_coords(axis=["x", "y"]).assign(disc_measured=(("time", "axis"), motion, attrs))
    return found.assign_attrs({LONE: name})


@dataclass(frozen=True)
class RecordSection:
    """A figure of the page of a record: `find` gives its data or raises MissingError, `draw` and `caption` use them."""

    title: str
    find: Callable[[AnalysedRun], Any]
    draw: Callable[[AnalysedRun, Any], go.Figure]
    caption: Callable[[AnalysedRun, Any], str]


SECTIONS: dict[str, RecordSection] = {}
"""Sections of pages of records by name."""
Draw = Callable[[AnalysedRun, Any], go.Figure]


def record_section(
    title: str, find: Callable[[AnalysedRun], Any], caption: Callable[[AnalysedRun, Any], str]
) -> Callable[[Draw], Callable[[xr.Dataset], go.Figure]]:
    """Decorator that registers a section under the name of the function that draws it.

    In place of that function stands one of the record alone, with the same documentation, for single figures; it raises
    DataError where the record holds nothing for them.
    """

    def register(draw: Draw) -> Callable[[xr.Dataset], go.Figure]:
        SECTIONS[draw.__name__] = section = RecordSection(title, find, draw, caption)

        def figure(record: xr.Dataset) -> go.Figure:
            run = analyse(record)
            try:
                return section.draw(run, section.find(run))
            except MissingError as missing:
                raise DataError(f"record: no figure '{title}': {missing}", argument="record", value=title) from missing

        figure.__name__, figure.__qualname__, figure.__doc__ = draw.__name__, draw.__qualname__, draw.__doc__
        figure.__module__ = draw.__module__
        return figure

    return register


def need_motion(run: AnalysedRun) -> None:
    """Raise MissingError unless the disc moves."""
    d = run.record[displacement_name(run.record)]
    need(bool(np.ptp(d.isel(time=slice(0, 50_000)).values, axis=0).any() or run.summary["largest_orbit"]["um"] > 0),
         "The disc does not move.")  # fmt: skip


def need_time(run: AnalysedRun) -> None:
    """Raise MissingError for vectors, which hold no motion over time."""
    need(not isinstance(run, VectorRun), "The file holds vectors over the speed, no motion over time.")


def need_plane(run: AnalysedRun) -> None:
    """Raise MissingError unless x and y were measured."""
    need(not run.lone, f"Probe {run.lone} alone does not see both x and y.")
    need(len(run.axes) > 1, "One axis alone makes no orbit.")


def need_turns(run: AnalysedRun) -> None:
    """Raise MissingError unless the disc moves and the shaft turns round."""
    run.need_turning()
    need_motion(run)


def need_orders(run: AnalysedRun) -> None:
    """Raise MissingError unless orders were tracked."""
    if isinstance(run, VectorRun):
        return
    need_turns(run)
    reason = f"The shaft turns {run.revolutions:.2g} revolutions; orders are fitted over 8 within 0.25 to 30 s."
    need(run.tracked.sizes["window"] > 0, reason)


def end_of_run(extreme: dict[str, Any]) -> str:
    """Rest of a sentence about an extreme that lies at an end, where it may be larger beyond; else empty.

    The end is that of the run, or for an order that of the windows in which it was tracked.
    """
    whole = "tracked speeds" if "order" in extreme else "run"
    return f", at the {extreme['at_end']} of the {whole}" if extreme["at_end"] else ""


def sensed(run: AnalysedRun) -> str:
    """Sentence, after a space, on the displacement that a figure is made of, where the record holds two."""
    both = "disc" in run.record and "disc_measured" in run.record
    return " Made from the measured displacement." if both and run.output == "disc_measured" else ""


def slow_roll_text(run: AnalysedRun) -> str:
    """Sentence, after a space, on the slow roll that was subtracted; empty where none was."""
    done = str(run.record.attrs.get(ATTRIBUTE, ""))
    return f" Slow roll was {done}." if done else ""

"""Input and output spectra of a record over whole periods, and the index of the data vector that they make.

Lines are averages of the DFTs of whole periods of the excitation (of whole revolutions where it has none), in metres,
0-pk, for both sensors; below them the mean and the drift of the slow part. The twin's response to the same inputs goes
through the same averages, so a leak would be in both.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from identification.records.schema import measured
from identification.records.sensors import DISPLACEMENTS, SAME_PLACE
from rotorsim.base.constants import MPA, RIG_SAMPLE, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.blocks import (
    TURNING,
    broken_orders,
    find_period,
    find_window,
    on_lines,
)

if TYPE_CHECKING:
    import xarray as xr


HIGHEST = 300.0
"""Highest line [Hz] that is compared."""
LEAD = 0.4
"""Time [s] for which the twin of a periodic record runs before the one period that is compared."""
OFF_AXES = 0.02
"""Sine of twice an angle from which a probe stands off the axes: half a degree."""


@dataclass(frozen=True, eq=False)
class Trial:
    """Inputs rows (n, 6) as `Simulation.advance` takes them, angle [rad] at the start, window of `blocks` x `length`
    samples from `start`, and the measured blocks' DFTs (blocks, 2, lines) [m]."""

    name: str
    role: str
    rows: np.ndarray
    pressure: float
    angle: float
    start: int
    length: int
    blocks: int
    spectra: np.ndarray
    excited: np.ndarray
    orders: tuple[int, ...] = ()
    """Orders of a run-up's vectors; none for a record at constant speed."""
    periodic: bool = False
    """Whether every block is one period of the excitation and holds whole turns: one of the response is complete."""
    accuracy: float = 0.0
    """Stated standard deviation [m] of the real part of a line; 0 where none is stated."""
    clock: float = 0.0
    """Stated standard deviation [s] of the clock's offset; 0 where displacements and inputs have one clock."""
    repeating: bool = False
    """Whether every block is one period of the excitation, with whole turns or not."""
    changes: Mapping[str, float] = field(default_factory=dict)
    """Changes on purpose for this record: sums by key of `twin.parameters`."""
    probe_angle: float | None = None
    """Angle [rad] from x towards y of the only probe, whose reading takes the place of x; None where both are seen."""

    @property
    def speed(self) -> float:
        """Shaft speed [rad/s]."""
        return float(self.rows[0, 0])

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of what is measured, as text."""
        if self.probe_angle is None:
            return ("x", "y")
        return (f"probe at {np.degrees(self.probe_angle):.4g} deg",)

    @property
    def off_axes(self) -> bool:
        """Whether the only probe stands neither along x nor along y."""
        return self.probe_angle is not None and abs(np.sin(2 * self.probe_angle)) > OFF_AXES

    @property
    def directions(self) -> np.ndarray:
        """Direction cosines (channels, 2) of the channels to x and y."""
        if self.probe_angle is None:
            return np.eye(2)
        return np.array([[np.cos(self.probe_angle), np.sin(self.probe_angle)]])

    def seen(self, displacement: np.ndarray) -> np.ndarray:
        """Readings (n, 2) [m] of displacements (n, 2) [m]; of a single probe in the first column."""
        if self.probe_angle is None:
            return displacement
        # of motion and of 1X runout; a probe between the axes sees another part of the surface at higher orders
        return np.column_stack([displacement @ self.directions[0], np.zeros(len(displacement))])

    @property
    def rows_of_vectors(self) -> int:
        """Number of a table's rows, each of which is a signal at a speed of its own; 1 for a record."""
        return (self.spectra.shape[2] - 1) // len(self.orders) if self.orders else 1

    def speed_at(self, line: int) -> float:
        """Shaft speed [rad/s] of a line of `spectra`."""
        return self.speed

    @property
    def least_tolerance(self) -> float:
        """Tolerance of the model, as a share of a line, that these data allow at best."""
        return 0.0

    @property
    def has_mean(self) -> bool:
        """Whether the zeros of the displacement sensors show in the data."""
        return True

    @property
    def in_motion(self) -> bool:
        """Whether a rotor on linear bearings is in its periodic motion when the rows begin."""
        return True

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies (lines,) [Hz]."""
        return np.arange(self.spectra.shape[2]) / (self.length * RIG_SAMPLE)

    @property
    def amplitude(self) -> float:
        """Largest reference [V], or force [N] where there is none."""
        reference = float(np.abs(self.rows[:, 2:4]).max())
        return reference if reference else float(np.abs(self.rows[:, 4:6]).max())

    @property
    def point(self) -> str:
        """Operating point as text with units."""
        force = "N" if not self.rows[:, 2:4].any() and self.rows[:, 4:6].any() else "V"
        pressure = f"{self.pressure / MPA:.2f} MPa, " if self.pressure else ""
        return f"{self.speed * TO_RPM:.0f} rpm, {pressure}{self.amplitude:.2g} {force}"

    @cached_property
    def inputs(self) -> str:
        """Hash of what a simulation needs, and of the window."""
        window = repr((self.start, self.length, self.blocks, self.spectra.shape, self.orders)).encode()
        window += repr(sorted(self.changes.items())).encode() if self.changes else b""
        window += repr(self.probe_angle).encode()
        return hashlib.sha256(np.ascontiguousarray(self.used).tobytes() + window).hexdigest()

    @property
    def used(self) -> np.ndarray:
        """The rows that a simulation needs."""
        return self.rows[: self.start + self.blocks * self.length]

    def lines(self, displacement: np.ndarray) -> np.ndarray:
        """DFTs (blocks, 2, lines) [m] of displacements (n, 2) [m]; orders that no line holds on the nearest ones."""
        window = (self.start, self.length, self.blocks)
        moved = on_lines(self.seen(displacement), window, self.speed, self.angle, self.broken)
        return block_lines(moved, *window, self.spectra.shape[2])

    @cached_property
    def broken(self) -> np.ndarray:
        """Orders (k,) that no line of a block holds; only blocks that repeat show them apart."""
        return _broken(self.repeating, self.speed, self.length, self.blocks)

    @property
    def lead(self) -> int:
        """Samples before the window from which a twin without slow states has forgotten how it began; 0 for none."""
        wanted = round(LEAD / RIG_SAMPLE)
        return wanted if self.periodic and self.start >= wanted else 0

    @cached_property
    def balanced(self) -> bool:
        """Whether the reference has no mean over a period."""
        one = self.rows[self.start : self.start + self.length, 2:4]
        return bool(np.abs(one.mean(axis=0)).max() <= 1e-3 * max(np.abs(one).max(), 1e-300))

    @property
    def short(self) -> tuple[np.ndarray, float]:
        """Rows (n, 6) that lead into one period and hold it, and the shaft angle [rad] at their beginning."""
        first = self.start - self.lead
        turned = self.angle + float(np.sum(self.rows[:first, 0])) * RIG_SAMPLE
        return self.rows[first : self.start + self.length], turned

    def short_lines(self, displacement: np.ndarray) -> np.ndarray:
        """DFTs (blocks, 2, lines) [m] of the response (n, 2) [m] to `short`: all blocks are alike."""
        one = block_lines(self.seen(displacement), self.lead, self.length, 1, self.spectra.shape[2])
        return np.repeat(one, self.blocks, axis=0)

    def vector(self, spectra: np.ndarray) -> np.ndarray:
        """Real data vector of blocks' DFTs: for each channel the mean, the drift, real and imaginary parts [m]."""
        mean = spectra.mean(axis=0)
        drift = (spectra[-1] - spectra[0])[:, 0].real
        parts = [np.column_stack([mean[:, 0].real, drift]), mean[:, 1:].real, mean[:, 1:].imag]
        return np.concatenate(parts, axis=1).ravel()


def block_lines(displacement: np.ndarray, start: int, length: int, blocks: int, count: int) -> np.ndarray:
    """DFTs (blocks, 2, count) [m, 0-pk] of consecutive blocks of displacements (n, 2)."""
    cut = displacement[start : start + blocks * length].reshape(blocks, length, 2)
    spectra = np.fft.rfft(cut, axis=1)[:, :count].transpose(0, 2, 1) * (2 / length)
    spectra[:, :, 0] /= 2
    return np.asarray(spectra)


def planned_trial(name: str, rows: np.ndarray) -> Trial:
    """Trial of an experiment that is yet to be made, by its inputs (n, 6); its measured spectra are zero."""
    return trial_of(rows, np.zeros((len(rows), 2)), 0.0, name)


def trial_of(rows: np.ndarray, displacement: np.ndarray, angle: float, name: str) -> Trial:
    """Trial of inputs (n, 6), displacements (n, 2) [m] and the angle [rad] at the first sample."""
    speed, n = float(rows[0, 0]), len(rows)
    period = find_period(rows[:, 2:4]) if rows[:, 2:4].any() else None
    window = start, length, blocks = find_window(rows, speed, n, name, period)
    count, repeating = min(int(HIGHEST * length * RIG_SAMPLE) + 1, length // 2), period == length
    broken = _broken(repeating, speed, length, blocks)
    spectra = block_lines(on_lines(displacement, window, speed, angle, broken), *window, count)
    return Trial(
        name, "fit", rows, float(rows[0, 1]), angle, *window, spectra, _excited(rows, start, length, blocks, count),
        periodic=repeating and not len(broken), repeating=repeating,
    )  # fmt: skip


def displacement_of(record: xr.Dataset, name: str) -> tuple[np.ndarray, float | None]:
    """Measured displacement (n, 2) [m], and the angle [rad] of the probe if there is only one: then y is zero."""
    found = measured(record, "disc")
    if found is not None:
        return found, None
    probe = only_probe(record)
    if probe is None:
        raise DataError(f"{name}: has no disc_measured; map the displacement sensors")
    reading = np.asarray(probe.values, float) / float(probe["probe_gain"])
    return np.column_stack([reading, np.zeros(len(reading))]), float(probe["probe_angle"])


def only_probe(record: xr.Dataset) -> xr.DataArray | None:
    """The one displacement probe (n,) of a record, at its disc if that is stated; None for another number of them."""
    needed = {"probe_quantity", "probe_angle", "probe_gain", "probe_position"}
    if "probe_measured" not in record or not needed <= set(record.coords):
        return None
    of_use = np.isin(record["probe_quantity"].values, DISPLACEMENTS)
    if "disc_position" in record.attrs:
        of_use &= np.abs(record["probe_position"].values - float(record.attrs["disc_position"])) < SAME_PLACE
    chosen = np.flatnonzero(of_use)
    return record["probe_measured"].isel(probe=int(chosen[0])) if len(chosen) == 1 else None


def _broken(repeating: bool, speed: float, length: int, blocks: int) -> np.ndarray:
    """Orders (k,) that no line of a block holds; only blocks that repeat show them apart."""
    apart = repeating and abs(speed) > TURNING
    return broken_orders(speed, length, blocks, HIGHEST) if apart else np.zeros(0)


def _excited(rows: np.ndarray, start: int, length: int, blocks: int, count: int) -> np.ndarray:
    """Which lines (count,) an input excites."""
    drive = rows[:, 2:4] if rows[:, 2:4].any() else rows[:, 4:6]
    spectra = np.abs(block_lines(drive, start, length, blocks, count)).mean(axis=0).max(axis=0)
    top = spectra[1:].max() if count > 1 else 0.0
    found = spectra > 1e-3 * top if top > 0 else np.zeros(count, bool)
    found[0] = False
    return np.asarray(found)


BANDS = ((0.0, 90.0), (90.0, 150.0), (150.0, 1e9))
"""Bands [Hz] of excited lines: below, about and above the first natural frequencies of a rig of this size."""


@dataclass(frozen=True, eq=False)
class DataLayout:
    """Record, channel 0 or 1, frequency [Hz] (0: slow part) and group of every number (n,); `groups` names them."""

    record: np.ndarray
    channel: np.ndarray
    frequency: np.ndarray
    group: np.ndarray
    drift: np.ndarray
    groups: tuple[str, ...]

    def of(self, record: int, channel: int, group: str) -> np.ndarray:
        """Which numbers (n,) are one group's."""
        return (self.record == record) & (self.channel == channel) & (self.group == self.groups.index(group))


EXCITED = ("low band", "resonance", "high band")
GROUPS = ("slow", "1X", "2X", "3X", "orders", *EXCITED, "between")


def make_layout(trials: list[Trial]) -> DataLayout:
    """Layout of the concatenated data vectors of the trials."""
    parts = [_numbers_of_record(t, i) for i, t in enumerate(trials)]
    joined = [np.concatenate([p[k] for p in parts]) for k in range(5)]
    return DataLayout(joined[0], joined[1], joined[2], joined[3], joined[4], GROUPS)


def _numbers_of_record(trial: Trial, number: int) -> tuple[np.ndarray, ...]:
    if trial.orders:
        return _numbers_of_vectors(trial, number)
    f = trial.frequencies[1:]
    group = np.full(len(f), GROUPS.index("between"))
    for band, name in zip(BANDS, EXCITED, strict=True):
        group[trial.excited[1:] & (f >= band[0]) & (f < band[1])] = GROUPS.index(name)
    turns = abs(trial.speed) / (2 * np.pi)
    if abs(trial.speed) > TURNING:
        resolution = f[0]
        order = np.round(f / turns)
        near = (np.abs(f - order * turns) < 0.51 * resolution) & (order >= 1)
        group[near] = GROUPS.index("orders")
        for k in (1, 2, 3):
            group[near & (order == k)] = GROUPS.index(f"{k}X")
    group = np.concatenate([[0, 0], group, group])
    frequency = np.concatenate([[0.0, 0.0], f, f])
    drift = np.zeros(len(group), bool)
    drift[1] = True
    n = len(group)
    channel = np.repeat([0, 1], n)
    return (np.full(2 * n, number), channel, np.tile(frequency, 2), np.tile(group, 2), np.tile(drift, 2))


def _numbers_of_vectors(trial: Trial, number: int) -> tuple[np.ndarray, ...]:
    """Groups of a run-up's vectors are the orders."""
    rows = (trial.spectra.shape[2] - 1) // len(trial.orders)
    names = [GROUPS.index(f"{n}X" if n < 4 else "orders") for n in trial.orders]
    group, f = np.repeat(names, rows), trial.frequencies[1:]
    group, frequency = np.concatenate([[0, 0], group, group]), np.concatenate([[0.0, 0.0], f, f])
    drift = np.zeros(len(group), bool)
    drift[1] = True
    channel = np.repeat([0, 1], len(group))
    return (np.full(2 * len(group), number), channel, np.tile(frequency, 2), np.tile(group, 2), np.tile(drift, 2))

"""Run-ups as trials: tables of vectors (1X, 2X, 3X over the speed), and records over time that become such tables.

The twin makes a transient run-up over the same speeds and its orders are tracked the same way: least squares over whole
revolutions about each speed of the table. The phase of vectors belongs to the shaft angle of their mark.

A run-up or coast-down over time is taken as a table of vectors. A record counts as one if it has an angle, its speed
sweeps and nothing excites the rotor but its own turning.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from identification.records.schema import measured, notes_of, probe_angle, with_notes
from rotorsim.base.constants import RIG_SAMPLE, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.intake import stated_accuracy
from rotorsim.discrepancy.data.runup_vectors import SWEEP, order_vectors, runup_vectors
from rotorsim.discrepancy.data.spectra import Trial

if TYPE_CHECKING:
    import xarray as xr


RATE = 2 * np.pi * 2.0
"""Rate [rad/s2] of a run-up whose table states none: 120 rpm/s, slow enough for most rotors."""
LONGEST = 15.0
"""Longest run-up [s] that is simulated where the table states no rate."""
MOST_TURNS = 1000
"""Revolutions that no window reaches."""
FEWEST = 12
"""Fewest speeds of a table."""
SETTLING = 0.5
"""Time [s] before a run-up in which a rotor comes into its motion."""
TURNS = 8.0
"""Revolutions of a vector's window where the table does not state them."""
RECORDED = "recorded"
"""Attribute of a table that was made here of a record over time."""
TOLERANCE = 0.01
"""Tolerance of vectors: how they were tracked is not known."""
ROLES = ("fit", "fit", "held_out", "fit", "fit", "untouched")
"""Use of each of six rows, unless the whole table has one use."""


@dataclass(frozen=True, eq=False)
class RunupTrial(Trial):
    """Run-up table as a trial: speeds (k,) [rad/s], orders, measured vectors (orders, 2, k) [m]."""

    speeds: np.ndarray = field(default_factory=lambda: np.zeros(0))
    turns: float = TURNS
    """Revolutions that a vector is fitted over."""
    recorded: bool = False
    """Whether the table comes from a record over time, so that the rotor was in motion before it."""
    alone: bool = True
    """Whether no records at constant speed are diagnosed with it, whose means show the zeros of the sensors."""

    @property
    def has_mean(self) -> bool:
        """Whether the sensors' zeros are fitted to the means of the table, which are 0, for want of others."""
        return self.alone

    @property
    def in_motion(self) -> bool:
        """Whether a rotor on linear bearings is in its periodic motion when the rows begin."""
        return self.recorded

    @property
    def point(self) -> str:
        """The range of speeds as text."""
        return f"run-up, {min(self.speeds) * TO_RPM:.0f} to {max(self.speeds) * TO_RPM:.0f} rpm"

    @cached_property
    def inputs(self) -> str:
        """Every part of a table is tracked at its own speeds."""
        return hashlib.sha256(
            self.rows.tobytes()
            + self.speeds.tobytes()
            + repr((self.orders, self.turns, self.probe_angle)).encode()
            + (b"recorded" if self.recorded else b"")
            + (repr(sorted(self.changes.items())).encode() if self.changes else b"")
        ).hexdigest()

    def speed_at(self, line: int) -> float:
        """Shaft speed [rad/s] of the row that a line of `spectra` is of."""
        return float(self.speeds[max(line - 1, 0) % len(self.speeds)])

    @property
    def least_tolerance(self) -> float:
        """Tolerance of the model, as a share of a vector, that these data allow at best."""
        return TOLERANCE

    @property
    def frequencies(self) -> np.ndarray:
        """A row's number stands for its frequency: rows are not lines of one spectrum."""
        return np.arange(self.spectra.shape[2], dtype=float)

    def lines(self, displacement: np.ndarray) -> np.ndarray:
        """Vectors (1, 2, 1 + orders x rows) of displacements (n, 2) [m]; the first, for the mean, is 0 here."""
        speed = self.rows[: len(displacement), 0]
        return track(self.seen(displacement), speed, self.angle, self.speeds, self.orders, self.turns)


def track(
    displacement: np.ndarray, speed: np.ndarray, angle: float, speeds: np.ndarray, orders: Sequence[int],
    turns: float = TURNS,
) -> np.ndarray:  # fmt: skip
    """Complex amplitudes (1, 2, 1 + orders x rows) [m, 0-pk], phase lag negative, by least squares over `turns`."""
    turned = angle + np.concatenate([[0.0], np.cumsum(speed)[:-1] * RIG_SAMPLE])
    out = np.zeros((1, 2, 1 + len(orders) * len(speeds)), complex)
    rising = speed[-1] >= speed[0]
    for k, wanted in enumerate(speeds):
        centre = int(np.searchsorted(speed if rising else -speed, wanted if rising else -wanted))
        half = int(0.5 * turns * 2 * np.pi / max(wanted, 1.0) / RIG_SAMPLE)
        low, high = max(0, centre - half), min(len(speed), centre + half)
        out[0, :, 1 + k :: len(speeds)] = order_vectors(turned[low:high], displacement[low:high], orders).T
    return out


def make_sweeps(vectors: xr.Dataset, name: str, film: bool, whole: str = "") -> list[RunupTrial]:
    """Trials from a table of vectors: fitted, held-out and untouched rows; raises DataError if it is too small.

    Where the `whole` table has one use, that of all rows.
    """
    speeds = np.asarray(vectors["speed"].values, float)
    orders = tuple(int(n) for n in vectors["order"].values)
    if len(speeds) < FEWEST:
        raise DataError(f"{name}: {len(speeds)} speeds are too few to distinguish effects; give at least {FEWEST}")
    pressure = float(vectors.attrs.get("pressure", 0.0))
    if film and pressure <= 0:
        raise DataError(f"{name}: vectors of a gas bearing need its pressure [Pa] in the attribute 'pressure'")
    measured = vectors["amplitude"].values * np.exp(-1j * vectors["phase"].values)
    angle = None if vectors.sizes["axis"] == 2 else probe_angle(vectors)
    if angle is not None:
        measured = np.concatenate([measured, np.zeros_like(measured)], axis=2)
    rate = stated_rate(vectors, name) or assumed_rate(speeds)
    accuracy = stated_accuracy(vectors, name)
    turns = stated_turns(vectors, name)
    recorded = bool(vectors.attrs.get(RECORDED, False))
    rows = ramp(speeds, rate, pressure, turns, recorded)
    role = np.array([whole or ROLES[k % 6] for k in range(len(speeds))])
    return [
        replace(
            _part(name, which, rows, pressure, speeds[role == which], measured[role == which], orders, accuracy),
            probe_angle=angle,
            turns=turns,
            recorded=recorded,
        )
        for which in ((whole,) if whole else ("fit", "held_out", "untouched"))
    ]


def stated_turns(vectors: xr.Dataset, name: str) -> float:
    """Attribute `turns` of a table of vectors, TURNS where there is none; raises DataError below one revolution."""
    value = vectors.attrs.get("turns", TURNS)
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = 0.0
    if not 1 <= found < MOST_TURNS:
        raise DataError(f"{name}: turns is {value!r}; give the revolutions that a vector is fitted over, from 1 to 999")
    return found


def stated_rate(vectors: xr.Dataset, name: str) -> float:
    """Attribute `rate` [rad/s2] of a table of vectors, 0 if it has none; raises DataError if it is not positive."""
    value = vectors.attrs.get("rate")
    if value is None:
        return 0.0
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = -1.0
    if not 0 < found < np.inf:
        raise DataError(
            f"{name}: the ramp rate is {value!r}; give a positive number of rad/s2, e.g. 12.6 for 120 rpm/s"
        )
    return found


def assumed_rate(speeds: np.ndarray) -> float:
    """Ramp rate [rad/s2] of a table that states none."""
    return max(RATE, float(np.ptp(speeds)) / LONGEST)


def rate_notes(opened: Sequence[tuple[str, xr.Dataset]]) -> list[str]:
    """Sentences on tables whose ramp rate had to be assumed."""
    return [
        f"{name}: no ramp rate is stated; {assumed_rate(vectors['speed'].values) * TO_RPM:.0f} rpm/s is assumed; "
        "state it in the mapping, [conditions] rate = '229 rpm/s', because it shifts and beats resonances"
        for name, vectors in opened
        if not stated_rate(vectors, name)
    ]


def ramp(
    speeds: np.ndarray, rate: float, pressure: float, turns: float = TURNS, settled: bool = False
) -> np.ndarray:  # fmt: skip
    """Input rows (n, 6) of a run-up over the speeds [rad/s] at a rate [rad/s2], with time to settle before.

    At either end it holds the window of `turns` revolutions about the last speed. That time comes before the lowest
    speed, or with `settled` before the first one, which in a coast-down is the highest.
    """
    low, high = min(speeds), max(speeds)
    window = 0.6 * max(turns, TURNS) * 2 * np.pi * rate
    begin, end = max(low - window / max(low, 1.0) - SETTLING * rate, 1.0), high + window / max(high, 1.0)
    if settled and speeds[-1] < speeds[0]:
        begin, end = max(low - window / max(low, 1.0), 1.0), end + SETTLING * rate
    n = int((end - begin) / rate / RIG_SAMPLE)
    rows = np.zeros((n, 6))
    rows[:, 0], rows[:, 1] = begin + rate * RIG_SAMPLE * np.arange(1, n + 1), pressure
    if speeds[-1] < speeds[0]:
        rows[:, 0] = rows[::-1, 0]
    return rows


def _part(
    name: str, role: str, rows: np.ndarray, pressure: float, speeds: np.ndarray, measured: np.ndarray,
    orders: tuple[int, ...], accuracy: float,
) -> RunupTrial:  # fmt: skip
    """Some rows of a table as a trial; measured (rows, orders, 2) [m]."""
    k = len(speeds)
    spectra = np.zeros((1, 2, 1 + len(orders) * k), complex)
    for i in range(len(orders)):
        spectra[0, :, 1 + i * k : 1 + (i + 1) * k] = measured[:, i, :].T
    none = np.zeros(spectra.shape[2], bool)
    return RunupTrial(
        f"{name}, {role}", role, rows, pressure, 0.0, 0, len(rows), 1, spectra, none, orders, accuracy=accuracy,
        speeds=speeds,
    )  # fmt: skip


def empty_sweep(speeds: np.ndarray, pressure: float, orders: tuple[int, ...] = (1, 2, 3)) -> RunupTrial:
    """Table of vectors without numbers at speeds (k,) [rad/s], rising or falling."""
    rows, nothing = ramp(speeds, RATE, pressure), np.zeros((len(speeds), len(orders), 2), complex)
    return _part("next", "fit", rows, pressure, speeds, nothing, orders, 0.0)


def planned_sweep(like: RunupTrial, rate: float, probe_angle: float | None) -> RunupTrial:
    """Table of vectors that is yet to be measured: speeds, orders and turns of another at a rate [rad/s2]."""
    rows = ramp(like.speeds, rate, like.pressure, like.turns)
    nothing = np.zeros((len(like.speeds), len(like.orders), 2), complex)
    part = _part("next", "fit", rows, like.pressure, like.speeds, nothing, like.orders, like.accuracy)
    return replace(part, turns=like.turns, probe_angle=probe_angle)


LEAST_SWEEP = 2.0
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
    return bool(len(slow) and np.ptp(slow) > max(LEAST_SWEEP, SWEEP * np.abs(slow).max()))


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

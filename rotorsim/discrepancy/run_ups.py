r"""Run-ups as trials, and tables of vectors (1X, 2X, 3X over the speed) made from records over time window by window.

The twin makes a transient run-up over the same speeds and its orders are tracked the same way: least squares over whole
revolutions about each speed of the table. The phase of vectors belongs to the shaft angle of their mark.

A run-up or coast-down over time counts as a table if it has an angle, its speed sweeps and nothing excites the rotor
but its own turning. Its vectors are those of window after window of whole revolutions, without overlap,

.. math:: d(t) = d_0 + d_1 t + \sum_n \Re\{A_n e^{i n \alpha(t)}\}

by least squares over each window, from `LEAST_TURNS` on weighted by Hann's, after the hum of the mains was taken out.
In a table that was not made here all samples weigh the same. Windows that do not continue the sweep (a speed held at
the beginning or end, a dip) are left out, which a note states.

Cites: bendat_2010.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from identification import make_vectors
from identification.records.schema import measured, notes_of, probe_angle, with_notes
from rotorsim.base.errors import DataError
from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE, TO_RPM, TO_UM
from rotorsim.discrepancy.changes import RING
from rotorsim.discrepancy.data_vector import HUM, without_tones
from rotorsim.discrepancy.records import make_trial, misread_speed, stated_accuracy
from rotorsim.discrepancy.trial import TURNING, Trial, displacement_of, only_probe, stated

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
LEAST_TURNS = 2
"""Fewest revolutions of a window that is weighted: in a single one that takes 2.4 times the noise into 1X."""
WINDOW, HANN = "window", "hann"
"""Attribute of a table with what its windows are weighted, and its value; none where all samples weigh the same."""
TOLERANCE = 0.01
"""Tolerance of vectors: how they were tracked is not known."""
ROLES = ("fit", "fit", "held_out", "fit", "fit", "untouched")
"""Use of each of six rows, unless the whole table has one use."""
LEAST_SWEEP = 2.0
"""Smallest range of speed [rad/s] of a sweep."""
BLOCK = 0.05
"""Time [s] over which speeds are averaged."""
ORDERS = (1, 2, 3)
"""Multiples of the shaft speed."""
FEWEST_ROWS = 3
"""Fewest windows of a sweep."""
SAMPLES_OF_A_TURN = 4
"""Least samples of a period of the highest order."""
KEPT = ("record", "disc_position", "accuracy", "slow_roll", "changes")
"""Attributes of the record that hold for its vectors too."""
SWEEP = 0.05
"""Least span of a sweep, as a share of its highest speed."""
SAME_SPEED = 0.1
"""Relative difference of the mean speeds of a sweep, as stated and by its angle, up to which they are one."""
GAIN = 0.2
"""Least gain of speed of a window, as a share of the mean gain."""
TURNED_ROUND = (
    "the shaft turns from y to x: y, or the angle of a single probe, is mirrored, as if it turned from x to y"
)


@dataclass(frozen=True, eq=False)
class RunupTrial(Trial):
    """Run-up table as a trial: speeds (k,) [rad/s], orders, measured vectors (orders, 2, k) [m]."""

    speeds: np.ndarray = field(default_factory=lambda: np.zeros(0))
    turns: float = TURNS
    """Revolutions that a vector is fitted over."""
    recorded: bool = False
    """Whether the table comes from a record over time, so that the rotor was in motion before it."""
    hann: bool = False
    """Whether the samples of a window are weighted by Hann's."""
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
            + (b"hann" if self.hann else b"")
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
        return track(self.seen(displacement), speed, self.angle, self.speeds, self.orders, self.turns, self.hann)


def track(
    displacement: np.ndarray, speed: np.ndarray, angle: float, speeds: np.ndarray, orders: Sequence[int],
    turns: float = TURNS, hann: bool = False,
) -> np.ndarray:  # fmt: skip
    """Complex amplitudes (1, 2, 1 + orders x rows) [m, 0-pk], phase lag negative, by least squares over `turns`.

    `speed` (n,) [rad/s] are inputs, which the shaft reaches by a straight ramp where their sample ends: the reading of
    a sample has the speed before. Angles of steps in place of ramps lag by half a sample of the speed gained.
    """
    speed = np.concatenate([speed[:1], speed[:-1]])
    turned = angle + cumulative_trapezoid(speed, dx=RIG_SAMPLE, initial=0.0)
    out = np.zeros((1, 2, 1 + len(orders) * len(speeds)), complex)
    rising = speed[-1] >= speed[0]
    for k, wanted in enumerate(speeds):
        centre = int(np.searchsorted(speed if rising else -speed, wanted if rising else -wanted))
        half = int(0.5 * turns * 2 * np.pi / max(wanted, 1.0) / RIG_SAMPLE)
        low, high = max(0, centre - half), min(len(speed), centre + half)
        out[0, :, 1 + k :: len(speeds)] = order_vectors(turned[low:high], displacement[low:high], orders, hann).T
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
            hann=vectors.attrs.get(WINDOW) == HANN,
        )
        for which in ((whole,) if whole else ("fit", "held_out", "untouched"))
    ]


def stated_turns(vectors: xr.Dataset, name: str) -> float:
    """Attribute `turns` of a table of vectors, TURNS where there is none; raises DataError below one revolution."""
    wanted = "the revolutions that a vector is fitted over, from 1 to 999"
    return stated(vectors.attrs, "turns", TURNS, lambda turns: 1 <= turns < MOST_TURNS, name, "turns", wanted)


def stated_rate(vectors: xr.Dataset, name: str) -> float:
    """Attribute `rate` [rad/s2] of a table of vectors, 0 if it has none; raises DataError if it is not positive."""
    if vectors.attrs.get("rate") is None:
        return 0.0
    wanted = "a positive number of rad/s2, e.g. 12.6 for 120 rpm/s"
    return stated(vectors.attrs, "rate", 0.0, lambda rate: 0 < rate < np.inf, name, "the ramp rate", wanted)


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
    return replace(part, turns=like.turns, hann=like.hann, probe_angle=probe_angle)


def is_table(record: xr.Dataset) -> bool:
    """Whether a Dataset is a table of vectors over the speed, not a record over time."""
    return "speed" in record.dims


def with_tables(opened: Sequence[tuple[str, xr.Dataset]]) -> list[tuple[str, xr.Dataset]]:
    """Records and tables by name, with the table of vectors in place of every record whose speed sweeps."""
    return [(name, _table(record, name) if sweeps(record) else record) for name, record in opened]


def refusal(record: xr.Dataset, name: str) -> str:
    """Sentence with which a diagnosis refuses a record, whatever the machine; empty for one that it takes."""
    try:
        ((_, taken),) = with_tables([(name, record)])
        if is_table(taken):
            make_sweeps(taken, name, film=False)
        else:
            make_trial(taken, name=name)
    except DataError as error:
        return str(error).removeprefix(f"{name}: ")
    return ""


def sweeps(record: xr.Dataset) -> bool:
    """Whether a record over time is a run-up or coast-down of which vectors can be made."""
    angle, speed = (None if is_table(record) else measured(record, name) for name in ("angle", "speed"))
    if (
        angle is None
        or angle.ndim == 0
        or any(name in record and np.ptp(record[name].values, axis=0).any() for name in ("reference", "disc_force"))
    ):
        return False
    time = np.asarray(record["time"].values, float)
    if speed is None or speed.ndim == 0:
        speed = np.abs(np.gradient(np.unwrap(angle), time)) if len(time) > 1 else np.zeros(0)
    block = max(round(BLOCK * len(time) / max(float(np.ptp(time)), 1e-300)), 1)
    slow = speed[: len(speed) // block * block].reshape(-1, block).mean(axis=1)[1:]
    return bool(len(slow) and np.ptp(slow) > max(LEAST_SWEEP, SWEEP * np.abs(slow).max()))


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


def runup_vectors(record: xr.Dataset, turns: int = 8, orders: Sequence[int] = ORDERS) -> xr.Dataset:
    """Table of vectors of a run-up or coast-down, as `diagnose` takes it.

    Parameters
    ----------
    record : Dataset
        With an angle [rad] (a keyphasor's, or an encoder's) and displacements of the disc [m], or of one probe.
    turns : int
        Revolutions of a window, from 1; fewer follow a beat, more lower the scatter.
    orders : sequence of int
        Multiples of the shaft speed.

    Returns
    -------
    Dataset
        `amplitude` [m, 0-pk] and `phase` [rad, lag] (speed, order, axis); attributes `rate` [rad/s2], `turns`,
        `window` ('hann', of two revolutions and more), `pressure` [Pa], `probe_angle` [rad] of a single probe, and the
        notes of the record.

    Raises
    ------
    DataError
        For a record without angle or displacement, one whose speed does not sweep, and a sampling too coarse for an
        order. Test: ``test_runup_vectors.py``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.discrepancy.runup_vectors(runup, turns=4)["amplitude"].dims
    ('speed', 'order', 'axis')
    """
    name = str(record.attrs.get("record", "record"))
    angle, speed, time, backward = _turning(record, name)
    _check_speed(record, speed, name)
    displacement, probe_angle = displacement_of(record, name)
    displacement = displacement[-len(angle) :] if len(angle) < len(displacement) else displacement
    windows = _windows(angle, int(turns), max(orders), name)
    means = np.array([speed[w].mean() for w in windows])
    kept = _sweep(means)
    if len(kept) < FEWEST_ROWS:
        raise DataError(f"{name}: the speed does not rise or fall over {FEWEST_ROWS} windows of {turns} revolutions")
    hann = turns >= LEAST_TURNS
    displacement, hum = _without_hum(time, angle, displacement, orders, probe_angle)
    fitted = np.array([order_vectors(angle[windows[k]], displacement[windows[k]], orders, hann) for k in kept])
    middle = np.array([time[windows[k]].mean() for k in kept])
    if backward:
        if RING in str(record.attrs.get("changes", "")):
            raise DataError(
                f"{name}: the shaft turns from y to x and the sensor ring is turned; swap x and y and the sign of the "
                "ring's angle",
                argument="sensor_ring",
                value=record.attrs["changes"],
            )
        fitted[:, :, 1] *= -1
        probe_angle = None if probe_angle is None else -probe_angle
    axes = ("x", "y") if probe_angle is None else ("x",)
    fitted = fitted[:, :, : len(axes)]
    attrs = _attributes(record, probe_angle) | {"turns": float(turns)} | ({WINDOW: HANN} if hann else {})
    attrs["rate"] = float(np.median(np.abs(np.diff(means[kept]) / np.diff(middle))))
    table = make_vectors(means[kept], np.abs(fitted), -np.angle(fitted), tuple(orders), attrs, axes)
    more = [TURNED_ROUND] if backward else []
    if len(kept) < len(windows):
        more.append(f"{len(windows) - len(kept)} of {len(windows)} windows do not continue the sweep and are left out")
    return with_notes(table, [*notes_of(record), *hum, *more])


def _without_hum(
    time: np.ndarray, angle: np.ndarray, displacement: np.ndarray, orders: Sequence[int], probe_angle: float | None
) -> tuple[np.ndarray, list[str]]:
    """Displacements (n, 2) [m] of a sweep without the hum of the mains, and a sentence on each tone of it.

    Within a window the amplitudes of the orders may bend, as they do at a resonance. A whirl along a line that keeps
    one frequency from end to end would count as hum.
    """

    def turning(own: slice) -> np.ndarray:
        waves = [np.ones(own.stop - own.start), *(part(n * angle[own]) for n in orders for part in (np.cos, np.sin))]
        u = np.linspace(-1, 1, own.stop - own.start)
        return np.column_stack([u**power * wave for power in (0, 1, 2) for wave in waves])

    edges = np.searchsorted(angle, np.arange(angle[0], angle[-1], 2 * np.pi * TURNS))
    enough = 2 * 3 * (1 + 2 * len(orders))
    windows = [slice(low, high) for low, high in pairwise(edges) if high - low >= enough]
    left, tones = without_tones(time, displacement, windows, turning)
    names = ("x", "y") if probe_angle is None else (f"probe at {np.degrees(probe_angle):.4g} deg",)
    return left, [
        HUM.format(frequency=f, size=", ".join(f"{a * TO_UM:.2g} um in {n}" for a, n in zip(size, names, strict=False)))
        for f, size in tones
    ]


def order_vectors(angle: np.ndarray, displacement: np.ndarray, orders: Sequence[int], hann: bool) -> np.ndarray:
    """Complex amplitudes (orders, k) of displacements (n, k) over shaft angles (n,); the argument is minus the lag.

    Fitted by least squares together with a mean and a slope. With samples weighted by a Hann window little of an order
    that passes its resonance counts as its neighbours, wherever on the shaft the window begins.
    """
    columns = [np.ones_like(angle), np.linspace(-1, 1, len(angle))]
    columns += [part(n * angle) for n in orders for part in (np.cos, np.sin)]
    # c cos(n a) + s sin(n a) = Re((c - i s) exp(i n a))
    matrix = np.column_stack(columns)
    if hann:
        root = np.sin(np.pi * (np.arange(len(angle)) + 0.5) / len(angle))[:, None]
        matrix, displacement = root * matrix, root * displacement
    found = answer(np.linalg.lstsq, matrix, displacement, rcond=None)[0]
    return np.asarray(found[2::2] - 1j * found[3::2])


def _attributes(record: xr.Dataset, probe_angle: float | None) -> dict[str, Any]:
    """Attributes of the record that hold for its vectors, its mean pressure, and the single probe's angle and plane."""
    attrs: dict[str, Any] = {key: record.attrs[key] for key in KEPT if key in record.attrs}
    pressure = measured(record, "pressure")
    attrs |= {} if pressure is None else {"pressure": float(np.mean(pressure))}
    if probe_angle is None:
        return attrs
    probe = only_probe(record)
    if probe is not None and np.isfinite(float(probe["probe_position"])):
        attrs["disc_position"] = float(probe["probe_position"])
    return attrs | {"probe_angle": probe_angle}


def _windows(angle: np.ndarray, turns: int, highest: int, name: str) -> list[slice]:
    """Samples of consecutive windows of whole revolutions; raises DataError where they hold too few for an order."""
    if not 1 <= turns < len(angle):
        raise DataError(
            f"{name}: turns is {turns}; give the revolutions of a window, from 1", argument="turns", value=turns
        )
    edges = np.searchsorted(angle, np.arange(angle[0], angle[-1], 2 * np.pi * turns))
    if len(edges) > 1 and np.diff(edges).min() < SAMPLES_OF_A_TURN * highest * turns:
        raise DataError(
            f"{name}: has fewer than {SAMPLES_OF_A_TURN} samples in a period of {highest}X; ask for fewer orders"
        )
    return [slice(low, high) for low, high in pairwise(edges)]


def _turning(record: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Angle (n,) [rad] that rises, speed (n,) [rad/s] and time (n,) [s] from where the shaft turns; whether it fell."""
    angle = measured(record, "angle")
    if angle is None or angle.ndim == 0:
        raise DataError(f"{name}: has no angle of the shaft; map a keyphasor or an encoder")
    time = np.asarray(record["time"].values, float)
    turned = np.unwrap(np.asarray(angle, float))
    backward = bool(turned[-1] < turned[0])
    turned = np.maximum.accumulate(-turned if backward else turned)
    speed = np.gradient(turned, time)
    first = int(np.argmax(speed > TURNING))
    return turned[first:], speed[first:], time[first:], backward


def _check_speed(record: xr.Dataset, turning: np.ndarray, name: str) -> None:
    """Raise DataError where a speed of the record is not that at which its angle turns (n,) [rad/s], on average."""
    stated = measured(record, "speed")
    if stated is None or stated.ndim == 0:
        return
    mean, turned = float(np.mean(np.abs(stated[-len(turning) :]))), float(np.mean(turning))
    if abs(mean - turned) > SAME_SPEED * turned + 1.0:
        raise DataError(
            f"{name}: the speed is {mean:.5g} rad/s on average, but the angle turns at {turned:.5g} rad/s; "
            f"{misread_speed(mean, turned, SAME_SPEED)}",
            argument="speed",
            value=mean,
        )


def _sweep(speeds: np.ndarray) -> np.ndarray:
    """Numbers of the windows whose speeds rise, or fall, from the slowest to the fastest without a break."""
    if len(speeds) < FEWEST_ROWS or np.ptp(speeds) < SWEEP * speeds.max():
        return np.arange(0)
    low, high = int(np.argmin(speeds)), int(np.argmax(speeds))
    numbers = np.arange(low, high + 1) if low < high else np.arange(low, high - 1, -1)
    least = GAIN * np.ptp(speeds) / max(len(numbers) - 1, 1)
    kept = [int(numbers[0])]
    for k in numbers[1:]:
        if speeds[k] > speeds[kept[-1]] + least:
            kept.append(int(k))
    return np.sort(kept)

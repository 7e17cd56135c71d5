r"""Trials: inputs of a record, and spectra over blocks of whole periods of its excitation, or of whole revolutions.

Lines are averages of the DFTs of the blocks, in metres, 0-pk, for both sensors; below them the mean and the drift of
the slow part. The twin's response to the same inputs goes through the same averages, so a leak would be in both.

Orders of the shaft in blocks that do not hold a whole number of turns are analysed on the shaft angle.

.. math:: y(t) = p(t) + \sum_n \Re\{A_n e^{i n \alpha(t)}\}

with p the part that repeats from block to block. Such orders leak over the lines of a block and differ in phase from
block to block. A_n follows by least squares from what does not repeat, and each order is moved to the line nearest to
it, where all blocks agree. The map is linear, and measured and simulated displacements go through the same one.
Assumes: constant speed.

The clock of the displacements' recorder may be off from that of the inputs and the angle, by an offset and a drift.

.. math:: Y_b(f) = S(f)\,e^{-2 \pi i f (\tau + \delta\,t_b)}

Y_b are the measured lines of block b, about t_b from the middle of the window, S those of the machine. The offset tau
is calibrated where a record states how far its clock may be off (attribute `clock`, a standard deviation): at every
point of a fit it has the value that fits that record best, so that records to fit, held out and untouched each have
their own. The drift delta follows from the measured blocks alone. Assumes: the drift within a block is small against
the period of its lines.

Cites: bendat_2010.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import combinations
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.schema import measured
from identification.records.sensors import DISPLACEMENTS, SAME_PLACE
from rotorsim.base.errors import DataError
from rotorsim.base.rounding import answer
from rotorsim.base.units import MPA, RIG_SAMPLE, TO_RPM
from rotorsim.discrepancy.changes import PLANE, RING_KEY

if TYPE_CHECKING:
    import xarray as xr

HIGHEST = 300.0
"""Highest line [Hz] that is compared."""
LEAD = 0.4
"""Time [s] for which the twin of a periodic record runs before the one period that is compared."""
OFF_AXES = 0.02
"""Sine of twice an angle from which a probe stands off the axes: half a degree."""
SETTLING = 0.5
"""Beginning [s] of a record that is never compared: the twin starts at rest in equilibrium."""
UNSETTLED = 0.2
"""Change of the excited lines from the first block to the last, as a share, from which on a record begins at rest."""
ONSET = 1.5
"""The same, as a multiple of the largest change among later blocks: what is random stays, an onset fades."""
RUN_IN = 10.0
"""Time [s] for which a twin runs before the window where no period holds whole turns. It begins in the motion of its
turning and of its inputs; in this time fades what effects add to their sum."""
REPEATS = 1e-4
"""Share of a motion over whole turns that its orders may leave where it counts as repeating with them."""
LEAST_ORDERS, SHARE_OF_RATE, LEAST_TURNS = 8, 0.4, 10
"""Least number of its orders, its highest one as a share of the samples of a turn, least turns of a record."""
ROUNDING = 1e-12
"""Line of an input, as a share of its largest value, below which it is the rounding of a constant."""
ONE_SPEED = 0.05
"""Spread of speeds, as a share of the fastest, up to which they are one."""
SHORTEST_PERIOD = 0.2
"""Shortest period [s] of an excitation, and shortest window."""
TURNING = 1.0
"""Slowest speed [rad/s] that counts as turning."""
WHOLE = 0.005
"""Turns by which a block may miss whole ones: the uncertainty of the mean of a measured speed."""
LARGEST_OFFSET = 0.02
"""Largest offset [s] that may be stated."""
OFFSET_REACH = 3.0
"""Standard deviations within which an offset is searched."""
OFFSETS = 241
"""Offsets that are tried."""
REFINEMENTS = 4
"""Refinements of the best of them."""
LARGEST_DRIFT = 1e-3
"""Largest drift [1] that is searched."""


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
    hum: tuple[tuple[float, float], ...] = ()
    """Frequency [Hz] and amplitude [m] of the hum of the mains that an order or an excited line hides."""
    settled: bool = False
    """Whether the response to a force that repeats from the first sample does so too: the record begins in motion."""
    onset: float | None = None
    """Change [m] of the excited lines from the first block to the last, of a record that begins at rest by itself."""
    changes: Mapping[str, float] = field(default_factory=dict)
    """Changes on purpose for this record: sums by key of `calibration`."""
    probe_angle: float | None = None
    """Angle [rad] from x towards y of the only probe, whose reading takes the place of x; None where both are seen."""
    names: tuple[str, ...] = ()
    """Names of the probes that the channels are, where a record states them; their directions are those of the ring."""

    @property
    def speed(self) -> float:
        """Shaft speed [rad/s]."""
        return float(self.rows[0, 0])

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of what is measured, as text."""
        if self.names:
            return self.names
        if self.probe_angle is None:
            return ("x", "y")
        return (f"probe at {np.degrees(self.probe_angle):.4g} deg",)

    @property
    def stated_changes(self) -> dict[str, float]:
        """Changes on purpose without the plane that is read and, where the channels are probes, their directions."""
        return {k: v for k, v in self.changes.items() if k != PLANE and not (self.names and k == RING_KEY)}

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
    def other_plane(self) -> bool:
        """Whether its probes stand at another plane than the machine file's."""
        return PLANE in self.changes

    @property
    def has_mean(self) -> bool:
        """Whether the zeros of the displacement sensors show in the data: those of the machine file's own plane."""
        return not self.other_plane

    @property
    def in_motion(self) -> bool:
        """Whether a rotor on linear bearings is in its periodic motion when the rows begin."""
        return True

    @property
    def frequencies(self) -> np.ndarray:
        """Frequencies (lines,) [Hz]."""
        return np.arange(self.spectra.shape[2]) / (self.length * RIG_SAMPLE)

    @cached_property
    def amplitude(self) -> float:
        """Largest reference [V], or force [N] where there is none."""
        reference = float(np.abs(self.rows[:, 2:4]).max())
        return reference if reference else float(np.abs(self.rows[:, 4:6]).max())

    @cached_property
    def point(self) -> str:
        """Operating point as text with units."""
        force = "N" if not self.rows[:, 2:4].any() and self.rows[:, 4:6].any() else "V"
        pressure = f"{self.pressure / MPA:.2f} MPa, " if self.pressure else ""
        return f"{self.speed * TO_RPM:.0f} rpm, {pressure}{self.amplitude:.2g} {force}"

    @cached_property
    def inputs(self) -> str:
        """Hash of what a simulation needs, and of the window."""
        window = repr((self.start, self.length, self.blocks, self.spectra.shape, self.orders, self.settled)).encode()
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
        """Whether neither references nor forces have a mean over a period, each against its own largest one."""
        one = _inputs(self.rows[self.start : self.start + self.length])
        return bool(np.abs(one.mean(axis=0)).max() <= 1e-3)

    @property
    def from_motion(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Rows (n, 6) that repeat the excitation before the window, those of the window, and the angle [rad] before.

        Where a period holds whole turns the window is one period, and nothing has to lead into it.
        """
        turn = self.speed * RIG_SAMPLE
        period = self.rows[self.start : self.start + self.length]
        if self.periodic:
            return period[:0], period, self.angle + turn * self.start
        ahead = np.tile(period, (int(np.ceil(RUN_IN / (self.length * RIG_SAMPLE))), 1))
        window = self.rows[self.start : self.start + self.blocks * self.length]
        return ahead, window, self.angle + turn * (self.start - len(ahead))

    def lines_of_window(self, displacement: np.ndarray) -> np.ndarray:
        """DFTs (blocks, 2, lines) [m] of the response (n, 2) [m] in the window alone, or in the one period for it."""
        seen, count = self.seen(displacement), self.spectra.shape[2]
        if self.periodic:
            return np.repeat(block_lines(seen, 0, self.length, 1, count), self.blocks, axis=0)
        angle = self.angle + self.speed * RIG_SAMPLE * self.start
        moved = on_lines(seen, (0, self.length, self.blocks), self.speed, angle, self.broken)
        return block_lines(moved, 0, self.length, self.blocks, count)

    @cached_property
    def turning(self) -> bool:
        """Whether nothing but the turning excites the rotor, so that every turn may be like the last one."""
        turns = turns_of(self.speed, len(self.used))
        return not self.orders and turns >= LEAST_TURNS and not self.used[:, 2:6].any()

    @property
    def angle_of_window(self) -> float:
        """Angle [rad] of the shaft at the first sample of the window."""
        return self.angle + self.speed * RIG_SAMPLE * self.start

    def lines_of_turn(self, displacement: np.ndarray) -> np.ndarray | None:
        """DFTs (blocks, 2, lines) [m] of a motion that repeats with the turns; None of one that does not.

        By its samples (n, 2) [m] over one turn or more, from the angle of the window on.
        """
        seen = self.seen(displacement)
        waves, inverse, lines = _of_turn(self.speed, len(seen), self.length, self.blocks, self.spectra.shape[2])
        found = inverse @ seen
        left, size = np.linalg.norm(seen - waves @ found), np.linalg.norm(seen - seen.mean(axis=0))
        if not left <= max(REPEATS * size, ROUNDING * np.abs(seen).max() * np.sqrt(len(seen))):
            return None
        return np.asarray(found.T @ lines)

    @property
    def short(self) -> tuple[np.ndarray, float]:
        """Rows (n, 6) that lead into one period and hold it, and the shaft angle [rad] at their beginning."""
        first = self.start - self.lead
        turned = self.angle + float(np.sum(self.rows[:first, 0])) * RIG_SAMPLE
        return self.rows[first : self.start + self.length], turned

    def short_lines(self, displacement: np.ndarray) -> np.ndarray:
        """DFTs (blocks, 2, lines) [m] of the response (n, 2) [m] over the period of `short`: all blocks are alike."""
        one = block_lines(self.seen(displacement), 0, self.length, 1, self.spectra.shape[2])
        return np.repeat(one, self.blocks, axis=0)

    def vector(self, spectra: np.ndarray) -> np.ndarray:
        """Real data vector of blocks' DFTs: for each channel the mean, the drift, real and imaginary parts [m]."""
        mean = spectra.mean(axis=0)
        drift = (spectra[-1] - spectra[0])[:, 0].real
        if not self.has_mean and not self.orders:
            mean[:, 0], drift = 0.0, np.zeros(2)
        parts = [np.column_stack([mean[:, 0].real, drift]), mean[:, 1:].real, mean[:, 1:].imag]
        return np.concatenate(parts, axis=1).ravel()


def block_lines(displacement: np.ndarray, start: int, length: int, blocks: int, count: int) -> np.ndarray:
    """DFTs (blocks, 2, count) [m, 0-pk] of consecutive blocks of displacements (n, 2)."""
    cut = displacement[start : start + blocks * length].reshape(blocks, length, -1)
    spectra = np.fft.rfft(cut, axis=1)[:, :count].transpose(0, 2, 1) * (2 / length)
    spectra[:, :, 0] /= 2
    return np.asarray(spectra)


@lru_cache(maxsize=32)
def _of_turn(
    speed: float, n: int, length: int, blocks: int, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Waves (n, k) of a speed's [rad/s] orders over n samples, their inverse (k, n), and DFTs (blocks, k, lines)."""
    turn = 2 * np.pi / (abs(speed) * RIG_SAMPLE)
    highest = min(max(2 * HIGHEST * RIG_SAMPLE * turn, LEAST_ORDERS), SHARE_OF_RATE * turn)
    orders = np.arange(1, max(int(highest), 1) + 1) * speed * RIG_SAMPLE

    def waves(samples: int) -> np.ndarray:
        return np.concatenate([np.ones((samples, 1)), _waves(np.outer(np.arange(samples), orders))], axis=1)

    own = waves(n)
    return own, answer(np.linalg.pinv, own), block_lines(waves(blocks * length), 0, length, blocks, count)


def planned_trial(name: str, rows: np.ndarray) -> Trial:
    """Trial of an experiment that is yet to be made, by its inputs (n, 6); its measured spectra are zero."""
    return trial_of(rows, np.zeros((len(rows), 2)), 0.0, name)


def trial_of(rows: np.ndarray, displacement: np.ndarray, angle: float, name: str) -> Trial:
    """Trial of inputs (n, 6), displacements (n, 2) [m] and the angle [rad] at the first sample."""
    speed, n = float(rows[0, 0]), len(rows)
    period = find_period(_inputs(rows)) if rows[:, 2:6].any() else None
    window = start, length, blocks = find_window(rows, speed, n, name, period)
    count, repeating = min(int(HIGHEST * length * RIG_SAMPLE) + 1, length // 2), period == length
    broken = _broken(repeating, speed, length, blocks)
    spectra = block_lines(on_lines(displacement, window, speed, angle, broken), *window, count)
    excited = _excited(rows, start, length, blocks, count)
    quiet = excited & _apart(broken, speed, length, count)
    forced = repeating and _forced(rows, length)
    onset = _onset(without_orders(displacement, speed, broken), length, quiet) if forced else None
    return Trial(
        name, "fit", rows, float(rows[0, 1]), angle, *window, spectra, excited,
        periodic=repeating and not len(broken), repeating=repeating, settled=forced and onset is None, onset=onset,
    )  # fmt: skip


def _inputs(rows: np.ndarray) -> np.ndarray:
    """References and forces (n, 4) that excite, each in its largest one: all of them have to repeat."""
    size = np.array([np.abs(rows[:, pair]).max() for pair in (slice(2, 4), slice(4, 6))])
    return rows[:, 2:6] / np.repeat(np.where(size > 0, size, 1.0), 2)


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


def _apart(orders: np.ndarray, speed: float, length: int, count: int) -> np.ndarray:
    """Which lines (count,) of a block are not next to one of these orders (k,)."""
    turns = orders * turns_of(speed, length)
    return np.asarray(np.all(np.abs(np.arange(count)[:, None] - turns) > 1.0, axis=1))


def _forced(rows: np.ndarray, length: int) -> bool:
    """Whether a force repeats from the first sample on."""
    if len(rows) < 2 * length or not rows[:, 4:6].any():
        return False
    force = rows[: 2 * length, 4:6]
    return bool(np.abs(force[length:] - force[:length]).max() <= 1e-6 * np.abs(force).max())


def _onset(displacement: np.ndarray, length: int, excited: np.ndarray) -> float | None:
    """Change [m] of the excited lines from the first block to the last; None for that of a motion that repeats."""
    blocks = len(displacement) // length
    lines = block_lines(displacement, len(displacement) % length, length, blocks, len(excited))[:, :, excited]
    change, size = (float(np.linalg.norm(one)) for one in (lines[0] - lines[-1], lines[-1]))
    # a motion that fades slowly changes among the first blocks too, what does not repeat among all of them
    return None if change < max(UNSETTLED * size, ONSET * _apart_at_most(lines[blocks // 2 :])) else change


def _apart_at_most(lines: np.ndarray) -> float:
    """Largest change [m] between any two of several blocks' lines (blocks, 2, lines)."""
    return max((float(np.linalg.norm(a - b)) for a, b in combinations(lines, 2)), default=0.0)


def with_repeats(trial: Trial, repeats: Sequence[Trial]) -> Trial:
    """The trial, in motion from its first sample on where later blocks of its `repeats` differ as its onset does.

    Two blocks alone are alike by chance in every fourth record that a random line moves; changes within two records
    add as squares. Blocks of different records are not compared: angles at the start and weights may differ.
    """
    if not trial.onset:
        return trial
    n, quiet = len(trial.rows) // trial.length, _apart(trial.broken, trial.speed, trial.length, len(trial.excited))
    own = [_apart_at_most(t.spectra[(1 if t.settled else n // 2) - n :][:, :, trial.excited & quiet]) for t in repeats]
    return replace(trial, settled=True, onset=None) if trial.onset < ONSET * np.linalg.norm(sorted(own)[-2:]) else trial


def _excited(rows: np.ndarray, start: int, length: int, blocks: int, count: int) -> np.ndarray:
    """Which lines (count,) an input excites: those of the references, and those of the forces."""
    found = np.zeros(count, bool)
    for pair in (slice(2, 4), slice(4, 6)):  # volts and newtons do not compare
        spectra = np.abs(block_lines(rows[:, pair], start, length, blocks, count)).mean(axis=0).max(axis=0)
        least = ROUNDING * np.abs(rows[:, pair]).max()  # a constant excites no line
        found |= spectra > max(1e-3 * spectra[1:].max(initial=0.0), least)
    found[0] = False
    return found


def find_window(rows: np.ndarray, speed: float, n: int, name: str, period: int | None) -> tuple[int, int, int]:
    """Start, length and number of the blocks that are compared."""
    least = int(SETTLING / RIG_SAMPLE)
    if period is not None and n >= least + period:
        blocks = (n - least) // period
        return n - blocks * period, period, blocks
    length = n - least
    if length < SHORTEST_PERIOD / RIG_SAMPLE:
        raise DataError(
            f"{name}: lasts {n * RIG_SAMPLE:.3g} s, a diagnosis needs at least {SETTLING + SHORTEST_PERIOD} s"
        )
    if rows[:, 4:6].any():
        first = int(np.argmax(rows[:, 4:6].any(axis=1)))
        least = min(least, max(first - 1, 0))
        length = n - least
    if abs(speed) > TURNING:
        turn = 2 * np.pi / abs(speed) / RIG_SAMPLE
        turns = int(length / turn)
        length = round(turns * turn) if turns else length
    # two halves where they hold whole turns too, so that the record shows its own scatter
    steady = not rows[:, 2:6].any()
    if steady and length >= 2 * SHORTEST_PERIOD / RIG_SAMPLE:
        half = length // 2
        if abs(speed) > TURNING:
            half = round(int(half / turn) * turn)
        return n - 2 * half, half, 2
    return n - length, length, 1


def find_period(signal: np.ndarray) -> int | None:
    """Period of a signal (n, 2) in samples, from the exact repetition of its end; None if there is none."""
    n = len(signal)
    tail = signal[n // 3 :]
    power = np.abs(np.fft.rfft(tail - tail.mean(axis=0), 2 * len(tail), axis=0)) ** 2
    overlap = np.arange(len(tail), 0, -1)
    correlation = np.fft.irfft(power.sum(axis=1))[: len(tail)] / overlap
    least = int(SHORTEST_PERIOD / RIG_SAMPLE)
    most = int(0.6 * len(tail))
    if most <= least or correlation[0] <= 0:
        return None
    peak = correlation[least:most].max()
    for lag in least + np.flatnonzero(correlation[least:most] > 0.98 * peak):
        moved = np.abs(tail[lag:] - tail[:-lag]).max()
        if moved < 1e-6 * np.abs(tail).max():
            return int(lag)
    return None


def turns_of(speed: float, length: int) -> float:
    """Turns in a block of `length` samples at a speed [rad/s]."""
    return abs(speed) * RIG_SAMPLE * length / (2 * np.pi)


def broken_orders(speed: float, length: int, blocks: int, highest: float) -> np.ndarray:
    """Numbers (k,) of the orders up to `highest` [Hz] that no line of a block holds."""
    turns = turns_of(speed, length)
    if blocks < 2 or abs(turns - round(turns)) <= WHOLE:
        return np.zeros(0)
    orders = np.arange(1, int(highest * length * RIG_SAMPLE / turns) + 1)
    return orders[np.abs(orders * turns - np.round(orders * turns)) > WHOLE]


def on_lines(
    displacement: np.ndarray, window: tuple[int, int, int], speed: float, angle: float, orders: np.ndarray
) -> np.ndarray:
    """Displacements (n, 2) [m] with these orders moved to the nearest lines.

    `window` is start, length and number of blocks; `angle` [rad] that of the shaft at the first sample.
    """
    start, length, blocks = window
    if not len(orders):
        return displacement
    k = np.arange(blocks * length)
    used = displacement[start : start + len(k)]
    first = angle + speed * RIG_SAMPLE * start
    line = np.sign(speed) * np.round(orders * turns_of(speed, length)) * (2 * np.pi / length)
    there = _waves(orders * first + np.outer(k, orders * speed * RIG_SAMPLE))
    moved = _waves(orders * first + np.outer(k, line))
    x = answer(np.linalg.lstsq, _unrepeated(there, blocks), _unrepeated(used, blocks), rcond=1e-9)[0]
    out = displacement.copy()
    out[start : start + len(k)] = used + (moved - there) @ x
    return out


def _waves(phases: np.ndarray) -> np.ndarray:
    """Cosines and sines (n, 2 k) of phases (n, k)."""
    return np.concatenate([np.cos(phases), np.sin(phases)], axis=1)


def without_orders(displacement: np.ndarray, speed: float, orders: np.ndarray) -> np.ndarray:
    """Displacements (n, 2) [m] less these orders (k,) of a speed [rad/s], by least squares."""
    if not len(orders):
        return displacement
    waves = _waves(np.outer(np.arange(len(displacement)), orders * speed * RIG_SAMPLE))
    return np.asarray(displacement - waves @ answer(np.linalg.lstsq, waves, displacement, rcond=None)[0])


def _unrepeated(values: np.ndarray, blocks: int) -> np.ndarray:
    """Values (n, k) less what repeats from block to block."""
    split = values.reshape(blocks, -1, values.shape[1])
    return np.asarray((split - split.mean(axis=0)).reshape(values.shape))


def stated(
    attrs: Mapping[Any, Any], key: str, usual: float, fits: Callable[[float], bool], name: str, what: str, wanted: str
) -> float:  # fmt: skip
    """Number of an attribute, `usual` where there is none; raises DataError for one that does not fit."""
    value = attrs.get(key, usual)
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = nan
    if not fits(found):
        raise DataError(f"{name}: {what} is {value!r}; give {wanted}", argument=key, value=value)
    return found


def delayed(lines: np.ndarray, frequencies: np.ndarray, offset: float) -> np.ndarray:
    """Lines (..., k) of a signal that comes `offset` [s] later."""
    return np.asarray(lines * np.exp(-2j * np.pi * frequencies * offset))


def clock_offset(
    measured: np.ndarray, simulated: np.ndarray, frequencies: np.ndarray, sd: float, sigma: np.ndarray | None
) -> tuple[float, float]:
    """Offset [s] of measured lines (2, k) after simulated ones that fits best, and its standard deviation.

    `sigma` (2, k) is the floor of a real part; without one the stated `sd` [s] only limits the search.
    """
    weight = 1.0 if sigma is None else sigma**-2
    cross = np.conj(simulated) * measured * weight
    prior = 0.0 if sigma is None else sd**-2
    omega = 2 * np.pi * frequencies

    def cost(tau: np.ndarray) -> np.ndarray:
        """Sum of squares, less what does not depend on the offset, at offsets (m,)."""
        return np.asarray(prior * tau**2 - 2 * (np.exp(1j * np.outer(tau, omega)) @ cross.sum(axis=0)).real)

    tried = np.linspace(-OFFSET_REACH * sd, OFFSET_REACH * sd, OFFSETS)
    tau = float(tried[np.argmin(cost(tried))])
    width = float(tried[1] - tried[0])
    for _ in range(REFINEMENTS):
        near = tau + width * np.array([-1.0, 0.0, 1.0])
        a, b, c = cost(near)
        bend = a - 2 * b + c
        tau += float(np.clip(0.5 * width * (a - c) / bend, -width, width)) if bend > 0 else 0.0
        width /= 8
    curvature = prior + float(np.sum(omega**2 * np.abs(simulated) ** 2 * weight))
    return tau, curvature**-0.5 if curvature > 0 else sd


def drift_of(blocks: np.ndarray, frequencies: np.ndarray, length: float) -> float:
    """Drift [1] of the clock from block to block (blocks, 2, lines), each `length` [s]; 0 where there is one block."""
    if len(blocks) < 2:
        return 0.0
    cross = np.sum(np.conj(blocks[:-1]) * blocks[1:], axis=(0, 1))
    omega = 2 * np.pi * frequencies
    tried = np.linspace(-LARGEST_DRIFT, LARGEST_DRIFT, OFFSETS) * length
    best = float(tried[np.argmax((np.exp(1j * np.outer(tried, omega)) @ cross).real)])
    for _ in range(REFINEMENTS):
        turned = np.exp(1j * omega * best) * cross
        bend = float(np.sum(omega**2 * turned.real))
        best -= float(np.sum(omega * turned.imag)) / bend if bend > 0 else 0.0
    return best / length


def without_drift(blocks: np.ndarray, frequencies: np.ndarray, length: float, drift: float) -> np.ndarray:
    """Blocks (blocks, 2, lines) as a clock without drift would show them, right in the middle of the window."""
    middle = (np.arange(len(blocks)) - 0.5 * (len(blocks) - 1)) * length
    return np.asarray(blocks * np.exp(2j * np.pi * drift * middle[:, None] * frequencies)[:, None, :])


def one_speed(trials: Sequence[Trial]) -> bool:
    """Whether all speeds are one, but for what a drive wavers."""
    speeds = [t.speed for t in trials]
    return max(speeds) - min(speeds) <= ONE_SPEED * max(map(abs, speeds))

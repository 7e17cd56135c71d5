r"""Data vector of a comparison: the groups of its lines, their noise floor, and mains hum taken out.

.. math:: \sigma^2(f) = \sigma_\mathrm{repeat}^2 + (t\,|Y(f)|)^2 + (s\,|Y_\mathrm{fine}(f) - Y_\mathrm{coarse}(f)|)^2

The scatter is that of periods within a record and of records that repeat each other, pooled over operating points and
smoothed by a median over neighbouring lines; t is the declared tolerance; of the solver's error, which is corrected for
at the re-fitted point, a share s is taken to remain.

Cites: bendat_2010.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE, TO_UM
from rotorsim.discrepancy.changes import PLANE, RING_KEY
from rotorsim.discrepancy.trial import ROUNDING, TURNING, Trial, block_lines

BANDS = ((0.0, 90.0), (90.0, 150.0), (150.0, 1e9))
"""Bands [Hz] of excited lines: below, about and above the first natural frequencies of a rig of this size."""
EXCITED = ("low band", "resonance", "high band")
GROUPS = ("slow", "1X", "2X", "3X", "orders", *EXCITED, "between")
TOLERANCE = 0.004
"""Declared tolerance of the model: share of a line."""
SOLVER_SHARE = 0.25
"""Share of the solver's error that remains after its correction."""
NEIGHBOURS = 12
"""Lines to each side whose scatter is pooled."""
FAINTEST = 1e-9
"""Smallest floor [m], that of the solver's stopping rule."""
MAINS, HEARD, MOST_OF_IT, HUM_WIDTH = (50.0, 60.0), 0.5, 0.5, 1.6
"""Frequencies [Hz] of the mains; share of the records that show a hum; share of the power next to it that it has; lines
to each side within which nothing else may stand."""
HARMONICS = (1, 2, 3, 5)
"""Multiples of the mains' frequency that are looked for."""
MAINS_OFF = 0.01
"""Share by which the mains' frequency may be off."""
LOUD = 6.0
"""Amplitude of a tone in a sweep, in standard deviations by the scatter of its windows, from which on it is hum."""
FEWEST_WINDOWS = 12
"""Fewest windows of a sweep that show such a scatter."""
SEEN = 16.0
"""Square of a tone over its variance from which on a stretch of windows shows whether it is there."""
THROUGHOUT = 0.9
"""Share of such stretches that have the tone: hum is there from end to end, a whirl sets in."""
ROUND = 0.7
"""Area of the orbit of two tones, over that of a circle of their power, from which on they are a whirl."""
HUM = "hum of the mains at {frequency:.6g} Hz, {size}, was taken out: it turns with no shaft"
"""Note on hum."""
DRIFT, FAR_DRIFT, DRIFT_LINES = 1e-8, 10.0, 3
"""Drift [m] from block to block that counts as none; times that of the other probe from which a drift is along one;
lowest lines that show a straight drift within a block."""
PROBE_DRIFT = (
    "{probe} drifts by {rate:+.2g} um/s in {count} of {of} records and the other probe of its plane does not: the"
    " probe, or the shaft along it, as over a pedestal that grows warm. The straight drift was taken out of what is"
    " compared, so that no effect is found in it or refuted by it; check that probe, and what holds it"
)
"""Note on a drift along one probe."""
FEWEST_PAIRS = 3
"""Fewest pairs of records that repeat each other whose scatter may contradict a stated accuracy."""
LN2 = 0.6931471805599453
"""Median of an exponential distribution of mean 1."""
QUIET, ROWS = "the quiet lines within the records", "neighbouring rows"
"""Sources of the scatter of records and of vectors that do not show it."""


@dataclass(frozen=True, eq=False)
class DataLayout:
    """Record, channel 0 or 1, frequency [Hz] (0: slow part) and group of every number (n,); `groups` names them."""

    record: np.ndarray
    channel: np.ndarray
    frequency: np.ndarray
    group: np.ndarray
    drift: np.ndarray
    groups: tuple[str, ...]

    @cached_property
    def numbers(self) -> dict[tuple[int, int, str], np.ndarray]:
        """Positions in the data vector of each group that has any, by record, channel and name."""
        found: dict[tuple[int, int, str], list[int]] = {}
        for i, (record, channel, group) in enumerate(zip(self.record, self.channel, self.group, strict=True)):
            found.setdefault((int(record), int(channel), self.groups[group]), []).append(i)
        return {key: np.array(own) for key, own in found.items()}


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


def repeat_scatter(trials: list[Trial], residuals: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Standard deviations from repeats: per mean line (records, 2, lines), of means and drifts (records, 2).

    `residuals` (blocks, 2, lines) are measured less simulated, so that what both do does not count as scatter. The last
    value is whether there were blocks, repeats or a stated accuracy to take it from, for records and for vectors: the
    scatter of one kind is never that of the other.
    """
    kinds = [[i for i, t in enumerate(trials) if bool(t.orders) is swept] for swept in (False, True)]
    parts = [(own, _scatter([trials[i] for i in own], [residuals[i] for i in own])) for own in kinds if own]
    scatter = np.zeros((len(trials), 2, max(r.shape[2] for r in residuals)))
    means, drifts = np.zeros((2, len(trials), 2))
    for own, (of_lines, of_means, of_drifts, _) in parts:
        scatter[own, :, : of_lines.shape[2]] = of_lines
        means[own], drifts[own] = of_means, of_drifts
    return scatter, means, drifts, all(known for _, (*_, known) in parts)


def unknown_sources(trials: list[Trial]) -> list[str]:
    """Sources of the scatter of records, and of vectors, that have no blocks, repeats or stated accuracy."""
    kinds = (([t for t in trials if not t.orders], QUIET), ([t for t in trials if t.orders], ROWS))
    return [source for own, source in kinds if own and not _known(own)]


def own_scatter(trials: list[Trial], residuals: list[np.ndarray]) -> float:
    """Scatter [m] of a line from the blocks of records alone, whatever accuracy is stated; 0 without blocks."""
    pairs = [(t, s / len(r)) for t, r in zip(trials, residuals, strict=True) if (s := _within(r)) is not None]
    lines = np.concatenate([s[0, : len(t.channels), 1:].ravel() for t, s in pairs]) if pairs else np.zeros(1)
    return float(np.sqrt(np.median(lines) / LN2 / 2))


def scatter_of_repeats(trials: list[Trial]) -> float:
    """Scatter [m] of the loudest line between records that repeat each other; 0 where fewer than `FEWEST_PAIRS` do."""
    apart = []
    for a, b in combinations((t for t in trials if not t.orders), 2):
        if repeats(a, b):
            lines = a.spectra.mean(axis=0)[: len(a.channels)]
            loudest = 1 + int(np.argmax(np.sum(np.abs(lines[:, 1:]) ** 2, axis=0)))
            apart.append((lines - b.spectra.mean(axis=0)[: len(a.channels)])[:, loudest])
    return float(np.sqrt(np.mean(np.abs(np.array(apart)) ** 2) / 4)) if len(apart) >= FEWEST_PAIRS else 0.0


def _known(trials: list[Trial]) -> bool:
    stated = any(t.accuracy or t.spectra.shape[0] > 1 for t in trials)
    return stated or any(repeats(a, b) for a, b in combinations(trials, 2))


def _scatter(trials: list[Trial], residuals: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """`repeat_scatter` of records alone, or of vectors alone: rows of a table are not lines of a spectrum."""
    squares = [_within(r) for r in residuals]
    measured = known = any(s is not None for s in squares)
    pooled = _pooled([(t, s) for t, s in zip(trials, squares, strict=True) if s is not None], trials, residuals)
    pairs = [(i, j) for i, j in combinations(range(len(trials)), 2) if repeats(trials[i], trials[j])]
    means, drifts = _slow(trials, residuals, pairs)
    known = known or any(t.accuracy for t in trials)
    lines = max(r.shape[2] for r in residuals)
    scatter = np.zeros((len(trials), 2, lines))
    for i, (trial, r) in enumerate(zip(trials, residuals, strict=True)):
        scatter[i] = pooled[:, :lines] / np.sqrt(r.shape[0])
        if trial.accuracy and not measured:
            scatter[i] = trial.accuracy
        elif trial.orders:
            scatter[i, :, : r.shape[2]] = _between_rows(trial, r)
        scatter[i] = np.maximum(scatter[i], trial.accuracy)
    if pairs:
        between = [(trials[i], np.abs(residuals[i].mean(0) - residuals[j].mean(0))[None] ** 2 / 2) for i, j in pairs]
        # quiet lines of a residual are a guess: where records repeat each other, that counts
        scatter = np.maximum(
            scatter if known else 0.0, np.repeat(_pooled(between, trials, residuals)[None], len(trials), axis=0)
        )
    return scatter, means, drifts, known or bool(pairs)


def repeats(a: Trial, b: Trial) -> bool:
    """True if two records have the same inputs and the same probes."""
    if a.orders or b.orders:
        return a.inputs == b.inputs
    same = a.rows.shape == b.rows.shape and a.start == b.start and a.length == b.length
    near = same and abs(a.speed - b.speed) < 0.5 and abs(a.pressure - b.pressure) < 5e3
    rings = {(t.changes.get(RING_KEY, 0.0), t.changes.get(PLANE)) for t in (a, b)}
    return bool(
        near and a.probe_angle == b.probe_angle and len(rings) == 1 and np.array_equal(a.rows[:, 2:], b.rows[:, 2:])
    )


def _within(residual: np.ndarray) -> np.ndarray | None:
    """Squared scatter (1, 2, lines) of a block's complex line, from blocks."""
    if residual.shape[0] < 2:
        return None
    return np.asarray(np.abs(np.diff(residual, axis=0)) ** 2 / 2).mean(axis=0, keepdims=True)


def _between_rows(trial: Trial, residual: np.ndarray) -> np.ndarray:
    """Standard deviation (2, lines) of a real part of run-up vectors: median of second differences of neighbours."""
    rows = (residual.shape[2] - 1) // len(trial.orders)
    out = np.zeros((2, residual.shape[2]))
    for i in range(len(trial.orders)):
        own = slice(1 + i * rows, 1 + (i + 1) * rows)
        bent = np.diff(residual[0, :, own], n=2, axis=1)
        out[:, own] = np.sqrt(np.median(np.abs(bent) ** 2, axis=1) / 6 / LN2 / 2)[:, None]
    return out


def _pooled(squares: list[tuple[Trial, np.ndarray]], trials: list[Trial], residuals: list[np.ndarray]) -> np.ndarray:
    """Standard deviation (2, lines) of a real part: median over records and neighbours of exponential squares.

    Of the records that measure a channel; 0 in one that none does.
    """
    lines = max(r.shape[2] for r in residuals)
    out = np.zeros((2, lines))
    for channel in range(2):
        if not squares:
            # records without repeats or periods: the quiet half of their residuals' lines
            own = [r for t, r in zip(trials, residuals, strict=True) if channel < len(t.channels)]
            quiet = [np.percentile(np.abs(r.mean(0)[channel, 1:]) ** 2, 30) for r in own]
            out[channel] = np.sqrt(np.mean(quiet) / 0.357 / 2) if quiet else 0.0
            continue
        measured = [s[:, channel] for t, s in squares if channel < len(t.channels)]
        for k in range(lines) if measured else ():
            low, high = max(1, k - NEIGHBOURS), k + NEIGHBOURS + 1
            near = np.concatenate([s[:, low:high].ravel() for s in measured])
            out[channel, k] = np.sqrt(np.median(near) / LN2 / 2) if near.size else 0.0
    return out


def _slow(
    trials: list[Trial], residuals: list[np.ndarray], pairs: list[tuple[int, int]]
) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (records, 2) of means and drifts; 0 in a channel that a record does not measure."""
    drift, mean = np.zeros((2, len(trials), 2))
    for channel in range(2):
        own = [i for i, t in enumerate(trials) if channel < len(t.channels)]
        steps = [r[-1, channel, 0].real - r[0, channel, 0].real for r in (residuals[i] for i in own) if len(r) > 1]
        lines = [np.sqrt(np.median(np.abs(residuals[i].mean(0)[channel, 1:]) ** 2) / 2) for i in own]
        if not own:
            continue
        drift[own, channel] = np.median(np.abs(steps)) / 0.6745 if steps else np.mean(lines) * 2
        mean[own, channel] = drift[own, channel] / [max(len(residuals[i]), 1) for i in own]
        apart = [(residuals[i] - residuals[j]).mean(0)[channel, 0].real for i, j in pairs if i in own]
        if apart:
            mean[own, channel] = np.maximum(mean[own, channel], np.median(np.abs(apart)) / np.sqrt(2) / 0.6745)
    return mean, np.maximum(drift, mean)


def floor(
    trials: list[Trial], layout: DataLayout, scatter: np.ndarray, means: np.ndarray, drifts: np.ndarray,
    response: np.ndarray, solver: np.ndarray, tolerance: float = TOLERANCE,
) -> np.ndarray:  # fmt: skip
    """Noise floor (n,) [m] of the data vector; response and solver (n,) [m] are data vectors."""
    sigma = np.zeros(len(layout.record))
    for i, trial in enumerate(trials):
        for channel in range(2):
            own = (layout.record == i) & (layout.channel == channel)
            lines = scatter[i, channel, 1 : trial.spectra.shape[2]]
            for frequency, hum in trial.hum:
                lines = np.hypot(lines, np.where(hum_lines(trial, frequency)[1:], hum, 0.0))
            sigma[own] = np.concatenate([[means[i, channel], drifts[i, channel]], lines, lines])
    size, error = modulus(layout, response), modulus(layout, solver)
    size[layout.drift] = 0.0
    share = np.array([max(tolerance, t.least_tolerance) for t in trials])[layout.record]
    total = sigma**2 + (share * size) ** 2 + (SOLVER_SHARE * error) ** 2 + FAINTEST**2
    return np.asarray(np.sqrt(total))


def without_hum(trials: Sequence[Trial]) -> tuple[list[Trial], list[str]]:
    """Trials without the hum of the mains, and a sentence on each line of it.

    Hum is a tone at a multiple of 50 or 60 Hz that stands in most records of several speeds: it turns with no shaft.
    Where an order lies on it the two are indistinguishable, and its size is kept for the floor.
    """
    left, notes = list(trials), []
    for frequency in (n * mains for mains in MAINS for n in HARMONICS):
        clear = [i for i, t in enumerate(left) if not t.orders and _stands_clear(t, frequency)]
        tones = {i: tone for i in clear if (tone := _tone_at(left[i], frequency)) is not None}
        if len({round(left[i].speed, 1) for i in tones}) < 2 or len(tones) < HEARD * len(clear):
            continue
        size = float(np.median([size for size, _ in tones.values()]))
        for i, trial in enumerate(left):
            if i in tones:
                left[i] = replace(trial, spectra=trial.spectra - tones[i][1])
            elif not trial.orders:
                left[i] = replace(trial, hum=(*trial.hum, (frequency, size)))
        notes.append(HUM.format(frequency=frequency, size=f"{size * TO_UM:.2g} um at every speed"))
    return left, notes


def without_tones(
    time: np.ndarray, readings: np.ndarray, windows: Sequence[slice], turning: Callable[[slice], np.ndarray]
) -> tuple[np.ndarray, list[tuple[float, np.ndarray]]]:
    r"""Readings (n, k) of a sweep without the hum of the mains; frequency [Hz] and amplitudes (k,) of its tones.

    A tone has one frequency and one phase over all `windows`. `turning` gives the columns (m, c) of a window that turn
    with the shaft. With P_w the projection that takes them out, W_w the tone's waves and d_w the readings,

    .. math:: \hat c = \Big(\sum_w W_w' P_w W_w\Big)^{-1} \sum_w W_w' P_w d_w

    so that a window in which an order lies on the tone shows nothing of it (Frisch and Waugh, 1933). The scatter of the
    windows about the one tone is its uncertainty, whatever else is in them.
    """
    t, nominal = time - time[0], np.array([n * mains for mains in MAINS for n in HARMONICS])
    middle = np.array([t[w].mean() for w in windows])
    able = nominal * (1 + MAINS_OFF) < 0.5 * (len(t) - 1) / t[-1]
    if len(windows) < FEWEST_WINDOWS or not able.any():
        return readings, []
    step = 0.25 / np.ptp(middle)
    frequencies, reach = nominal[able], MAINS_OFF * nominal[able]
    for _ in range(2):  # within a window the first pass takes another frequency for another phase
        parts = _sums_of_windows(t, readings, windows, turning, frequencies)
        heard = [_nearest_tone(*parts, i, middle, reach[i], step) for i in range(len(frequencies))]
        loud = [i for i, (_, size) in enumerate(heard) if size > LOUD]
        frequencies, reach = np.array([frequencies[i] + heard[i][0] for i in loud]), np.full(len(loud), step)
        step /= 20
        if not loud:
            return readings, []
    A, b = (part.sum(axis=0) for part in _sums_of_windows(t, readings, windows, turning, frequencies))
    found = answer(np.linalg.solve, A, b).reshape(-1, 2, readings.shape[1])
    waves = _tone_waves(t, frequencies)
    left = readings - waves @ found.reshape(len(A), -1)
    return left, [(float(f), np.hypot(*c)) for f, c in zip(frequencies, found, strict=True)]


def _tone_waves(t: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Cosine and sine (n, 2 f) of each frequency [Hz] at times (n,) [s]."""
    phase = 2 * np.pi * np.outer(t, frequencies)
    return np.stack([np.cos(phase), np.sin(phase)], axis=2).reshape(len(t), -1)


def _sums_of_windows(
    t: np.ndarray, readings: np.ndarray, windows: Sequence[slice], turning: Callable[[slice], np.ndarray],
    frequencies: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Normal matrices (windows, 2 f, 2 f) of tones and right-hand sides (windows, 2 f, k), without what turns.

    Each window has the weight of what neither turns nor is a tone in it: little at a sharp resonance.
    """
    A, b = [], []
    least = ROUNDING * float(np.mean(readings**2))
    for own in windows:
        Q, waves = answer(np.linalg.qr, turning(own))[0], _tone_waves(t[own], frequencies)
        waves, seen = (part - Q @ (Q.T @ part) for part in (waves, readings[own]))
        left = seen - waves @ answer(np.linalg.lstsq, waves, seen, rcond=1e-6)[0]
        weight = 1 / max(float(np.mean(left**2)), least, np.finfo(float).tiny)
        A.append(weight * waves.T @ waves)
        b.append(weight * waves.T @ seen)
    return np.array(A), np.array(b)


def _nearest_tone(
    A: np.ndarray, b: np.ndarray, number: int, middle: np.ndarray, reach: float, step: float
) -> tuple[float, float]:
    """Distance [Hz] of a tone from the frequency of a number, and its amplitude in standard deviations.

    The amplitude is 0 where the windows' own tones do not agree with the one tone of all. Within a window, about its
    `middle` [s], the distance only turns the phase.
    """
    own = slice(2 * number, 2 * number + 2)
    A, b = A[:, own, own], b[:, own]

    def turned(distance: float) -> tuple[np.ndarray, np.ndarray]:
        c, s = np.cos(2 * np.pi * distance * middle), np.sin(2 * np.pi * distance * middle)
        R = np.array([[c, s], [-s, c]]).transpose(2, 0, 1)
        return R.transpose(0, 2, 1) @ A @ R, R.transpose(0, 2, 1) @ b

    def gain(distance: float) -> float:
        whole, side = (part.sum(axis=0) for part in turned(distance))
        return float(np.sum(side * answer(np.linalg.solve, whole, side)))

    best = max(np.arange(-reach, reach + step, step), key=gain)
    low, top, high = gain(best - step), gain(best), gain(best + step)
    bend = low - 2 * top + high
    best += float(np.clip(0.5 * step * (low - high) / bend, -step, step)) if bend < 0 else 0.0
    parts, sides = turned(best)
    bread = answer(np.linalg.inv, parts.sum(axis=0))
    found = bread @ sides.sum(axis=0)
    if _sets_in(parts, sides, found) or _is_round(found):
        return float(best), 0.0
    each = sum(
        float(np.sum(side * (answer(np.linalg.pinv, part) @ side))) for part, side in zip(parts, sides, strict=True)
    )
    # a window's own tone in noise alone has a power of 1 in each of its numbers
    if np.sum(found * sides.sum(axis=0)) < MOST_OF_IT * (each - found.size * len(parts)):
        return float(best), 0.0
    left = (sides - parts @ found).transpose(2, 0, 1)
    spread = (bread @ (own.T @ own) @ bread for own in left)
    sizes = [c @ answer(np.linalg.pinv, V) @ c for c, V in zip(found.T, spread, strict=True)]
    return float(best), float(max(sizes)) ** 0.5


def _sets_in(parts: np.ndarray, sides: np.ndarray, tone: np.ndarray) -> bool:
    """Whether a tone (2, k) is missing in some of the windows: without it their sums of squares are no larger."""
    power, cross = (np.sum(tone * one, axis=(1, 2)) for one in (parts @ tone, sides))
    count = max(int(power.sum() / SEEN), 1)
    stretch = np.minimum((np.cumsum(power) / power.sum() * count).astype(int), count - 1)
    gains = np.bincount(stretch, 2 * cross - power)[np.unique(stretch)]
    return bool(np.mean(gains > 0) < THROUGHOUT)


def _is_round(tone: np.ndarray) -> bool:
    """Whether tones of x and y (2, 2) are in quadrature and of like size, as a whirl has them."""
    if tone.shape[1] < 2:
        return False
    area = tone[0, 0] * tone[1, 1] - tone[0, 1] * tone[1, 0]
    return bool(2 * abs(area) > ROUND * np.sum(tone**2))


def hum_lines(trial: Trial, frequency: float) -> np.ndarray:
    """Mask (lines,) of the lines that a tone at a frequency [Hz] reaches."""
    f = trial.frequencies
    return np.asarray(np.abs(f - frequency) < HUM_WIDTH * f[1])


def _quiet_lines(trial: Trial) -> np.ndarray:
    """Mask (lines,) of the lines that neither an order nor an input excites."""
    f, turns = trial.frequencies, abs(trial.speed) / (2 * np.pi)
    quiet = ~trial.excited & (f > 0)
    if abs(trial.speed) > TURNING:
        quiet &= np.abs(f - np.round(f / turns) * turns) > 0.51 * f[1]
    return np.asarray(quiet)


def _stands_clear(trial: Trial, frequency: float) -> bool:
    """Whether neither an order nor an excited line is next to a frequency [Hz] of a record."""
    f, turns = trial.frequencies, abs(trial.speed) / (2 * np.pi)
    order = abs(frequency - round(frequency / turns) * turns) if abs(trial.speed) > TURNING else np.inf
    inside = f[-1] > frequency + HUM_WIDTH * f[1]
    return bool(inside and not trial.excited[hum_lines(trial, frequency)].any() and order > HUM_WIDTH * f[1])


def _tone_at(trial: Trial, frequency: float) -> tuple[float, np.ndarray] | None:
    """Amplitude [m] and lines (blocks, 2, lines) of a tone [Hz] through all blocks; None where it is not loud."""
    f, quiet = trial.frequencies, _quiet_lines(trial)
    near = quiet & (np.abs(f - frequency) < NEIGHBOURS * f[1])
    t = np.arange(trial.blocks * trial.length) * RIG_SAMPLE
    waves = np.column_stack([np.cos(2 * np.pi * frequency * t), np.sin(2 * np.pi * frequency * t)])
    shapes = block_lines(waves, 0, trial.length, trial.blocks, len(f))
    A = np.column_stack([np.concatenate([s[:, near].real.ravel(), s[:, near].imag.ravel()])
                         for s in (shapes[:, 0], shapes[:, 1])])  # fmt: skip
    y = np.column_stack([np.concatenate([s[:, near].real.ravel(), s[:, near].imag.ravel()])
                         for s in (trial.spectra[:, 0], trial.spectra[:, 1])])  # fmt: skip
    found = answer(np.linalg.lstsq, A, y, rcond=None)[0]
    left, whole = (np.sum(one**2, axis=0) for one in (y - A @ found, y))
    # with a tone most of what is near it goes
    if not np.any(left < (1 - MOST_OF_IT) * whole):
        return None
    return float(np.hypot(*found).max()), np.einsum("kc,bkl->bcl", found, shapes)


def without_probe_drift(trials: Sequence[Trial]) -> tuple[list[Trial], list[str]]:
    """Trials without a straight drift along a single probe, and a sentence on each such probe.

    It is many times what the other probe of its plane does, and straight within the blocks too. Two probes do not show
    whether it is the probe's own or the shaft's, which may move along one of them; so the note states both.
    """
    left, drifting = list(trials), dict[str, list[float]]()
    able = [i for i, t in enumerate(trials) if not t.orders and t.blocks > 1 and len(t.channels) > 1]
    rates = {i: (trials[i].spectra[-1] - trials[i].spectra[0])[:, 0].real / (trials[i].blocks - 1) for i in able}
    for i in able:
        trial = trials[i]
        t = np.arange(trial.blocks * trial.length) / trial.length
        ramp = block_lines(np.column_stack([t, t]), 0, trial.length, trial.blocks, trial.spectra.shape[2])
        for c, channel in enumerate(trial.channels):
            step, other = rates[i][c], abs(rates[i][1 - c])
            usual = max(other, float(np.median([np.abs(rates[k]).min() for k in able])), DRIFT)
            low = slice(1, 1 + DRIFT_LINES)
            before, after = trial.spectra[:, c, low], (trial.spectra[:, c] - step * ramp[:, c])[:, low]
            if abs(step) < FAR_DRIFT * usual or np.linalg.norm(after) > 0.5 * np.linalg.norm(before):
                continue
            spectra = left[i].spectra.copy()
            spectra[:, c] -= step * (ramp[:, c] - ramp[0, c] * (np.arange(ramp.shape[2]) == 0))
            left[i] = replace(left[i], spectra=spectra)
            drifting.setdefault(channel, []).append(step / (trial.length * RIG_SAMPLE))
    return left, [
        PROBE_DRIFT.format(probe=name, rate=float(np.median(own)) * TO_UM, count=len(own), of=len(able))
        for name, own in drifting.items()
    ]


def modulus(layout: DataLayout, vector: np.ndarray) -> np.ndarray:
    """Magnitude (n,) of the spectral line to which each number belongs."""
    out = np.abs(vector)
    for i in range(layout.record.max() + 1):
        for channel in range(2):
            at = np.flatnonzero((layout.record == i) & (layout.channel == channel))[2:]
            half = len(at) // 2
            size = np.hypot(vector[at[:half]], vector[at[half:]]) / np.sqrt(2)
            out[at] = np.concatenate([size, size])
    return out

r"""Impact tests: detection of impacts, frequency response of the disc to the force, and ring-down of each axis.

The extremes of a ring-down give its logarithmic decrement and damped frequency.

.. math:: d(t) = a e^{-\sigma t} \cos(\omega_d t + \varphi), \qquad \delta = 2 \pi \sigma / \omega_d,
          \qquad \zeta = \delta / \sqrt{4 \pi^2 + \delta^2}

The logarithm of the extremes falls on a straight line of slope -sigma; they follow each other every half period.
Assumes: one mode dominates; `scatter` shows how far that holds. A rotor with two degrees of freedom has two modes,
which the motion along x and y shows together (thesis, C.6):

.. math:: \begin{bmatrix} x \\ y \end{bmatrix}(t) = \Re \sum_{j=1}^{2} c_j e^{s_j t}, \qquad
          s_j = -\zeta_j \omega_j + i \omega_j \sqrt{1 - \zeta_j^2}

by least squares over all samples, from a start by the eigensystem realisation of the decay. It also reads modes that
are damped too much to have extremes.

Cites: friswell_2010, juang_1985, thesis.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # loads its packages where they are first used: `scipy.signal` takes half a second
import xarray as xr

from identification.records.frequency_response import CrossSpectra
from rotorsim.signals.record_blocks import MissingError, Values, blocks, need, sampling_time
from rotorsim.signals.spectra import Transfer, solve

THRESHOLD = 0.05
"""A pulse is where the force exceeds this share of its largest value."""
APART = 0.01
"""Time [s] between two pulses below which they are one."""
LONGEST = 0.05
"""Longest pulse [s] of an impact."""
BEFORE = 0.5
"""Longest time [s] before a pulse from which the motion of the turning shaft is taken."""
AFTER = 2.0
"""Longest time [s] of an answer."""
LEAD = 0.002
"""Time [s] of an answer that lies before its pulse."""
ORDERS = (1, 2, 3, 4, 5, 6, 7, 8)
"""Multiples of the shaft speed in the motion before a pulse."""
TURNS = 4
"""Least turns over which orders are fitted."""


@dataclass(frozen=True)
class Pulse:
    """Samples `start` to `stop` of a pulse, the `axis` along which it is strongest and its `peak` [N]; its answer
    runs to sample `end`, and the undisturbed motion before it begins at sample `before`."""

    before: int
    start: int
    stop: int
    end: int
    axis: int
    peak: float


def find_pulses(record: xr.Dataset, name: str = "disc_force") -> list[Pulse]:
    """Impacts of a record; raises MissingError where the force does not act in short pulses.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.signals.find_pulses(impact)) > 0
    True
    """
    need(name in record, "The record has no force on the disc.")
    dt, n = sampling_time(record), record.sizes["time"]
    largest = max(float(np.abs(b[name]).max()) for b in blocks(record, (name,)))
    need(largest > 0, "No force acts on the disc.")
    edges = _edges(_above(record, name, THRESHOLD * largest), round(APART / dt))
    short = bool(len(edges)) and all(b - a <= LONGEST / dt for a, b in edges)
    need(short, f"The force on the disc does not act in pulses shorter than {LONGEST * 1e3:.0f} ms.")
    lead = max(1, round(LEAD / dt))
    pulses, free = [], 0
    for k, (a, b) in enumerate(edges):
        nearest = edges[k + 1][0] - 2 * lead if k + 1 < len(edges) else n
        end = min(nearest, a + round(AFTER / dt))
        force = np.asarray(record[name].isel(time=slice(a, b)).values, float)
        axis = int(np.abs(force).max(axis=0).argmax())
        before = max(free, a - round(BEFORE / dt))
        pulses.append(Pulse(before, a, b, end, axis, float(force[np.abs(force[:, axis]).argmax(), axis])))
        free = (b + nearest) // 2
    return pulses


def _above(record: xr.Dataset, name: str, least: float) -> np.ndarray:
    """Samples at which either component exceeds `least`."""
    found, position = [], 0
    for block in blocks(record, (name,)):
        found.append(position + np.flatnonzero(np.abs(block[name]).max(axis=1) > least))
        position += len(block[name])
    return np.concatenate(found)


def _edges(above: np.ndarray, apart: int) -> list[tuple[int, int]]:
    """First sample and sample after the last of runs of samples less than `apart` from each other."""
    cuts = np.flatnonzero(np.diff(above) > apart)
    first, last = np.append(above[:1], above[cuts + 1]), np.append(above[cuts], above[-1:])
    return [(int(a), int(b) + 1) for a, b in zip(first, last, strict=True)]


def answer(record: xr.Dataset, pulse: Pulse, output: str) -> Values:
    """`time` (n,) [s] from the pulse on, `force` (n, 2) [N] and `disc` (n, 2) [m] from just before a pulse to its
    `end`, without mean and orders of the shaft, which are fitted before the pulse."""
    lead = min(pulse.start - pulse.before, max(1, round(LEAD / sampling_time(record))))
    part = record[["time", "angle", "disc_force", output]].isel(time=slice(pulse.before, pulse.end))
    values = {str(k): np.asarray(part[k].values, float) for k in part.variables if k != "axis"}
    quiet, cut = pulse.start - pulse.before, pulse.start - pulse.before - lead
    d = values[output] - steady_motion(values["angle"], values[output], quiet)
    time = values["time"] - values["time"][quiet]
    return {"time": time[cut:], "force": values["disc_force"][cut:], "disc": d[cut:]}


def steady_motion(angle: np.ndarray, d: np.ndarray, quiet: int) -> np.ndarray:
    """Mean and, where the shaft turns enough, orders fitted to the first `quiet` samples of d (n, 2), for all."""
    if quiet < 2:
        return d[:1]
    columns = [np.ones(len(angle))]
    if abs(angle[quiet - 1] - angle[0]) >= 2 * np.pi * TURNS:
        columns += [wave(n * angle) for n in ORDERS for wave in (np.cos, np.sin)]
    basis = np.column_stack(columns)
    c, *_ = np.linalg.lstsq(basis[:quiet], d[:quiet], rcond=None)
    return np.asarray(basis @ c)


SMALLEST = 0.05
"""Smallest extreme that counts, as a share of the largest."""
NOISE = 4.0
"""Smallest extreme that counts, in rms values of the last tenth."""
FEWEST = 4
"""Fewest extremes of a decrement."""


@dataclass(frozen=True)
class Decay:
    """Damped `frequency` [Hz], `decrement` [1], damping ratio `zeta` [1], `rate` sigma [1/s], `amplitude` [unit of the
    signal] at t = 0; `time` [s] and `size` of the extremes used; rms `scatter` of their logarithms about the line."""

    frequency: float
    decrement: float
    zeta: float
    rate: float
    amplitude: float
    time: np.ndarray
    size: np.ndarray
    scatter: float


def decay_of(time: np.ndarray, signal: np.ndarray) -> Decay:
    """Fit a ring-down, signal (n,) at evenly spaced time (n,) [s].

    Raises
    ------
    MissingError
        With fewer than four extremes above the noise.

    Notes
    -----
    Test: ``test_signals.py::test_a_ring_down_gives_its_decrement_and_frequency``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> t = np.arange(0, 0.5, 2e-4)
    >>> float(round(rs.signals.decay_of(t, np.exp(-10 * t) * np.cos(700 * t)).zeta, 3))
    0.014
    """
    need(len(time) >= 32, "The ring-down is too short.")
    dt = (time[-1] - time[0]) / (len(time) - 1)
    main = dominant_frequency(signal, dt)
    smooth = _smooth(signal, main, dt)
    i = scipy.signal.find_peaks(np.abs(smooth), distance=max(1, round(0.35 / main / dt)))[0]
    i = i[time[i] - time[0] > 0.4 / main]
    tail = float(np.sqrt(np.mean(smooth[-max(8, len(smooth) // 10) :] ** 2)))
    least = max(SMALLEST * float(np.abs(smooth[i]).max(initial=0.0)), NOISE * tail)
    low = np.flatnonzero(np.abs(smooth[i]) < least)
    i = i[: low[0]] if low.size else i
    need(i.size >= FEWEST, f"The ring-down shows {i.size} extremes above the noise; a decrement takes {FEWEST}.")
    slope, level = np.polyfit(time[i], np.log(np.abs(smooth[i])), 1)
    left = np.log(np.abs(smooth[i])) - level - slope * time[i]
    frequency = 1 / (2 * float(np.polyfit(np.arange(i.size), time[i], 1)[0]))
    decrement = -float(slope) / frequency
    zeta = decrement / np.hypot(2 * np.pi, decrement)
    return Decay(frequency, decrement, float(zeta), -float(slope), float(np.exp(level)), time[i], np.abs(smooth[i]),
                 float(left.std()))  # fmt: skip


def dominant_frequency(signal: np.ndarray, dt: float) -> float:
    """Frequency [Hz] of the largest line of a decaying signal, from zero-padded spectra.

    Examples
    --------
    >>> import rotorsim as rs
    >>> t = np.arange(0, 1, 2e-4)
    >>> float(round(rs.signals.dominant_frequency(np.sin(2 * np.pi * 50 * t), 2e-4)))
    50.0
    """
    padded = 8 * len(signal)
    size = np.abs(np.fft.rfft(signal - signal.mean(), padded))
    size[:8] = 0
    return float(np.fft.rfftfreq(padded, dt)[size.argmax()])


def _smooth(signal: np.ndarray, main: float, dt: float) -> np.ndarray:
    """The signal without frequencies above twice the main one, not shifted in time."""
    if 2 * main >= 0.45 / dt:
        return signal
    return np.asarray(scipy.signal.sosfiltfilt(scipy.signal.butter(3, 2 * main, fs=1 / dt, output="sos"), signal))


MOST_DAMPED = 0.98
"""Largest damping ratio of a fitted mode."""
HANKEL = 1500
"""Most samples of a decay that its realisation takes."""
PARAMETERS = 12
"""Numbers of a fit of two modes to two axes."""
CLEAR = 60.0
"""Energy that a mode takes off the rest, in variances of its samples, above which it is none of the noise."""
HEARD = 0.0005
"""Share of the energy above the noise that may come after the samples that are fitted."""
PER_PERIOD = 12
"""Samples a period of the dominant frequency in the realisation."""


@dataclass(frozen=True)
class ModePair:
    """Two modes of a decay: natural `frequency` (2,) [Hz] ascending, damping ratios `zeta` (2,) [1].

    `clear` (2,) states whether a mode stands out of the noise, alone and within the damping that a fit can tell;
    `explained` is the share of the decay's energy that both describe.
    """

    frequency: np.ndarray
    zeta: np.ndarray
    clear: np.ndarray
    explained: float


def mode_pair(time: np.ndarray, motion: np.ndarray) -> ModePair:
    """Fit two modes to the free motion (n, 2) at evenly spaced time (n,) [s].

    Raises
    ------
    MissingError
        For fewer than 32 samples, or a motion that is none.

    Notes
    -----
    Test: ``test_signals.py::test_two_modes_of_a_decay_are_told_apart_however_damped``.

    Examples
    --------
    >>> import numpy as np, rotorsim as rs
    >>> t = np.arange(0, 0.3, 2e-4)
    >>> decay = [np.exp(-200 * t) * np.cos(500 * t), np.exp(-150 * t) * np.cos(600 * t)]
    >>> rs.signals.mode_pair(t, np.transpose(decay)).zeta.round(3).tolist()
    [0.371, 0.243]
    """
    from scipy.optimize import least_squares

    need(len(time) >= 32, "The ring-down is too short.")
    need(bool(np.ptp(motion) > 0), "The disc does not move.")
    heard = _audible(motion)
    t, motion = (time - time[0])[:heard], motion[:heard]
    scale = float(np.sqrt(np.mean(motion**2)))

    def left(p: np.ndarray) -> np.ndarray:
        basis = _decays(t, np.exp(p[:2]), p[2:])
        return np.asarray(motion - basis @ np.linalg.lstsq(basis, motion, rcond=None)[0])

    def fit(wn: np.ndarray, zeta: np.ndarray) -> Any:
        start = np.concatenate([np.log(wn), np.clip(zeta, -0.2, 0.9)])
        return least_squares(lambda p: left(p).ravel() / scale, start, bounds=free, x_scale=0.1)

    free = ([-np.inf, -np.inf, -0.5, -0.5], [np.inf, np.inf, MOST_DAMPED, MOST_DAMPED])
    main = 2 * np.pi * dominant_frequency(motion[:, np.abs(motion).max(axis=0).argmax()], t[1])
    near = [(main * np.array([1 - a, 1 + a]), np.array([z, z])) for a, z in ((0.03, 0.03), (0.06, 0.3))]
    found = min((fit(*start) for start in (_realised(t, motion, main), *near)), key=lambda one: one.cost)
    order = np.argsort(found.x[:2])
    wn, zeta = np.exp(found.x[:2][order]), found.x[2:][order]
    rest = float(np.sum(left(found.x) ** 2))
    level = rest / (motion.size - PARAMETERS)
    alone = [float(np.sum(left(np.array([np.log(w), np.log(w), z, z])) ** 2)) for w, z in zip(wn, zeta, strict=True)]
    clear = (np.array(alone[::-1]) - rest > CLEAR * level) & (zeta < 0.99 * MOST_DAMPED)
    return ModePair(wn / (2 * np.pi), zeta, clear, 1 - rest / float(np.sum(motion**2)))


def _audible(motion: np.ndarray) -> int:
    """Samples until the motion (n, 2) has sunk into the noise of its last tenth; 32 at least."""
    power = (motion**2).sum(axis=1)
    noise = power[-max(len(power) // 10, 16) :].mean()
    above = np.cumsum((power - noise)[::-1])[::-1]
    return max(int(np.searchsorted(-above, -HEARD * max(above[0], 0.0))), 32)


def _decays(t: np.ndarray, wn: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """Cosines and sines (n, 4) of two modes that decay."""
    s = wn * (-zeta + 1j * np.sqrt(1 - zeta**2))
    waves = np.exp(np.outer(t, s))
    return np.hstack([waves.real, waves.imag])


def _realised(t: np.ndarray, motion: np.ndarray, main: float) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies (2,) [rad/s] and damping ratios (2,) of four states realised around `main` [rad/s]."""
    dt = t[1] - t[0]
    step = max(1, min(round(2 * np.pi / (PER_PERIOD * max(main, 1e-9) * dt)), len(t) // 32))
    y = motion[::step][:HANKEL]
    rows = min(len(y) // 3, 60)
    columns = len(y) - rows
    H = np.concatenate([y[k : k + columns].T for k in range(rows + 1)])
    U, size, _ = np.linalg.svd(H[:-2], full_matrices=False)
    seen = U[:, :4] * np.sqrt(size[:4])
    s = np.log(np.linalg.eigvals(np.linalg.lstsq(seen[:-2], seen[2:], rcond=None)[0]).astype(complex)) / (step * dt)
    best = s[s.imag > 1e-9 * np.abs(s)]
    if len(best) < 2:
        best = main * np.array([-0.3 + 0.9j, -0.2 + 1.1j])
    return np.abs(best[:2]), -best[:2].real / np.abs(best[:2])


LEAST = 0.1
"""Shortest answer [s] that is used."""


@dataclass(frozen=True)
class RingDown:
    """A pulse, its answer (`answer`), decay along the pulse and two modes; `why`: the reason if there is no decay."""

    pulse: Pulse
    values: Values
    decay: Decay | None
    why: str
    modes: ModePair | None = None


def ring_downs(record: xr.Dataset, output: str) -> list[RingDown]:
    """Ring-down after the strongest pulse along x and along y.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.ring_downs(impact, "disc")
    """
    pulses = find_pulses(record)
    strongest = [max((p for p in pulses if p.axis == k), key=lambda p: abs(p.peak), default=None) for k in (0, 1)]
    return [_ring_down(record, p, output) for p in strongest if p is not None]


def _ring_down(record: xr.Dataset, pulse: Pulse, output: str) -> RingDown:
    values = answer(record, pulse, output)
    free = values["time"] > (pulse.stop - pulse.start) * sampling_time(record)
    time, disc = values["time"][free], values["disc"][free]
    try:
        modes = mode_pair(time, disc)
    except MissingError:
        modes = None
    try:
        return RingDown(pulse, values, decay_of(time, disc[:, pulse.axis]), "", modes)
    except MissingError as missing:
        return RingDown(pulse, values, None, str(missing), modes)


def impact_transfer(record: xr.Dataset, output: str, most: float) -> Transfer:
    """H1 (m/N) averaged over the answers to all impacts, each cut before the next; frequencies up to `most` [Hz].

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.impact_transfer(impact, "disc", 500.0)
    """
    dt, pulses = sampling_time(record), find_pulses(record)
    lengths = [p.end - p.start for p in pulses]
    usable = [p for p, n in zip(pulses, lengths, strict=True) if n >= max(LEAST / dt, 0.5 * np.median(lengths))]
    need(bool(usable), f"No impact is followed by {LEAST:g} s of free motion.")
    length = min(p.end - p.start for p in usable)
    inputs = tuple(sorted({p.axis for p in usable}))
    answers = [answer(record, pulse, output) for pulse in usable]
    u = np.stack([one["force"][:length, inputs].T for one in answers], axis=-1)
    y = np.stack([one["disc"][:length].T for one in answers], axis=-1)
    sums = CrossSpectra.of(*(np.fft.rfft(values, 2 * length, axis=1) for values in (u, y)))
    return solve(sums, np.fft.rfftfreq(2 * length, dt), inputs, "disc_force", output, most)

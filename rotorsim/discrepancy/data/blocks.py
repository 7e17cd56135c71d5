r"""Blocks of a record that are compared: whole periods of its excitation, or whole revolutions where it has none.

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

from math import inf

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.errors import DataError
from rotorsim.base.rounding import answer

SETTLING = 0.5
"""Beginning [s] of a record that is never compared: the twin starts at rest in equilibrium."""
SHORTEST_PERIOD = 0.2
"""Shortest period [s] of an excitation, and shortest window."""
TURNING = 1.0
"""Slowest speed [rad/s] that counts as turning."""


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


WHOLE = 0.005
"""Turns by which a block may miss whole ones: the uncertainty of the mean of a measured speed."""


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


def _unrepeated(values: np.ndarray, blocks: int) -> np.ndarray:
    """Values (n, k) less what repeats from block to block."""
    split = values.reshape(blocks, -1, values.shape[1])
    return np.asarray((split - split.mean(axis=0)).reshape(values.shape))


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


def stated_clock(value: object, name: str) -> float:
    """Standard deviation [s] of a record's clock offset; raises DataError for one that is not a short time."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        found = inf
    if not 0 <= found <= LARGEST_OFFSET:
        raise DataError(
            f"{name}: the clock is {value!r}; give the standard deviation of its offset, up to {LARGEST_OFFSET} seconds"
        )
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

r"""Orders of the shaft in blocks that do not hold a whole number of turns, analysed on the shaft angle.

.. math:: y(t) = p(t) + \sum_n \Re\{A_n e^{i n \alpha(t)}\}

with p the part that repeats from block to block. Such orders leak over the lines of a block and differ in phase from
block to block. A_n follows by least squares from what does not repeat, and each order is moved to the line nearest to
it, where all blocks agree. The map is linear, and measured and simulated displacements go through the same one.
Assumes: constant speed.

Cites: bendat_2010.
"""

from __future__ import annotations

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.discrepancy.linear_algebra import answer

WHOLE = 0.005
"""Turns by which a block may miss whole ones: what the mean of a measured speed leaves open."""


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

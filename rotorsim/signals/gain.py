r"""Static gain from the rest positions of a staircase: linear fit per input and deviations.

.. math:: d_i = d_{i0} + G_{ij} r_j

fitted by least squares over the rests of input j with the other input at its usual value. Source: thesis, Fig. C.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.signals.holds import FEWEST, Holds


@dataclass(frozen=True)
class Branches:
    """Rests of one input, numbers `steps` of all holds, in order: `reference` (step,) [V], `position` (step, output)
    [m], `rising` (step,) whether the reference rose to the step; fitted `gain` (output,) [m/V], `offset` (output,) [m],
    `deviation` (step, output) [m]."""

    axis: int
    steps: np.ndarray
    reference: np.ndarray
    position: np.ndarray
    rising: np.ndarray
    gain: np.ndarray
    offset: np.ndarray
    deviation: np.ndarray
    other_moves: bool

    @property
    def opening(self) -> np.ndarray:
        """Largest distance (output,) [m] between rising and falling branch at one reference; NaN without both."""
        return branch_distance(self.reference, self.position, self.rising)


def static_gain(holds: Holds) -> list[Branches]:
    """Branches of every input that takes three levels or more; the disc's positions are the outputs.

    Test: ``test_signals.py::test_a_known_gain_with_a_loop_is_found``.
    """
    chosen = [(axis, *_steps_of(holds, axis)) for axis in (0, 1)]
    return [_fit(holds, *c) for c in chosen if len(np.unique(holds.reference[c[1], c[0]])) >= FEWEST]


def _steps_of(holds: Holds, axis: int) -> tuple[np.ndarray, bool]:
    """Steps to or from which this input moves with the other at its usual value; all if these are too few."""
    other, length = holds.reference[:, 1 - axis], holds.stop - holds.start
    levels, index = np.unique(other, return_inverse=True)
    usual = levels[np.bincount(index, weights=length).argmax()]
    own = holds.reference[:, axis]
    changes = np.concatenate(([False], np.diff(own) != 0, [False]))
    steps = np.flatnonzero((other == usual) & (changes[:-1] | changes[1:]))
    if len(np.unique(holds.reference[steps, axis])) >= FEWEST:
        return steps, False
    return np.arange(len(other)), len(levels) > 1


def _fit(holds: Holds, axis: int, steps: np.ndarray, other_moves: bool) -> Branches:
    r, d = holds.reference[steps, axis], holds.disc[steps]
    slope, offset = np.polyfit(r, d, 1)
    rising = directions(r)
    return Branches(axis, steps, r, d, rising, slope, offset, d - offset - r[:, None] * slope, other_moves)


def directions(r: np.ndarray) -> np.ndarray:
    """Whether each value (n,) was reached from below; where nothing changes, as before."""
    change = np.sign(np.diff(r))
    moved = np.flatnonzero(change)
    if not moved.size:
        return np.ones(r.shape, bool)
    last = np.maximum.accumulate(np.where(change != 0, np.arange(change.size), moved[0]))
    return np.append(change[moved[0]] > 0, change[last] > 0)


def branch_distance(r: np.ndarray, d: np.ndarray, rising: np.ndarray) -> np.ndarray:
    """Largest distance (output,) between the mean of d (n, output) on the way up and on the way down at one r (n,)."""
    levels, index = np.unique(r, return_inverse=True)
    sums = [[np.bincount(index[w], d[w, k], levels.size) for k in range(d.shape[1])] for w in (rising, ~rising)]
    counts = [np.bincount(index[w], minlength=levels.size) for w in (rising, ~rising)]
    both = (counts[0] > 0) & (counts[1] > 0)
    if not both.any():
        return np.full(d.shape[1], np.nan)
    up, down = (np.array(s)[:, both] / c[both] for s, c in zip(sums, counts, strict=True))
    return np.asarray(np.abs(up - down).max(axis=1))

"""Faults of one sensor's column: dead (it never moves) and clipped (it rests at a limit of its range).

A quantised signal stays at its extreme value for a few samples too, but there it stays little longer than at the next
value; a clipped one stays there much longer than anywhere near.
"""

from __future__ import annotations

import numpy as np

STUCK, SHARE, LONGER = 5, 0.005, 4.0
"""A channel is clipped if runs of so many samples at its extreme make up this share of the record, and so many times
what it spends at the value next to the extreme."""
FEWEST, VALUES = 100, 3
"""A column of so many samples or more that shows no more different values than this is dead."""


def dead(values: np.ndarray) -> str:
    """Reason why a sensor's column (n,) shows nothing; empty if it moves."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "all NaN or infinite"
    low, high = float(finite.min()), float(finite.max())
    if low == high and finite.size > 1:
        return f"constant at {low:.6g}"
    # a disconnected input flickers between two or three neighbouring codes of the converter
    if finite.size >= FEWEST and np.unique(finite[:: max(1, finite.size // 100_000)]).size <= VALUES:
        return f"never leaves {VALUES} values from {low:.6g} to {high:.6g}"
    return ""


def clipped(values: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Limits at which a sensor's column (n,) rests, each with the share of the samples there; empty if at none."""
    finite = values[np.isfinite(values)]
    if finite.size < 2 or finite.min() == finite.max():
        return ()
    found = []
    low, high = float(finite.min()), float(finite.max())
    for at, inner in ((low, finite[finite > low].min()), (high, finite[finite < high].max())):
        share = _resting(values, at)
        if share and np.count_nonzero(finite == at) >= LONGER * np.count_nonzero(finite == inner):
            found.append((at, share))
    return tuple(found)


def _resting(values: np.ndarray, at: float) -> float:
    """Share of the samples in runs of STUCK or more at a value; 0 below SHARE."""
    edges = np.diff(np.concatenate(([0], (values == at).astype(np.int8), [0])))
    lengths = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    resting = int(lengths[lengths >= STUCK].sum())
    return resting / values.size if resting >= max(STUCK, SHARE * values.size) else 0.0

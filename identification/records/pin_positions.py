"""Actuator signal of each axis from pin positions: the difference of the opposite pins.

Which pin belongs to which axis, and which way it pushes, is found by regression on the references.
"""

from __future__ import annotations

import numpy as np

from identification.errors import UnfitError

DELAY = 10
"""Samples after which pins have followed a held reference."""


def pin_pairs(pins: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Signal (n, 2) [m] of the x and y actuators from pins (n, k) [m] and references u (n, 2) [V]."""
    basis = np.column_stack([u[:-DELAY], np.ones(len(u) - DELAY)])
    slopes = np.linalg.lstsq(basis, pins[DELAY:], rcond=None)[0][:2]
    owner = np.argmax(np.abs(slopes), axis=0)
    if set(owner) != {0, 1} or not np.any(slopes):
        raise UnfitError("record.pin: no pin follows each of the references; map the pins or take model 3")
    signs = np.sign(slopes[owner, np.arange(pins.shape[1])])
    return np.column_stack([(signs * (owner == axis) * pins).sum(axis=1) for axis in range(2)])

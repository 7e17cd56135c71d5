r"""Steps of Levenberg and Marquardt, of parameters with or without bounds.

.. math:: (N + \lambda\,\mathrm{diag} N)\, \Delta = g, \qquad \theta_{low} \le \theta + \Delta \le \theta_{high}

Elements that pass a bound stop there and the others are solved for again (active set). Source: Nocedal and Wright
(2006), chapters 10 and 16.

Cites: nocedal_2006.
"""

from __future__ import annotations

import numpy as np

Box = tuple[np.ndarray, np.ndarray] | None
"""Lowest and highest parameters, None where there are no bounds."""


def within(box: Box, theta: np.ndarray) -> np.ndarray:
    """Parameters without what rounding added beyond a bound."""
    return theta if box is None else np.clip(theta, *box)


def reach(box: Box, theta: np.ndarray, size: int) -> Box:
    """Least and largest step (size,) of the parameters and of the state, which has no bounds."""
    if box is None:
        return None
    free = np.full(size - len(theta), np.inf)
    return np.concatenate([box[0] - theta, -free]), np.concatenate([box[1] - theta, free])


def damped_step(N: np.ndarray, g: np.ndarray, damping: float, room: Box = None) -> tuple[np.ndarray, float]:
    """Damped step and the fall of the cost that it promises; what would leave its room stops there, the rest adapts."""
    scale = np.sqrt(np.maximum(np.diag(N), 1e-300))
    M, s = N / np.outer(scale, scale), g / scale
    damped = M + damping * np.eye(len(M))
    step = np.linalg.solve(damped, s)
    if room is not None:
        step = _stopped(damped, s, step, room[0] * scale, room[1] * scale)
    return step / scale, float(2 * step @ s - step @ M @ step)


def _stopped(M: np.ndarray, s: np.ndarray, step: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Solution of M step = s in what is free; elements that pass a bound are held at it, one set after another."""
    held = np.zeros(len(s), bool)
    while np.any(beyond := ~held & ((step < low) | (step > high))):
        held |= beyond
        step, free = np.where(held, np.clip(step, low, high), step), ~held
        if free.any():
            step[free] = np.linalg.solve(M[np.ix_(free, free)], s[free] - M[np.ix_(free, held)] @ step[held])
    return step

r"""Steady film and journal equilibrium by pseudo-transient continuation.

Implicit Euler steps in a pseudo-time that grows as the solution settles lead from ambient pressure to the basin of
Newton's method, whatever the eccentricity; a last Newton solve without storage sharpens the answer to round-off. The
journal obeys  A X - B F = b  with a damper d X' while it moves (a journal held in place has B = 0).
Source: Kelley & Keyes (1998), Convergence analysis of pseudo-transient continuation.

Cites: kelley_1998.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reynolds.film import stored, thickness
from reynolds.grid import Layout
from reynolds.jit import inlined

FIRST_STEP, LAST_STEP, GROWTH, RETREAT = 2e-5, 1e3, 4.0, 0.2
ROUGH, SHARP = 1e-4, 1e-11
MOST_STEPS = 200


@inlined
def begin_pseudo_film(w, F, L):
    """Right-hand sides of an implicit Euler step of the film from the present state."""
    thickness(w, F, L)
    for k in range(L.length):
        w[L.m_rhs + k] = stored(w, L, k)
        if L.foil == 1:
            w[L.bend_rhs + k] = w[L.bend + k]
    for i in range(L.n_inj):
        w[L.plenum_rhs + i] = w[L.plenum + i]


@inlined
def begin_pseudo_step(w, F, L, iadt, damping):
    """Those of film and journal for a step of 1/iadt; iadt = 0 is the steady equation."""
    begin_pseudo_film(w, F, L)
    for e in range(4):
        w[L.journal_a + e] = w[L.static_a + e]
    for a in range(2):
        w[L.journal_a + 3 * a] += damping * iadt
        w[L.journal_rhs + a] = w[L.static_rhs + a] + damping * iadt * w[L.journal + a]


def settle_film(w: np.ndarray, layout: Layout, pseudo_step: Callable[[float, float], int]) -> bool:
    """Bring the workspace w to the steady state; `pseudo_step(iadt, tolerance)` solves one step and returns its status.

    Returns whether the steady equations were solved to `SHARP`. The force is left in w[force].
    """
    step = FIRST_STEP
    for _ in range(MOST_STEPS):
        before = _state(w, layout)
        if pseudo_step(1.0 / step, ROUGH) > 0:
            step *= GROWTH
        else:
            _restore(w, layout, before)
            step *= RETREAT
        if step >= LAST_STEP:
            return pseudo_step(0.0, SHARP) > 0
    return False


def _state(w: np.ndarray, layout: Layout) -> tuple[np.ndarray, ...]:
    return tuple(w[a : a + n].copy() for a, n in _parts(layout))


def _restore(w: np.ndarray, layout: Layout, state: tuple[np.ndarray, ...]) -> None:
    for (a, n), values in zip(_parts(layout), state, strict=True):
        w[a : a + n] = values


def _parts(layout: Layout) -> tuple[tuple[int, int], ...]:
    return (layout.p, layout.length), (layout.plenum, layout.n_inj), (layout.journal, 2)

r"""Steady film, and equilibrium of a journal in it, by pseudo-transient continuation.

Implicit Euler steps in a pseudo-time that grows as the solution settles lead from ambient pressure to the basin of
Newton's method, whatever the eccentricity; a last Newton solve without storage sharpens the answer to round-off. The
journal obeys  A X - F = b  with a damper d X' while it moves (a journal held in place has B = 0).
Source: Kelley & Keyes (1998), Convergence analysis of pseudo-transient continuation.
"""

from __future__ import annotations

from reynolds.jit import inlined

FIRST_STEP, LAST_STEP, GROWTH = 2e-5, 1e3, 4.0
SHARP = 1e-11


@inlined
def hold_journal(w, L, iadt, damping):
    """Set the journal's equation for a pseudo-step: static part plus damper."""
    for e in range(4):
        w[L.journal_a + e] = w[L.static_a + e]
    w[L.journal_a] += damping * iadt
    w[L.journal_a + 3] += damping * iadt
    w[L.journal_rhs] = w[L.static_rhs] + damping * iadt * w[L.journal]
    w[L.journal_rhs + 1] = w[L.static_rhs + 1] + damping * iadt * w[L.journal + 1]


@inlined
def copy_state(w, L, restore):
    """Keep pressures, plena and journal aside, or take them back."""
    for k in range(L.length):
        if restore:
            w[L.p + k] = w[L.p_1 + k]
        else:
            w[L.p_1 + k] = w[L.p + k]
    for i in range(L.n_inj):
        if restore:
            w[L.plenum + i] = w[L.plenum_1 + i]
        else:
            w[L.plenum_1 + i] = w[L.plenum + i]
    for a in range(2):
        if restore:
            w[L.journal + a] = w[L.journal_old + a]
        else:
            w[L.journal_old + a] = w[L.journal + a]


@inlined
def begin_pseudo_step(w, L):
    """Right-hand sides of an implicit Euler step from the present state."""
    for k in range(L.length):
        w[L.m_rhs + k] = w[L.p + k] * w[L.h + k]
    for i in range(L.n_inj):
        w[L.plenum_rhs + i] = w[L.plenum + i]

r"""TR-BDF2 in time for the film and the plena: one trapezoidal stage to gamma dt, one BDF2 stage to dt.

With gamma = 2 - sqrt 2 both stages have the same matrix, storage / (a dt) with a = gamma/2, and the method is second
order, one-step and L-stable (Bank et al. 1985; Hosea & Shampine 1996). Both stages act on the stored mass m = p h,

.. math:: m_\gamma = m_n + a\,\Delta t\,(\dot m_n + \dot m_\gamma), \qquad
          m_{n+1} = \frac{m_\gamma - (1-\gamma)^2 m_n}{\gamma(2-\gamma)} + a\,\Delta t\,\dot m_{n+1},

so that mass is conserved. The rate at the start of a step is the one the last step ended with, taken from the stage
equation itself. Starting values are polynomials through the last steps.
"""

from __future__ import annotations

import math

from reynolds.film import thickness
from reynolds.jit import inlined

GAMMA = 2.0 - math.sqrt(2.0)
STAGE = 1.0 - math.sqrt(0.5)
"""a: both stages divide the storage by a dt."""
MID = 1.0 / (GAMMA * (2.0 - GAMMA))
OLD = -((1.0 - GAMMA) ** 2) / (GAMMA * (2.0 - GAMMA))
TO_MID, TO_END = 0, 1


def predictor_table() -> list[float]:
    """Lagrange weights of the starting values, order 0-3 for each stage, as rows of four."""
    rows: list[float] = []
    for target, nodes in ((GAMMA, (0.0, -1.0, -2.0, -3.0)), (1.0, (GAMMA, 0.0, -1.0, -2.0))):
        for order in range(4):
            used = nodes[: order + 1]
            weights = [math.prod((target - b) / (a - b) for b in used if b != a) for a in used]
            rows += weights + [0.0] * (3 - order)
    return rows


TABLE = tuple(predictor_table())


@inlined
def predict(w, L, stage, order):
    """Starting values of p and plena for a stage from the last `order` + 1 values."""
    row = 16 * stage + 4 * order
    a, b, c, d = TABLE[row], TABLE[row + 1], TABLE[row + 2], TABLE[row + 3]
    floor = 0.1
    if stage == TO_MID:
        for k in range(L.length):
            v = a * w[L.p + k] + b * w[L.p_1 + k] + c * w[L.p_2 + k] + d * w[L.p_3 + k]
            now = w[L.p + k]
            w[L.p_3 + k] = w[L.p_2 + k]
            w[L.p_2 + k] = w[L.p_1 + k]
            w[L.p_1 + k] = now
            w[L.p + k] = max(v, floor * now)
        for i in range(L.n_inj):
            now = w[L.plenum + i]
            v = a * now + b * w[L.plenum_1 + i] + c * w[L.plenum_2 + i] + d * w[L.plenum_3 + i]
            w[L.plenum_3 + i] = w[L.plenum_2 + i]
            w[L.plenum_2 + i] = w[L.plenum_1 + i]
            w[L.plenum_1 + i] = now
            w[L.plenum + i] = max(v, floor * now)
    else:
        for k in range(L.length):
            now = w[L.p + k]
            v = a * now + b * w[L.p_1 + k] + c * w[L.p_2 + k] + d * w[L.p_3 + k]
            w[L.p + k] = max(v, floor * now)
        for i in range(L.n_inj):
            now = w[L.plenum + i]
            v = a * now + b * w[L.plenum_1 + i] + c * w[L.plenum_2 + i] + d * w[L.plenum_3 + i]
            w[L.plenum + i] = max(v, floor * now)


@inlined
def start(w, ix, F, L):
    """Take the present state as one at rest: stored mass, no rates."""
    thickness(w, F, L)
    for k in range(L.length):
        w[L.m_old + k] = w[L.p + k] * w[L.h + k]
        w[L.rate + k] = 0.0
    for i in range(L.n_inj):
        w[L.plenum_old + i] = w[L.plenum + i]
        w[L.plenum_rate + i] = 0.0


@inlined
def stage_rhs(w, L, stage, adt):
    """Right-hand sides m_rhs and plenum_rhs of a stage."""
    if stage == TO_MID:
        for k in range(L.length):
            w[L.m_rhs + k] = w[L.m_old + k] + adt * w[L.rate + k]
        for i in range(L.n_inj):
            w[L.plenum_rhs + i] = w[L.plenum_old + i] + adt * w[L.plenum_rate + i]
    else:
        for k in range(L.length):
            w[L.m_rhs + k] = MID * w[L.m_mid + k] + OLD * w[L.m_old + k]
        for i in range(L.n_inj):
            w[L.plenum_rhs + i] = MID * w[L.plenum_mid + i] + OLD * w[L.plenum_old + i]


@inlined
def end_stage(w, F, L, stage, adt):
    """Keep what the stage found: mass and plena at gamma dt, or at the step's end together with the rates."""
    thickness(w, F, L)
    if stage == TO_MID:
        for k in range(L.length):
            w[L.m_mid + k] = w[L.p + k] * w[L.h + k]
        for i in range(L.n_inj):
            w[L.plenum_mid + i] = w[L.plenum + i]
    else:
        inverse = 1.0 / adt
        for k in range(L.length):
            m = w[L.p + k] * w[L.h + k]
            w[L.m_old + k] = m
            w[L.rate + k] = (m - w[L.m_rhs + k]) * inverse
        for i in range(L.n_inj):
            w[L.plenum_old + i] = w[L.plenum + i]
            w[L.plenum_rate + i] = (w[L.plenum + i] - w[L.plenum_rhs + i]) * inverse


@inlined
def take_back(w, L):
    """Undo a stage that failed: pressures and plena of the step's start."""
    for k in range(L.length):
        w[L.p + k] = w[L.p_1 + k]
    for i in range(L.n_inj):
        w[L.plenum + i] = w[L.plenum_1 + i]

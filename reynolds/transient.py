r"""Steps of film and plena: TR-BDF2 in time, and in a pseudo-time to the steady state.

A step in time has a trapezoidal stage to gamma dt and a BDF2 stage to dt. With gamma = 2 - sqrt 2 both have the same
matrix, storage / (a dt) with a = gamma/2, and the method is second order, one-step and L-stable (Bank et al. 1985;
Hosea & Shampine 1996). Both stages act on the stored mass m = p h,

.. math:: m_\gamma = m_n + a\,\Delta t\,(\dot m_n + \dot m_\gamma), \qquad
          m_{n+1} = \frac{m_\gamma - (1-\gamma)^2 m_n}{\gamma(2-\gamma)} + a\,\Delta t\,\dot m_{n+1},

so that mass is conserved. The rate at the start of a step is the one the last step ended with. Starting values are
polynomials through the last steps: of the pressures, or where these miss by far, as round a journal close to its
sleeve, of the masses, which become pressures in the gap of the present journal.

A steady film, and the equilibrium of a journal, come by pseudo-transient continuation (Kelley & Keyes 1998): implicit
Euler steps in a pseudo-time that grows as the solution settles lead from ambient pressure to the basin of Newton's
method, whatever the eccentricity; a last Newton solve without storage sharpens the answer to round-off. Where it
fails, as close behind a fold where all is almost at rest, the steps go on and are solved as sharply. The journal
obeys  A X - B F = b  with a damper d X' while it moves (a journal held in place has B = 0).

Cites: bank_1985, hosea_1996, kelley_1998.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from reynolds.film import bend_foil, stored, thickness, thickness_slope, wrap
from reynolds.grid import Layout
from reynolds.jit import inlined
from reynolds.vectors import dot, two_dots

GAMMA = 2.0 - math.sqrt(2.0)
STAGE = 1.0 - math.sqrt(0.5)
"""a: both stages divide the storage by a dt."""
MID = 1.0 / (GAMMA * (2.0 - GAMMA))
OLD = -((1.0 - GAMMA) ** 2) / (GAMMA * (2.0 - GAMMA))
TO_MID, TO_END = 0, 1
TRUST = 0.1
"""Error (pressure / ambient + journal / clearance) above which a stage that was cut short holds its films instead."""
LEAST = 0.1
"""Least pressure of a film that is held, in ambient pressures: corrections do not lead out of a vacuum."""


def predictor_table() -> list[float]:
    """Lagrange weights of the starting values, order 0-3 for each stage, as rows of four."""
    rows: list[float] = []
    for target, nodes in ((GAMMA, (0.0, -1.0, -2.0, -3.0)), (1.0, (GAMMA, 0.0, -1.0, -2.0))):
        for order in range(4):
            used = nodes[: order + 1]
            weights = [math.prod((target - b) / (a - b) for b in used if b != a) for a in used]
            rows += weights + [0.0] * (3 - order)
    return rows


TABLE = tuple(float(v) for v in predictor_table())


def mass_table() -> list[float]:
    """Lagrange weights of the starting masses, order 0-2 for each stage, as rows of three."""
    rows: list[float] = []
    for target, nodes in ((GAMMA, (0.0, GAMMA - 1.0, -1.0)), (1.0, (GAMMA, 0.0, -1.0))):
        for order in range(3):
            used = nodes[: order + 1]
            weights = [math.prod((target - b) / (a - b) for b in used if b != a) for a in used]
            rows += weights + [0.0] * (2 - order)
    return rows


MASSES = tuple(float(v) for v in mass_table())


@inlined
def predict(w, L, stage, order):
    """Starting values of p and plena for a stage from the last `order` + 1 values."""
    row = 16 * stage + 4 * order
    b, c, d = TABLE[row + 1], TABLE[row + 2], TABLE[row + 3]
    # written in differences: a constant (the edge pressure) is kept to the last bit
    for k in range(L.length):
        now, one, two, three = w[L.p + k], w[L.p_1 + k], w[L.p_2 + k], w[L.p_3 + k]
        next = now + b * (one - now) + c * (two - now) + d * (three - now)
        w[L.p + k] = 0.1 * now if next < 0.1 * now else next
        if stage == TO_MID:
            w[L.p_3 + k] = two
            w[L.p_2 + k] = one
            w[L.p_1 + k] = now
    for i in range(L.n_inj):
        now, one, two, three = w[L.plenum + i], w[L.plenum_1 + i], w[L.plenum_2 + i], w[L.plenum_3 + i]
        w[L.plenum + i] = max(now + b * (one - now) + c * (two - now) + d * (three - now), 0.1 * now)
        if stage == TO_MID:
            w[L.plenum_3 + i] = two
            w[L.plenum_2 + i] = one
            w[L.plenum_1 + i] = now


@inlined
def carry_mass(w, F, L, stage, order):
    """Pressures that the masses of the last stages, carried on, have in the gap of the present journal; returns the
    rms of their change / ambient."""
    thickness(w, F, L)
    # the masses of a step's start and middle are those of the last step until its stage ends
    row = 9 * stage + 3 * (2 if order > 0.0 else stage)
    a, b, c = MASSES[row], MASSES[row + 1], MASSES[row + 2]
    now, one = (L.m_old, L.m_mid) if stage == TO_MID else (L.m_mid, L.m_old)
    for k in range(L.first, L.first + L.n_theta * L.stride):
        old = w[L.p + k]
        new = old * (a * w[now + k] + b * w[one + k] + c * w[L.m_before + k]) / stored(w, L, k)
        new = 0.1 * old if new < 0.1 * old else new
        # edges keep their pressure
        new = new if w[L.per_weight + k] > 0.0 else old
        w[L.dp + k] = new - old
        w[L.p + k] = new
    wrap(w, L, L.p)
    return math.sqrt(dot(w, L.dp + L.first, L.dp + L.first, L.span) / (L.n_theta * L.n_rows)) / F.pa


@inlined
def gas_spring(w, F, L):
    """Derivatives of the film force (x, y) after x and after y of the journal where every cell keeps its mass."""
    thickness_slope(w, F, L)
    for k in range(L.first, L.first + L.n_theta * L.stride):
        rise = w[L.p + k] / w[L.h + k] * w[L.slope + k]
        w[L.dp + k] = rise * w[L.cos + k]
        w[L.slope + k] = rise * w[L.sin + k]
    xx, yx = two_dots(w, L.dp + L.first, L.force_x + L.first, L.force_y + L.first, L.span)
    xy, yy = two_dots(w, L.slope + L.first, L.force_x + L.first, L.force_y + L.first, L.span)
    return xx, yx, xy, yy


@inlined
def rest_foil(w, L):
    """Take the present deflection as one at rest."""
    for k in range(L.length):
        w[L.bend_old + k] = w[L.bend + k]
        w[L.bend_rate + k] = 0.0


@inlined
def start(w, ix, F, L):
    """Take the present state as one at rest: stored mass, no rates."""
    thickness(w, F, L)
    for k in range(L.length):
        w[L.m_old + k] = stored(w, L, k)
        w[L.rate + k] = 0.0
    if L.foil == 1:
        rest_foil(w, L)
    for i in range(L.n_inj):
        w[L.plenum_old + i] = w[L.plenum + i]
        w[L.plenum_rate + i] = 0.0


@inlined
def stage_rhs(w, L, stage, adt):
    """Right-hand sides m_rhs and plenum_rhs of a stage."""
    if L.foil == 1:
        foil_rhs(w, L, stage, adt)
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
def foil_rhs(w, L, stage, adt):
    """Right-hand side of the foil's deflection in a stage."""
    for k in range(L.length):
        if stage == TO_MID:
            w[L.bend_rhs + k] = w[L.bend_old + k] + adt * w[L.bend_rate + k]
        else:
            w[L.bend_rhs + k] = MID * w[L.bend_mid + k] + OLD * w[L.bend_old + k]


@inlined
def end_foil(w, L, stage, adt):
    """Keep the foil's deflection as `end_stage` keeps the mass."""
    for k in range(L.length):
        if stage == TO_MID:
            w[L.bend_mid + k] = w[L.bend + k]
        else:
            w[L.bend_rate + k] = (w[L.bend + k] - w[L.bend_rhs + k]) / adt
            w[L.bend_old + k] = w[L.bend + k]


@inlined
def keep_mass(w, L, adt, keep):
    """Write the mass that the fluxes account for into the array at offset `keep`."""
    for k in range(L.first, L.first + L.n_theta * L.stride):
        w[keep + k] = stored(w, L, k) - adt * w[L.per_weight + k] * w[L.r + k]


@inlined
def keep_pressures(w, L, adt, stage, far):
    """Keep the mass and the plena that go with the pressures of a stage that was cut short; without rates if `far`.

    Mass that the fluxes account for, as `end_stage` has it, would multiply the error by the stiffness of the film.
    """
    inverse, keep = 0.0 if far else 1.0 / adt, L.m_mid if stage == TO_MID else L.m_old
    for k in range(L.first, L.first + L.n_theta * L.stride):
        w[keep + k] = stored(w, L, k)
        w[L.rate + k] = (w[keep + k] - w[L.m_rhs + k]) * inverse
    for i in range(L.n_inj):
        w[(L.plenum_mid if stage == TO_MID else L.plenum_old) + i] = w[L.plenum + i]
        w[L.plenum_rate + i] = (w[L.plenum + i] - w[L.plenum_rhs + i]) * inverse


@inlined
def end_stage(w, L, stage, adt, cut):
    """Keep what the stage found: mass and plena at gamma dt, or at the step's end together with the rates.

    The mass kept is the one the fluxes of the answer account for, p h minus the residual that Newton's tolerance has
    left (in r after `newton`): so mass is conserved to round-off and the tolerance leaves no drift. `cut`: error of a
    stage that was cut short, or 0.
    """
    if L.foil == 1:
        end_foil(w, L, stage, adt)
    if stage == TO_END:
        for k in range(L.first, L.first + L.n_theta * L.stride):
            w[L.m_before + k] = w[L.m_old + k]
    if cut > 0.0:
        keep_pressures(w, L, adt, stage, cut > TRUST)
        return
    if stage == TO_MID:
        keep_mass(w, L, adt, L.m_mid)
    else:
        keep_mass(w, L, adt, L.m_old)
        inverse = 1.0 / adt
        for k in range(L.first, L.first + L.n_theta * L.stride):
            w[L.rate + k] = (w[L.m_old + k] - w[L.m_rhs + k]) * inverse
    for i in range(L.n_inj):
        rate = (w[L.pin_flow + i] - w[L.film_flow + i]) / w[L.capacity + i]
        if stage == TO_MID:
            w[L.plenum_mid + i] = w[L.plenum_rhs + i] + adt * rate
        else:
            w[L.plenum_old + i] = w[L.plenum_rhs + i] + adt * rate
            w[L.plenum_rate + i] = rate


@inlined
def take_back(w, L):
    """Undo a stage that failed: pressures and plena of the step's start."""
    for k in range(L.length):
        w[L.p + k] = w[L.p_1 + k]
    for i in range(L.n_inj):
        w[L.plenum + i] = w[L.plenum_1 + i]


@inlined
def hold(w, F, L, iadt):
    """Hold a film without an answer: as `take_back`, above a vacuum, and the foil bent under these pressures."""
    take_back(w, L)
    for k in range(L.length):
        w[L.p + k] = max(w[L.p + k], LEAST * F.pa)
    if L.foil == 1:
        bend_foil(w, F, L, iadt)


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
    """Begin a step of film and journal in pseudo-time, 1/iadt long; iadt = 0 is the steady equation."""
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
    step, solved = FIRST_STEP, ROUGH
    places = ((layout.p, layout.length), (layout.plenum, layout.n_inj), (layout.journal, 2))
    state = np.concatenate([np.arange(a, a + n) for a, n in places])
    for _ in range(MOST_STEPS):
        before, last = w[state], step >= LAST_STEP
        iadt, tolerance = (0.0, SHARP) if last else (1.0 / step, solved)
        if pseudo_step(iadt, tolerance) > 0:
            if last:
                return True
            step *= GROWTH
        else:
            w[state] = before
            step *= RETREAT
            solved = SHARP if last else solved
    return False

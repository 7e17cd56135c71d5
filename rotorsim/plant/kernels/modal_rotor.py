r"""Modal rotor in an implicit step, condensed exactly to the compliance of its journals, 2 x 2 for one film.

In modal coordinates (mass matrix I, 2n modes; see fe_shaft.assembly)  q' = v,  v' = f + Phi_b' F - (C + Omega G) v -
K q. A stage of TR-BDF2 is  q = q_r + a dt v,  v = v_r + a dt v'  with right-hand sides q_r, v_r, hence with T = (I +
a dt (C + Omega G) + (a dt)^2 K)^-1

.. math:: v = T (v_r + a\,\Delta t\,f - a\,\Delta t\,K q_r) + a\,\Delta t\,T \Phi_b' F, \qquad X = \Phi_b q = X_0 + W F,

W = (a dt)^2 Phi_b T Phi_b': what the film needs to know of the rotor is X_0 and W. T is formed again when the speed has
moved by `SPEED_STEP`.

Damping that turns with the shaft, a time beta times its stiffness K_s, acts on the velocity in the turning frame,
-beta K_s (v - Omega e_z x q): it adds beta K_s to C and the circulatory Omega beta N to K. A bearing that is a table
over the speed adds B' K(Omega) B to K and B' C(Omega) B to C, with the rows B of its displacement.

The stages of a step give a method of third order too (Hosea & Shampine 1996), from which the step differs by

.. math:: e = \frac{\Delta t}{3}\left((1-\gamma)\,y'_n - y'_\gamma + \gamma\,y'_{n+1}\right),

filtered by the stage matrix, (I - a dt J)^-1 e, in which modes faster than the step do not count.

LU factorisation with row exchanges of small dense matrices in a flat workspace.

Implicit treatment of forces that depend on the shaft's local motion.

Each force is evaluated at a guess x_g of the stage's displacement (velocity (x_g - x_r) / (a dt)); the stage is solved
with it; where it leads to a displacement x at which the force is another one, W |F(x) - F(x_g)| above the limit, the
guess is corrected by Newton's method with the node's own compliance W = (a dt)^2 Phi T Phi':

.. math:: x_g \leftarrow x_g + (I - W F')^{-1}\,(x - x_g).

A slot of 16 doubles holds for each force: guess (2), x_r (2), force (2), W (4), displacement at the step's start (2).

Cites: benfield_1971, friswell_2010, golub_2013, hosea_1996.
"""

from __future__ import annotations

from reynolds.jit import inlined
from reynolds.ring import invert_block
from reynolds.transient import GAMMA, MID, OLD, TO_MID

SPEED_STEP = 0.1
"""Change of speed [rad/s] after which the stage matrix is formed again."""


@inlined
def build_support(w, R, f, dof, omega, zeta, gain):
    """Modal coordinates dof (x) and dof + 1 (y) of a resonance under sleeve f, which moves by `gain` times them."""
    n = R.n
    for axis in range(2):
        d = dof + axis
        w[R.K + d * n + d] = omega * omega
        w[R.C + d * n + d] = 2.0 * zeta * omega
        w[R.journal + (2 * f + axis) * n + d] = -gain


@inlined
def add_tables(w, R, speed, first, factor, target):
    """Add `factor` times the stiffness (first 0) or damping (first 4) of the tables at `speed` to a modal matrix.

    A shaft that turns from y to x is the mirror image: the tables at abs(speed), cross terms of the opposite sign.
    """
    n, k = R.n, 1
    turning = abs(speed)
    while k < R.n_points - 1 and w[R.table_speeds + k] < turning:
        k += 1
    low, high = w[R.table_speeds + k - 1], w[R.table_speeds + k]
    share = min(max((turning - low) / (high - low), 0.0), 1.0)
    for b in range(R.n_tables):
        rows = R.table_rows + 2 * n * b
        at = R.table_values + 8 * (R.n_points * b + k) + first
        for i in range(2):
            for j in range(2):
                e = at + 2 * i + j
                value = factor * (w[e - 8] + share * (w[e] - w[e - 8]))
                if i != j and speed < 0.0:
                    value = -value
                for c in range(n):
                    for r in range(n):
                        w[target + c * n + r] += w[rows + i * n + r] * value * w[rows + j * n + c]


@inlined
def form_matrix(w, R, speed, beta, adt):
    """Form T, a dt T K, the journals' columns a dt T Phi_b' and W."""
    n = R.n
    for e in range(n * n):
        w[R.KT + e] = w[R.K + e]
        w[R.T + e] = adt * (w[R.C + e] + speed * w[R.G + e])
    if beta != 0.0:
        for e in range(n * n):
            w[R.KT + e] += speed * beta * w[R.N + e]
            w[R.T + e] += adt * beta * w[R.KS + e]
    if R.n_tables > 0:
        add_tables(w, R, speed, 0, 1.0, R.KT)
        add_tables(w, R, speed, 4, adt, R.T)
    for e in range(n * n):
        w[R.T + e] += adt * adt * w[R.KT + e]
    for c in range(n):
        w[R.T + c * n + c] += 1.0
    invert_block(w, R.T, n)
    for c in range(n):
        for r in range(n):
            value = 0.0
            for m in range(n):
                value += w[R.T + m * n + r] * w[R.KT + c * n + m]
            w[R.TK + c * n + r] = adt * value
    for b in range(2 * R.n_films):
        for r in range(n):
            value = 0.0
            for m in range(n):
                value += w[R.T + m * n + r] * w[R.journal + b * n + m]
            w[R.to_journal + b * n + r] = adt * value
    for a in range(2 * R.n_films):
        for b in range(2 * R.n_films):
            value = 0.0
            for m in range(n):
                value += w[R.journal + a * n + m] * w[R.to_journal + b * n + m]
            w[R.compliance + 2 * R.n_films * a + b] = adt * value
    w[R.matrix_speed] = speed
    w[R.matrix_step] = adt


@inlined
def project(w, R, row, vector):
    """(x, y) of the (2, n) rows at offset `row` times the modal vector at offset `vector`."""
    x = 0.0
    y = 0.0
    for m in range(R.n):
        x += w[row + m] * w[vector + m]
        y += w[row + R.n + m] * w[vector + m]
    return x, y


@inlined
def add_force(w, R, row, fx, fy, target):
    """Add the modal force of (fx, fy) acting through the (2, n) rows at offset `row`."""
    for m in range(R.n):
        w[target + m] += fx * w[row + m] + fy * w[row + R.n + m]


@inlined
def rotor_rhs(w, R, stage, adt):
    """Right-hand sides q_rhs and v_rhs of a stage."""
    for m in range(R.n):
        if stage == TO_MID:
            w[R.q_rhs + m] = w[R.q_old + m] + adt * w[R.v_old + m]
            w[R.v_rhs + m] = w[R.v_old + m] + adt * w[R.a_old + m]
        else:
            w[R.q_rhs + m] = MID * w[R.q_mid + m] + OLD * w[R.q_old + m]
            w[R.v_rhs + m] = MID * w[R.v_mid + m] + OLD * w[R.v_old + m]


@inlined
def free_velocity(w, R, adt):
    """Velocity at the stage's end without film force, into `free`."""
    n = R.n
    for r in range(n):
        w[R.free + r] = 0.0
    for c in range(n):
        a = w[R.v_rhs + c] + adt * w[R.f + c]
        b = w[R.q_rhs + c]
        for r in range(n):
            w[R.free + r] += w[R.T + c * n + r] * a - w[R.TK + c * n + r] * b


@inlined
def move_rotor(w, R, adt):
    """Velocity and displacement at the stage's end for the forces on the journals in w[journal_force]."""
    for m in range(R.n):
        v = w[R.free + m]
        for f in range(R.n_films):
            to = R.to_journal + 2 * f * R.n + m
            v = v + w[R.journal_force + 2 * f] * w[to] + w[R.journal_force + 2 * f + 1] * w[to + R.n]
        w[R.v + m] = v
        w[R.q + m] = w[R.q_rhs + m] + adt * v


@inlined
def end_rotor_stage(w, R, stage, adt):
    """Keep what the stage found: at gamma dt, or at the step's end together with the acceleration."""
    for m in range(R.n):
        if stage == TO_MID:
            w[R.q_mid + m] = w[R.q + m]
            w[R.v_mid + m] = w[R.v + m]
        else:
            w[R.a_old + m] = (w[R.v + m] - w[R.v_rhs + m]) / adt
            w[R.q_old + m] = w[R.q + m]
            w[R.v_old + m] = w[R.v + m]


@inlined
def embedded_error(w, R, dt, adt):
    """Error of a solved step before it is kept: of the displacement into `f`, of the velocity into `free`."""
    n = R.n
    for r in range(n):
        w[R.free + r] = 0.0
    for c in range(n):
        mid = (w[R.v_mid + c] - w[R.v_old + c]) / adt - w[R.a_old + c]
        end = (w[R.v + c] - w[R.v_rhs + c]) / adt
        a = dt / 3.0 * ((1.0 - GAMMA) * w[R.a_old + c] - mid + GAMMA * end)
        b = dt / 3.0 * ((1.0 - GAMMA) * w[R.v_old + c] - w[R.v_mid + c] + GAMMA * w[R.v + c])
        w[R.f + c] = b
        for r in range(n):
            w[R.free + r] += w[R.T + c * n + r] * a - w[R.TK + c * n + r] * b
    for r in range(n):
        w[R.f + r] += adt * w[R.free + r]


@inlined
def factor_matrix(w, A, pivots, n):
    """LU factors of the n x n matrix at offset A in its place; the rows exchanged go to offset `pivots`."""
    for c in range(n):
        best = c
        for r in range(c + 1, n):
            if abs(w[A + c * n + r]) > abs(w[A + c * n + best]):
                best = r
        w[pivots + c] = best
        if best != c:
            for k in range(n):
                w[A + k * n + c], w[A + k * n + best] = w[A + k * n + best], w[A + k * n + c]
        for r in range(c + 1, n):
            w[A + c * n + r] /= w[A + c * n + c]
        for k in range(c + 1, n):
            for r in range(c + 1, n):
                w[A + k * n + r] -= w[A + c * n + r] * w[A + k * n + c]


@inlined
def solve_matrix(w, A, pivots, b, n):
    """Solve in place for the right-hand side at offset b, with the factors of `factor_matrix`."""
    for c in range(n):
        best = int(w[pivots + c])
        w[b + c], w[b + best] = w[b + best], w[b + c]
    for c in range(n):
        for r in range(c + 1, n):
            w[b + r] -= w[A + c * n + r] * w[b + c]
    for back in range(n):
        c = n - 1 - back
        w[b + c] /= w[A + c * n + c]
        for r in range(c):
            w[b + r] -= w[A + c * n + r] * w[b + c]


GUESS, START, FORCE, COMPLIANCE, BEGIN = 0, 2, 4, 6, 10
SLOT = 16
NUDGE = 1e-9
"""Displacement [m] of the difference quotient that gives F'."""


@inlined
def form_compliance(w, R, shape, slot, adt):
    """W of one force into its slot; after the rotor's stage matrix has been formed."""
    n = R.n
    for a in range(2):
        for b in range(2):
            value = 0.0
            for c in range(n):
                column = 0.0
                for r in range(n):
                    column += w[shape + a * n + r] * w[R.T + c * n + r]
                value += column * w[shape + b * n + c]
            w[slot + COMPLIANCE + 2 * a + b] = adt * adt * value


@inlined
def guess(w, R, shape, slot, tau):
    """Displacement after tau by Taylor's series from the step's start."""
    x, y = project(w, R, shape, R.q_old)
    w[slot + BEGIN], w[slot + BEGIN + 1] = x, y
    vx, vy = project(w, R, shape, R.v_old)
    ax, ay = project(w, R, shape, R.a_old)
    w[slot + GUESS] = x + tau * (vx + 0.5 * tau * ax)
    w[slot + GUESS + 1] = y + tau * (vy + 0.5 * tau * ay)
    w[slot + START], w[slot + START + 1] = project(w, R, shape, R.q_rhs)


@inlined
def velocity(w, slot, x, y, adt):
    """Velocity at the stage's end that goes with the displacement (x, y)."""
    return (x - w[slot + START]) / adt, (y - w[slot + START + 1]) / adt


@inlined
def miss(w, slot, fx, fy):
    """Displacement [m] by which the force met and the force used differ, W |F - F_used|."""
    c = slot + COMPLIANCE
    dx, dy = fx - w[slot + FORCE], fy - w[slot + FORCE + 1]
    return abs(w[c] * dx + w[c + 1] * dy) + abs(w[c + 2] * dx + w[c + 3] * dy)


@inlined
def add_tangent(w, R, shape, x, y, fx, fy, ax, ay, bx, by):
    """Add a force at rest at (x, y) to f and KT, linearised; a, b: central differences over 2 NUDGE along x and y."""
    n = R.n
    sxx, syx, sxy, syy = ax / (2 * NUDGE), ay / (2 * NUDGE), bx / (2 * NUDGE), by / (2 * NUDGE)
    gx, gy = fx - (sxx * x + sxy * y), fy - (syx * x + syy * y)
    for m in range(n):
        w[R.f + m] += gx * w[shape + m] + gy * w[shape + n + m]
    for c in range(n):
        u, v = w[shape + c], w[shape + n + c]
        for r in range(n):
            push = w[shape + r] * (sxx * u + sxy * v) + w[shape + n + r] * (syx * u + syy * v)
            w[R.KT + c * n + r] -= push


@inlined
def correct_guess(w, slot, x, y, ax, ay, bx, by):
    """Newton's step of the guess towards (x, y); a and b: forces at the guess nudged along x and along y."""
    c = slot + COMPLIANCE
    fx, fy = w[slot + FORCE], w[slot + FORCE + 1]
    # -F'
    kxx, kyx = (fx - ax) / NUDGE, (fy - ay) / NUDGE
    kxy, kyy = (fx - bx) / NUDGE, (fy - by) / NUDGE
    mxx = 1.0 + w[c] * kxx + w[c + 1] * kyx
    mxy = w[c] * kxy + w[c + 1] * kyy
    myx = w[c + 2] * kxx + w[c + 3] * kyx
    myy = 1.0 + w[c + 2] * kxy + w[c + 3] * kyy
    rx, ry = x - w[slot + GUESS], y - w[slot + GUESS + 1]
    inverse = 1.0 / (mxx * myy - mxy * myx)
    w[slot + GUESS] += (myy * rx - mxy * ry) * inverse
    w[slot + GUESS + 1] += (mxx * ry - myx * rx) * inverse

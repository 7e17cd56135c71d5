r"""Implicit treatment of forces that depend on the shaft's local motion.

Each force is evaluated at a guess x_g of the stage's displacement (velocity (x_g - x_r) / (a dt)); the stage is solved
with it; where it leads to a displacement x at which the force is another one, W |F(x) - F(x_g)| above the limit, the
guess is corrected by Newton's method with the node's own compliance W = (a dt)^2 Phi T Phi':

.. math:: x_g \leftarrow x_g + (I - W F')^{-1}\,(x - x_g).

A slot of 16 doubles holds for each force: guess (2), x_r (2), force (2), W (4).

Cites: golub_2013.
"""

from __future__ import annotations

from reynolds.jit import inlined
from rotorsim.plant.kernels.modal_rotor import project

GUESS, START, FORCE, COMPLIANCE = 0, 2, 4, 6
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

r"""Modal rotor in an implicit step, condensed exactly to the compliance of its journals, 2 x 2 for one film.

In modal coordinates (mass matrix I, 2n modes; see fe_shaft.reduction)  q' = v,  v' = f + Phi_b' F - (C + Omega G) v -
K q. A stage of TR-BDF2 is  q = q_r + a dt v,  v = v_r + a dt v'  with right-hand sides q_r, v_r, hence with T = (I +
a dt (C + Omega G) + (a dt)^2 K)^-1

.. math:: v = T (v_r + a\,\Delta t\,f - a\,\Delta t\,K q_r) + a\,\Delta t\,T \Phi_b' F, \qquad X = \Phi_b q = X_0 + W F,

W = (a dt)^2 Phi_b T Phi_b': what the film needs to know of the rotor is X_0 and W. T is formed again when the speed has
moved by `SPEED_STEP`.

Damping that turns with the shaft, a time beta times its stiffness K_s, acts on the velocity in the turning frame,
-beta K_s (v - Omega e_z x q): it adds beta K_s to C and the circulatory Omega beta N to K. A bearing that is a table
over the speed adds B' K(Omega) B to K and B' C(Omega) B to C, with the rows B of its displacement.

Cites: benfield_1971, friswell_2010.
"""

from __future__ import annotations

from typing import NamedTuple

from reynolds.grid import Layout
from reynolds.jit import inlined
from reynolds.ring import invert_block
from reynolds.transient import MID, OLD, TO_MID

SPEED_STEP = 0.1
"""Change of speed [rad/s] after which the stage matrix is formed again."""

VECTORS = ("q", "v", "q_old", "v_old", "a_old", "q_mid", "v_mid", "q_rhs", "v_rhs", "f", "free")
MATRICES = ("K", "C", "G", "T", "TK", "KT", "KS", "N")
SCALARS = (
    "time", "angle", "turns", "speed", "acceleration", "order", "matrix_speed", "matrix_step",
    "disc_fx", "disc_fy", "touched", "substeps",
)  # fmt: skip
PAIRS = ("journal_start", "journal_free", "journal_before", "journal_force", "contact_push")
"""x, y of every journal: what the stage starts from, where it goes without a force, where it was before a correction,
the force on it, the contact's part of it at no displacement."""
FILM_MATRICES = {"compliance": "journal_b", "journal_a": "journal_a", "static_a": "static_a"}
FILM_PAIRS = {"journal_rhs": "journal_rhs", "static_rhs": "static_rhs"}
"""Matrices (2f, 2f) and right-hand sides (2f) of all journals; those of a single film lie in the film's own part."""


class RotorLayout(NamedTuple):
    """Sizes and offsets (in doubles) of the rotor's part of a workspace."""

    n: int
    n_machine: int
    n_housings: int
    n_films: int
    n_contact: int
    turning: int
    n_tables: int
    n_points: int
    q: int
    v: int
    q_old: int
    v_old: int
    a_old: int
    q_mid: int
    v_mid: int
    q_rhs: int
    v_rhs: int
    f: int
    free: int
    K: int
    C: int
    G: int
    T: int
    TK: int
    KT: int
    KS: int
    N: int
    to_journal: int
    journal: int
    disc: int
    time: int
    angle: int
    turns: int
    speed: int
    acceleration: int
    order: int
    matrix_speed: int
    matrix_step: int
    disc_fx: int
    disc_fy: int
    touched: int
    substeps: int
    contact: int
    contact_k: int
    journal_start: int
    journal_free: int
    journal_before: int
    journal_force: int
    contact_push: int
    shapes: int
    compliance: int
    journal_a: int
    static_a: int
    journal_rhs: int
    static_rhs: int
    small: int
    small_matrix: int
    table_rows: int
    table_speeds: int
    table_values: int
    size: int


def make_rotor_layout(
    n_modes: int,
    film: Layout,
    n_shapes: int,
    n_films: int,
    n_contact: int,
    n_supports: int = 0,
    turning: bool = False,
    tables: tuple[int, int] = (0, 0),
    n_housings: int = 0,
) -> RotorLayout:
    """Layout behind `n_films` films laid out as `film` (one that is not used, without films).

    n_modes counts both planes and two for each of the `n_housings` in the machine file, `shapes` holds (2, n) rows for
    each effect. Every resonance of an effect adds two modal coordinates behind; `turning`: the shaft has damping in its
    own frame; `tables`: bearings that are tables, and the speeds at which they stand.
    """
    n_machine, n_modes = n_modes, n_modes + 2 * n_supports
    journals, borders = max(n_films, 1), n_films * film.n_border
    sizes = dict.fromkeys(VECTORS, n_modes) | dict.fromkeys(MATRICES, n_modes**2)
    sizes |= {"to_journal": 2 * n_modes * journals, "journal": 2 * n_modes * journals, "disc": 2 * n_modes}
    sizes |= dict.fromkeys(SCALARS, 1) | dict.fromkeys(PAIRS, 2 * journals)
    sizes |= {"contact": journals, "contact_k": 4 * journals, "shapes": 2 * n_modes * max(n_shapes, 1)}
    own = {name: getattr(film, place) for name, place in (FILM_MATRICES | FILM_PAIRS).items()}
    if n_films > 1:
        own = {}
        sizes |= dict.fromkeys(FILM_MATRICES, 4 * n_films**2) | dict.fromkeys(FILM_PAIRS, 2 * n_films)
    sizes |= {"small": borders, "small_matrix": borders**2} if n_films > 1 else {"small": 0, "small_matrix": 0}
    n_tables, n_points = tables
    sizes |= {"table_rows": 2 * n_modes * n_tables, "table_speeds": n_points, "table_values": 8 * n_tables * n_points}
    offsets, at = {}, journals * film.size
    for name, size in sizes.items():
        offsets[name], at = at, at + (size if name in SCALARS else (size + 7) // 8 * 8)
    flags = {
        "n_films": n_films,
        "n_contact": n_contact,
        "turning": int(turning),
        "n_housings": n_housings,
        "n_tables": n_tables,
        "n_points": n_points,
    }
    return RotorLayout(n=n_modes, n_machine=n_machine, size=at, **flags, **offsets, **own)


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
    if R.turning == 1:
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

"""Compiled entry points for a single film; grid sizes are arguments, so one compilation serves every grid."""

from __future__ import annotations

from reynolds.film import HALVINGS, closest_places, force, smallest_gap
from reynolds.grid import PLACE
from reynolds.jit import inlined, kernel, shared
from reynolds.newton import NOT_CONVERGED, STALE_FACTORS, newton, refresh
from reynolds.texture import friction_torque as torque
from reynolds.transient import STAGE, begin_pseudo_step, end_stage, predict, stage_rhs, start


@shared
def factorise(w, ix, F, L, U, iadt):
    """`newton.refresh` as a call."""
    refresh(w, ix, F, L, U, iadt)


@shared
def iterate(w, ix, F, L, U, iadt, tolerance, patient, careful):
    """`newton.newton` as a call."""
    return newton(w, ix, F, L, U, iadt, tolerance, patient, careful)


@inlined
def solved(w, ix, F, L, U, iadt, tolerance, fresh):
    """One implicit stage, whose callers have no further copy of the machine code of its two kernels."""
    if fresh:
        factorise(w, ix, F, L, U, iadt)
    for attempt in range(6):
        n = iterate(w, ix, F, L, U, iadt, tolerance, True, attempt > 0)
        if n != STALE_FACTORS:
            return n
        factorise(w, ix, F, L, U, iadt)
    return NOT_CONVERGED


@kernel
def stage_solve(w, ix, F, L, U, iadt, tolerance, fresh):
    """One implicit stage for given m_rhs, plenum_rhs and journal equation; `fresh` factorises first."""
    return solved(w, ix, F, L, U, iadt, tolerance, fresh)


@kernel
def pseudo_step(w, ix, F, L, U, iadt, tolerance, damping):
    """One step of `transient.settle_film`; the force is left in w[force]."""
    begin_pseudo_step(w, F, L, iadt, damping)
    status = solved(w, ix, F, L, U, iadt, tolerance, True)
    force(w, L)
    return status


@kernel
def friction_torque(w, F, L, speed):
    """`reynolds.texture.friction_torque` as a call."""
    return torque(w, F, L, speed)


@kernel
def least_gap(w, F, L):
    """Smallest gap [m] round the journal where it is, in a sleeve that no effect changes."""
    places = closest_places(w, F, L, w[L.journal], w[L.journal + 1], F.clearance, F.uneven)
    return smallest_gap(w, L, places, F.clearance)


@kernel
def room(w, F, L, c, s):
    """Distance [m] that the journal can move towards (c, s) until the gap closes.

    From far outside the closest places lead to it by Newton's method, since the smallest gap is concave.
    """
    distance = 10.0 * F.wide
    for _ in range(HALVINGS):
        before, distance = distance, 1e300
        for k in range(closest_places(w, F, L, before * c, before * s, F.clearance, F.uneven)):
            o = L.places + PLACE * k
            if w[o + 1] > 0.0:
                distance = min(distance, w[o] / w[o + 1] * before)
        if abs(distance - before) < 1e-15:
            return distance
    return distance


@kernel
def march_film(w, ix, F, L, speed, dt, tolerance, path, forces, flows):
    """March the film alone through journal positions `path` (n + 1, mid and end of each step), from rest.

    Writes the force at every step's end, and per stage the injected and the escaping mass rate and the mass held.
    """
    U = speed * F.radius
    adt = STAGE * dt
    n = path.shape[0] // 2
    w[L.journal], w[L.journal + 1] = path[0, 0], path[0, 1]
    start(w, ix, F, L)
    for e in range(4):
        w[L.journal_a + e] = 1.0 if e % 3 == 0 else 0.0
        w[L.journal_b + e] = 0.0
    for i in range(n):
        for stage in range(2):
            predict(w, L, stage, min(i, 3))
            stage_rhs(w, L, stage, adt)
            row = 2 * i + 1 + stage
            w[L.journal_rhs], w[L.journal_rhs + 1] = path[row, 0], path[row, 1]
            w[L.journal], w[L.journal + 1] = path[row, 0], path[row, 1]
            if solved(w, ix, F, L, U, 1.0 / adt, tolerance, i + stage == 0) < 0:
                return NOT_CONVERGED
            end_stage(w, L, stage, adt, 0.0)
            book(w, L, L.m_mid if stage == 0 else L.m_old, flows, 2 * i + stage)
        force(w, L)
        forces[i, 0], forces[i, 1] = w[L.force], w[L.force + 1]
    return n


@inlined
def book(w, L, kept, flows, row):
    """Injected flow [kg/s], escaping flow and mass in the array `kept` (both times R_g T / (dy dz)) into a row."""
    injected = 0.0
    for i in range(L.n_inj):
        injected += w[L.film_flow + i]
    out = 0.0
    mass = 0.0
    for i in range(L.n_theta):
        k = L.first + i * L.stride
        out += w[L.flow_z + k + L.n_rows - 1]
        if L.half == 0:
            out -= w[L.flow_z + k - 1]
        for j in range(L.n_rows):
            mass += w[L.weight + k + j] * w[kept + k + j]
    flows[row, 0] = injected
    flows[row, 1] = out * (1.0 + L.half)
    flows[row, 2] = mass * (1.0 + L.half)

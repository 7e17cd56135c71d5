"""The coupled step: film, plena and rotor in one implicit TR-BDF2 step.

This file is both a module (with the stand-ins of `neutral`) and a template from which `compose` writes a machine's
own module: there the names imported from `neutral` are literal sizes and static calls of the machine's effects. A
step that does not converge is taken back and repeated as two of half the size.
"""

from __future__ import annotations

import math

from reynolds.film import force
from reynolds.jit import kernel
from reynolds.lanes import wide_vectors
from reynolds.newton import NOT_CONVERGED, STALE_FACTORS, newton, refresh
from reynolds.transient import GAMMA, STAGE, TO_END, end_stage, predict, stage_rhs, take_back
from rotorsim.plant.kernels.film_gap import shape_gap
from rotorsim.plant.kernels.modal_rotor import (
    SPEED_STEP,
    add_force,
    end_rotor_stage,
    form_matrix,
    free_velocity,
    move_rotor,
    project,
    rotor_rhs,
)
from rotorsim.plant.kernels.stubs import (
    FILM,
    RIG,
    ROTOR,
    add_forces,
    add_motion,
    contact_forces,
    correct_motion,
    form_motion,
    guess_motion,
    missed_motion,
    rotating_damping,
)
from rotorsim.plant.kernels.supply import feed_stage

PARTS = 1024
"""The smallest part of a step that is tried."""


@kernel
def factorise(w, ix, P, speed, iadt):
    """Factorise the film at the present state."""
    refresh(w, ix, P.film, FILM, speed * P.film.radius, iadt)


@kernel
def form(w, P, speed, adt):
    """Form the rotor's stage matrix."""
    form_matrix(w, ROTOR, FILM, speed, rotating_damping(P), adt)
    form_motion(w, adt)


@kernel
def solve_film(w, ix, P, speed, iadt, tolerance):
    """Newton's method for film, plena and journal, with a new factorisation when the old one has gone stale."""
    for attempt in range(6):
        n = newton(w, ix, P.film, FILM, speed * P.film.radius, iadt, tolerance, 20, attempt > 0)
        if n != STALE_FACTORS:
            return n
        factorise(w, ix, P, speed, iadt)
    return NOT_CONVERGED


@kernel
def journal_equation(w, P, x0, y0, vx, vy, speed):
    """Set X - W (F + F_c) = X_0 with the contact force linearised at the present journal; returns if it touches."""
    x, y = w[FILM.journal], w[FILM.journal + 1]
    fx, fy, kxx, kxy, kyx, kyy = contact_forces(w[RIG.clearance], x, y, vx, vy, speed * P.film.radius, P)
    touching = fx != 0.0 or fy != 0.0
    b = FILM.journal_b
    # force without displacement: F_c + K_c X
    gx = fx + kxx * x + kxy * y
    gy = fy + kyx * x + kyy * y
    for row in range(2):
        u, v = w[b + 2 * row], w[b + 2 * row + 1]
        w[FILM.journal_a + 2 * row] = u * kxx + v * kyx
        w[FILM.journal_a + 2 * row + 1] = u * kxy + v * kyy
        w[FILM.journal_rhs + row] = u * gx + v * gy
    w[FILM.journal_a] += 1.0
    w[FILM.journal_a + 3] += 1.0
    w[FILM.journal_rhs] += x0
    w[FILM.journal_rhs + 1] += y0
    w[ROTOR.contact] = 1.0 if touching else 0.0
    if touching:
        w[ROTOR.touched] = 1.0
    w[ROTOR.contact_fx] = gx
    w[ROTOR.contact_fy] = gy
    w[ROTOR.contact_k] = kxx
    w[ROTOR.contact_k + 1] = kxy
    w[ROTOR.contact_k + 2] = kyx
    w[ROTOR.contact_k + 3] = kyy
    return touching


@kernel
def solve_stage(w, ix, P, speed, adt):
    """Film, plena, journal and contact of a stage: the contact's linearisation is repeated until it holds."""
    xr, yr = project(w, ROTOR, ROTOR.journal, ROTOR.q_rhs)
    vx, vy = project(w, ROTOR, ROTOR.journal, ROTOR.free)
    x0, y0 = xr + adt * vx, yr + adt * vy
    force(w, FILM)
    b = FILM.journal_b
    if w[ROTOR.contact] == 0.0:
        w[FILM.journal] = x0 + w[b] * w[FILM.force] + w[b + 1] * w[FILM.force + 1]
        w[FILM.journal + 1] = y0 + w[b + 2] * w[FILM.force] + w[b + 3] * w[FILM.force + 1]
    for _ in range(30):
        x, y = w[FILM.journal], w[FILM.journal + 1]
        touching = journal_equation(w, P, x0, y0, (x - xr) / adt, (y - yr) / adt, speed)
        if solve_film(w, ix, P, speed, 1.0 / adt, P.tolerance) < 0:
            return NOT_CONVERGED
        if ROTOR.n_contact == 0:
            return 1
        moved = abs(w[FILM.journal] - x) + abs(w[FILM.journal + 1] - y)
        if touching:
            if moved < P.tolerance * P.film.clearance:
                return 1
        else:
            x, y = w[FILM.journal], w[FILM.journal + 1]
            vx, vy = (x - xr) / adt, (y - yr) / adt
            fx, fy, _, _, _, _ = contact_forces(w[RIG.clearance], x, y, vx, vy, speed * P.film.radius, P)
            if fx == 0.0 and fy == 0.0:
                return 1
    return NOT_CONVERGED


@kernel
def solve_motion(w, ix, P, t, angle, speed, acceleration, tau, adt):
    """Rotor and film at a stage's end, repeated until forces that depend on the motion agree with it."""
    guess_motion(w, tau)
    for _ in range(30):
        for m in range(ROTOR.n):
            w[ROTOR.f + m] = 0.0
        add_force(w, ROTOR, ROTOR.disc, w[ROTOR.disc_fx], w[ROTOR.disc_fy], ROTOR.f)
        add_forces(w, P, t, angle, speed, acceleration)
        add_motion(w, P, t, angle, speed, adt)
        free_velocity(w, ROTOR, adt)
        fx = 0.0
        fy = 0.0
        if ROTOR.has_film == 1:
            if solve_stage(w, ix, P, speed, adt) < 0:
                return NOT_CONVERGED
            force(w, FILM)
            fx, fy = journal_force(w)
        move_rotor(w, ROTOR, adt, fx, fy)
        if RIG.n_motion == 0:
            return 1
        # a nanometre's hundredth where there is no film to compare with
        limit = P.tolerance * P.film.clearance if ROTOR.has_film == 1 else 1e-11
        if missed_motion(w, P, t, angle, speed, adt) < limit:
            return 1
        correct_motion(w, P, t, angle, speed, adt)
    return NOT_CONVERGED


@kernel
def journal_force(w):
    """Force [N] of film and contact on the journal where it is."""
    x, y = w[FILM.journal], w[FILM.journal + 1]
    s = ROTOR.contact_k
    fx = w[FILM.force] + (w[ROTOR.contact_fx] - (w[s] * x + w[s + 1] * y))
    fy = w[FILM.force + 1] + (w[ROTOR.contact_fy] - (w[s + 2] * x + w[s + 3] * y))
    return fx, fy


@kernel
def try_step(w, ix, P, dt):
    """One TR-BDF2 step; returns 1, or NOT_CONVERGED with the film taken back (the rotor's start is untouched)."""
    wide_vectors()
    adt = STAGE * dt
    order = int(w[ROTOR.order])
    for stage in range(2):
        tau = dt if stage == TO_END else GAMMA * dt
        acceleration = w[ROTOR.acceleration]
        speed = w[ROTOR.speed] + acceleration * tau
        angle = w[ROTOR.angle] + (w[ROTOR.speed] + 0.5 * acceleration * tau) * tau
        t = w[ROTOR.time] + tau
        if adt != w[ROTOR.matrix_step] or abs(speed - w[ROTOR.matrix_speed]) > SPEED_STEP:
            new_step = adt != w[ROTOR.matrix_step]
            form(w, P, speed, adt)
            if ROTOR.has_film == 1 and new_step:
                factorise(w, ix, P, speed, 1.0 / adt)
        rotor_rhs(w, ROTOR, stage, adt)
        if ROTOR.has_film == 1:
            if RIG.n_film > 0:
                shape_gap(w, P, t, angle, speed)
            feed_stage(w, P, t)
            predict(w, FILM, stage, order)
            stage_rhs(w, FILM, stage, adt)
        if solve_motion(w, ix, P, t, angle, speed, acceleration, tau, adt) < 0:
            if ROTOR.has_film == 1:
                take_back(w, FILM)
                w[FILM.journal], w[FILM.journal + 1] = project(w, ROTOR, ROTOR.journal, ROTOR.q_old)
            w[ROTOR.contact] = 0.0
            w[ROTOR.matrix_step] = 0.0
            return NOT_CONVERGED
        if ROTOR.has_film == 1:
            end_stage(w, FILM, stage, adt)
        end_rotor_stage(w, ROTOR, stage, adt)
    w[ROTOR.order] = min(order + 1, 3)
    advance_clock(w, dt)
    return 1


@kernel
def advance_clock(w, dt):
    """Move time, angle and speed to the step's end; the angle stays within one turn."""
    angle = w[ROTOR.angle] + (w[ROTOR.speed] + 0.5 * w[ROTOR.acceleration] * dt) * dt
    turns = math.floor(angle / (2.0 * math.pi))
    w[ROTOR.angle] = angle - turns * 2.0 * math.pi
    w[ROTOR.turns] += turns
    w[ROTOR.speed] += w[ROTOR.acceleration] * dt
    w[ROTOR.time] += dt


@kernel
def step(w, ix, P):
    """Advance by the plant's time step, in smaller ones where needed; returns 1 or NOT_CONVERGED."""
    left = PARTS
    part = PARTS
    while left > 0:
        if try_step(w, ix, P, P.dt * part / PARTS) > 0:
            left -= part
            if part < PARTS:
                w[ROTOR.substeps] += 1.0
            if part < PARTS and left % (2 * part) == 0 and left > 0:
                part *= 2
                w[ROTOR.order] = 0.0
        else:
            part //= 2
            w[ROTOR.order] = 0.0
            if part == 0:
                return NOT_CONVERGED
    if part < PARTS:
        w[ROTOR.order] = 0.0
    return 1

"""The coupled step: films, plena and rotor in one implicit TR-BDF2 step.

This file is a template from which `rotorsim.plant.compose` writes a machine's own module, in which the names imported
from `effect_calls` are numbers and static calls of the machine's effects; as it stands it is a module without effects.
A step that does not converge is taken back and repeated as two of half the size.

Where a journal is in contact or moves towards it, a step whose error, by the third-order method in its stages
(`modal_rotor.embedded_error`), is too large is repeated as four, and the steps that follow are as small until four of
them would have been within the limit as one. Elsewhere no bit depends on this.

Where `solver.corrections` bounds a step's work, it is never repeated: a stage out of room keeps its last correction,
or, where that is far off or there is none, the films of the step's start.
"""

from __future__ import annotations

import math

from reynolds.film import force, thickness
from reynolds.grid import PLACE
from reynolds.jit import inlined, kernel
from reynolds.newton import (
    CUT,
    DISTANT,
    FACTORISATIONS,
    FAR,
    FRESH,
    ITERATIONS,
    LIMIT,
    NOT_CONVERGED,
    OVERRUNS,
    PRICE,
    STALE_FACTORS,
    SURPRISE,
    cut_short,
    find_scales,
    newton,
    refresh,
    room_left,
)
from reynolds.transient import (
    GAMMA,
    STAGE,
    TO_END,
    TO_MID,
    TRUST,
    carry_mass,
    end_stage,
    gas_spring,
    hold,
    predict,
    stage_rhs,
    take_back,
)
from reynolds.vectors import wide_vectors
from rotorsim.plant.kernels.effect_calls import (
    FILM,
    RIG,
    ROTOR,
    add_forces,
    add_motion,
    add_random_forces,
    contact_forces,
    correct_motion,
    film_constants,
    form_motion,
    guess_motion,
    keep_motion,
    missed_motion,
    motion_torque,
    rotating_damping,
)
from rotorsim.plant.kernels.films import film_indices, film_part, find_places, iterate_films, least_gap, shape_gap
from rotorsim.plant.kernels.injectors import feed_stage
from rotorsim.plant.kernels.modal_rotor import (
    SPEED_STEP,
    add_force,
    embedded_error,
    end_rotor_stage,
    form_matrix,
    free_velocity,
    move_rotor,
    project,
    rotor_rhs,
)

PARTS = 1024
"""The smallest part of a step that is tried."""
FEWER = 4
"""Parts that take the place of a step with too large an error."""
FINEST = 64
"""Most parts of a step that its error asks for."""
ALLOWED = 5e-4
"""Error of a step that is allowed to all its parts together, in clearances."""
AHEAD = 4.0
"""Samples within which a journal that comes to its sleeve is near contact."""
THIN = 0.1
"""Gap below which the film holds the journal, in clearances."""
HELD = 0.2
"""Share of an error that lasts where the film holds the journal; chosen by hits against steps of 2 us."""
INEXACT = -3
"""Status of a step whose error near contact is too large."""
RESERVE = 3.0
"""Corrections that bounded work keeps for the second stage."""
LOST = 1.0
"""Error (pressure / ambient + journal / clearance) that is noted where bounded work finds no answer."""
MOST_ROUNDS = 30
"""Most solutions of a stage until contacts, or forces that depend on the motion, agree with it."""
SETTLINGS = 4
"""Corrections of journals in contact, each as cheap as a reading of the gap, before the films are solved."""


@kernel
def factorise(w, ix, P, speed, iadt):
    """Factorise the films at the present state."""
    for f in range(ROTOR.n_films):
        F = film_constants(P, f)
        refresh(film_part(w, f), film_indices(ix, f), F, FILM, speed * F.radius, iadt)


@kernel
def form(w, P, speed, adt):
    """Form the rotor's stage matrix."""
    form_matrix(w, ROTOR, speed, rotating_damping(P), adt)
    form_motion(w, P, adt)


@kernel
def solve_film(w, ix, P, speed, iadt, tolerance, patient):
    """Newton's method for films, plena and journals, with new factorisations when the old ones have gone stale."""
    for attempt in range(6):
        if ROTOR.n_films == 1:
            n = newton(w, ix, P.film_0, FILM, speed * P.film_0.radius, iadt, tolerance, patient, attempt > 0)
        else:
            n = iterate_films(w, ix, P, speed, iadt, tolerance, patient, attempt > 0)
        if n != STALE_FACTORS:
            return n
        factorise(w, ix, P, speed, iadt)
    return NOT_CONVERGED


@inlined
def touch(w, P, f, speed, adt):
    """Contact force on journal f where it is, with its negative derivative, and its torque about the shaft's axis."""
    fx, fy, kxx, kxy, kyx, kyy, torque = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if RIG.n_contact > 0:
        v, radius = film_part(w, f), film_constants(P, f).radius
        x, y = v[FILM.journal], v[FILM.journal + 1]
        s = ROTOR.journal_start + 2 * f
        vx, vy = (x - w[s]) / adt, (y - w[s + 1]) / adt
        for k in range(find_places(w, P, f, x, y)):
            o = FILM.places + PLACE * k
            nx, ny = v[o + 2], v[o + 3]
            a, b, c, d, e, g = contact_forces(f, v[o], v[o + 1], nx, ny, v[o + 4], vx, vy, speed * radius, P)
            fx, fy, kxx, kxy, kyx, kyy = fx + a, fy + b, kxx + c, kxy + d, kyx + e, kyy + g
            torque += radius * (nx * b - ny * a)
    return fx, fy, kxx, kxy, kyx, kyy, torque


@kernel
def journal_equation(w, P, speed, adt):
    """Set X - W (F + F_c) = X_0 with the contact forces linearised at the present journals."""
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        x, y = v[FILM.journal], v[FILM.journal + 1]
        fx, fy, kxx, kxy, kyx, kyy, _ = touch(w, P, f, speed, adt)
        # force without displacement: F_c + K_c X
        w[ROTOR.contact_push + 2 * f] = fx + kxx * x + kxy * y
        w[ROTOR.contact_push + 2 * f + 1] = fy + kyx * x + kyy * y
        k = ROTOR.contact_k + 4 * f
        w[k], w[k + 1], w[k + 2], w[k + 3] = kxx, kxy, kyx, kyy
        w[ROTOR.contact + f] = 1.0 if fx != 0.0 or fy != 0.0 else 0.0
    n = 2 * ROTOR.n_films
    for row in range(n):
        push = 0.0
        for f in range(ROTOR.n_films):
            b = ROTOR.compliance + n * row + 2 * f
            a = ROTOR.journal_a + n * row + 2 * f
            k = ROTOR.contact_k + 4 * f
            g = ROTOR.contact_push + 2 * f
            w[a] = w[b] * w[k] + w[b + 1] * w[k + 2]
            w[a + 1] = w[b] * w[k + 1] + w[b + 1] * w[k + 3]
            push += w[b] * w[g] + w[b + 1] * w[g + 1]
        w[ROTOR.journal_a + n * row + row] += 1.0
        w[ROTOR.journal_rhs + row] = push + w[ROTOR.journal_free + row]


@inlined
def free_journals(w, adt):
    """Positions of the journals at the start of a stage, and those that they reach without forces on them."""
    for f in range(ROTOR.n_films):
        s = 2 * f
        rows = ROTOR.journal + 2 * ROTOR.n * f
        w[ROTOR.journal_start + s], w[ROTOR.journal_start + s + 1] = project(w, ROTOR, rows, ROTOR.q_rhs)
        vx, vy = project(w, ROTOR, rows, ROTOR.free)
        w[ROTOR.journal_free + s] = w[ROTOR.journal_start + s] + adt * vx
        w[ROTOR.journal_free + s + 1] = w[ROTOR.journal_start + s + 1] + adt * vy


@inlined
def guess_journals(w):
    """Journals where the present film forces take them; a journal in contact stays where it is."""
    n = 2 * ROTOR.n_films
    for f in range(ROTOR.n_films):
        force(film_part(w, f), FILM)
    for f in range(ROTOR.n_films):
        if w[ROTOR.contact + f] == 0.0:
            v = film_part(w, f)
            for axis in range(2):
                place = w[ROTOR.journal_free + 2 * f + axis]
                for g in range(ROTOR.n_films):
                    b = ROTOR.compliance + n * (2 * f + axis) + 2 * g
                    u = film_part(w, g)
                    place = place + w[b] * u[FILM.force] + w[b + 1] * u[FILM.force + 1]
                v[FILM.journal + axis] = place


@inlined
def in_contact(w):
    """Whether a journal is in contact, as its equation is linearised."""
    touching = False
    for f in range(ROTOR.n_films):
        touching = touching or w[ROTOR.contact + f] != 0.0
    return touching


@inlined
def settle_contacts(w, P, speed, adt):
    """Move journals in contact to where it balances the forces that the films have now; their equation goes along."""
    for _ in range(SETTLINGS if in_contact(w) else 0):
        for f in range(ROTOR.n_films):
            if w[ROTOR.contact + f] != 0.0:
                settle_journal(w, f)
        journal_equation(w, P, speed, adt)


@inlined
def settle_journal(w, f):
    """Solve the equation of journal f, as it is linearised, with all film forces and other journals as they are."""
    n, x = 2 * ROTOR.n_films, 2 * f
    a, b = ROTOR.journal_a + n * x, ROTOR.journal_a + n * (x + 1)
    c, d = ROTOR.compliance + n * x, ROTOR.compliance + n * (x + 1)
    p, q = w[ROTOR.journal_rhs + x], w[ROTOR.journal_rhs + x + 1]
    for g in range(ROTOR.n_films):
        v, y = film_part(w, g), 2 * g
        p += w[c + y] * v[FILM.force] + w[c + y + 1] * v[FILM.force + 1]
        q += w[d + y] * v[FILM.force] + w[d + y + 1] * v[FILM.force + 1]
        if g != f:
            p -= w[a + y] * v[FILM.journal] + w[a + y + 1] * v[FILM.journal + 1]
            q -= w[b + y] * v[FILM.journal] + w[b + y + 1] * v[FILM.journal + 1]
    u = film_part(w, f)
    inverse = 1.0 / (w[a + x] * w[b + x + 1] - w[a + x + 1] * w[b + x])
    u[FILM.journal] = (w[b + x + 1] * p - w[a + x + 1] * q) * inverse
    u[FILM.journal + 1] = (w[a + x] * q - w[b + x] * p) * inverse


@inlined
def contacts_agree(w, P, speed, adt):
    """Whether every contact is as it was linearised: it moved less than the tolerance, or is open still.

    A foil bends with the film's pressure, which the linearised contact leaves out: it is to press as it was assumed to.
    """
    for f in range(ROTOR.n_films):
        v, s = film_part(w, f), ROTOR.journal_before + 2 * f
        x, y, allowed = v[FILM.journal], v[FILM.journal + 1], P.tolerance * film_constants(P, f).clearance
        closed = w[ROTOR.contact + f] != 0.0
        if closed and not abs(x - w[s]) + abs(y - w[s + 1]) < allowed:
            return False
        if FILM.foil == 1 or not closed:
            missed, assumed, _ = misfit(w, P, f, speed, adt)
            if not missed <= allowed * assumed:
                return False
    return True


@inlined
def misfit(w, P, f, speed, adt):
    """Force [N] that contact exerts on journal f beyond what was linearised, and its stiffness [N/m] then and now."""
    v, k, g = film_part(w, f), ROTOR.contact_k + 4 * f, ROTOR.contact_push + 2 * f
    x, y = v[FILM.journal], v[FILM.journal + 1]
    fx, fy, kxx, _, _, kyy, _ = touch(w, P, f, speed, adt)
    missed_x = fx - (w[g] - (w[k] * x + w[k + 1] * y))
    missed_y = fy - (w[g + 1] - (w[k + 2] * x + w[k + 3] * y))
    return abs(missed_x) + abs(missed_y), abs(w[k]) + abs(w[k + 3]), abs(kxx) + abs(kyy)


@inlined
def contacts_missed(w, P, speed, adt):
    """Largest move of a journal since its contacts were linearised, or misfit of a foil's as a move, in clearances."""
    most = 0.0
    for f in range(ROTOR.n_films):
        v, s, c = film_part(w, f), ROTOR.journal_before + 2 * f, film_constants(P, f).clearance
        moved = abs(v[FILM.journal] - w[s]) + abs(v[FILM.journal + 1] - w[s + 1])
        most = max(most, moved / c)
        if FILM.foil == 1:
            missed, before, now = misfit(w, P, f, speed, adt)
            most = max(most, missed / (max(before, now) * c)) if missed > 0.0 else most
    return most


@inlined
def hold_films(w, P, adt):
    """Films as at the step's start, and journals where these and contacts take them, for an answer that is far off.

    Contacts rub as on a shaft at standstill: films that are held do not damp, and friction with one that turns would
    drive its journals round in an ever larger backward whirl.
    """
    for f in range(ROTOR.n_films):
        hold(film_part(w, f), film_constants(P, f), FILM, 1.0 / adt)
        w[ROTOR.contact + f] = 0.0
    guess_journals(w)
    journal_equation(w, P, 0.0, adt)
    if RIG.n_contact > 0:
        settle_contacts(w, P, 0.0, adt)
    for f in range(ROTOR.n_films):
        thickness(film_part(w, f), film_constants(P, f), FILM)


@inlined
def give_up(w, P, adt):
    """End a stage that has no answer: NOT_CONVERGED, or where work is bounded the films held, and new factors next."""
    c = FILM.convergence
    if w[c + LIMIT] == 0.0:
        return NOT_CONVERGED
    cut_short(w, c, LOST)
    w[c + SURPRISE] = LOST
    hold_films(w, P, adt)
    return 1


@inlined
def lead_journals(w, P):
    """Journals where films that keep the mass in every cell take them, each by a step of Newton's method."""
    n = 2 * ROTOR.n_films
    # both are free until the contacts are linearised
    before, spring = ROTOR.journal_before, ROTOR.contact_k
    for f in range(ROTOR.n_films):
        v, s, k = film_part(w, f), before + 2 * f, spring + 4 * f
        w[s], w[s + 1] = v[FILM.journal], v[FILM.journal + 1]
        w[k], w[k + 1], w[k + 2], w[k + 3] = gas_spring(v, film_constants(P, f), FILM)
    guess_journals(w)
    for f in range(ROTOR.n_films):
        if w[ROTOR.contact + f] == 0.0:
            v, s, k = film_part(w, f), before + 2 * f, spring + 4 * f
            a = ROTOR.compliance + n * 2 * f + 2 * f
            b = a + n
            xx, xy = 1.0 - (w[a] * w[k] + w[a + 1] * w[k + 1]), -(w[a] * w[k + 2] + w[a + 1] * w[k + 3])
            yx, yy = -(w[b] * w[k] + w[b + 1] * w[k + 1]), 1.0 - (w[b] * w[k + 2] + w[b + 1] * w[k + 3])
            dx, dy = v[FILM.journal] - w[s], v[FILM.journal + 1] - w[s + 1]
            inverse = 1.0 / (xx * yy - xy * yx)
            v[FILM.journal] = w[s] + (yy * dx - xy * dy) * inverse
            v[FILM.journal + 1] = w[s + 1] + (xx * dy - yx * dx) * inverse


@inlined
def begin_far(w, ix, P, stage, speed, adt):
    """Starting values of a stage that polynomials miss by far: masses carried on, and journals that go with them."""
    c, missed = FILM.convergence, 0.0
    for f in range(ROTOR.n_films):
        missed = max(missed, carry_mass(film_part(w, f), film_constants(P, f), FILM, stage, w[ROTOR.order]))
    w[c + SURPRISE] = max(w[c + SURPRISE], missed)
    lead_journals(w, P)
    journal_equation(w, P, speed, adt)
    if RIG.n_contact > 0:
        settle_contacts(w, P, speed, adt)
    for f in range(ROTOR.n_films):
        carry_mass(film_part(w, f), film_constants(P, f), FILM, stage, w[ROTOR.order])
    if stage == TO_MID and room_left(w, c) > PRICE:
        factorise(w, ix, P, speed, 1.0 / adt)
    else:
        for f in range(ROTOR.n_films):
            F = film_constants(P, f)
            find_scales(film_part(w, f), F, FILM, speed * F.radius, 1.0 / adt)


@kernel
def solve_stage(w, ix, P, stage, speed, adt):
    """Films, plena, journals and contacts of a stage: the contacts' linearisation is repeated until it holds."""
    free_journals(w, adt)
    guess_journals(w)
    journal_equation(w, P, speed, adt)
    if RIG.n_contact > 0:
        settle_contacts(w, P, speed, adt)
    if w[FILM.convergence + FRESH] > 0.0:
        begin_far(w, ix, P, stage, speed, adt)
        w[FILM.convergence + FRESH] = 0.0
    for _ in range(MOST_ROUNDS):
        for f in range(ROTOR.n_films):
            v, s = film_part(w, f), ROTOR.journal_before + 2 * f
            w[s], w[s + 1] = v[FILM.journal], v[FILM.journal + 1]
        if solve_film(w, ix, P, speed, 1.0 / adt, P.tolerance, False) < 0:
            return give_up(w, P, adt)
        agreed = RIG.n_contact == 0 or contacts_agree(w, P, speed, adt)
        if not agreed and room_left(w, FILM.convergence) < 1.0:
            cut_short(w, FILM.convergence, max(contacts_missed(w, P, speed, adt), P.tolerance))
        if w[FILM.convergence + CUT] > TRUST:
            hold_films(w, P, adt)
        if agreed or w[FILM.convergence + CUT] > 0.0:
            return 1
        journal_equation(w, P, speed, adt)
    return give_up(w, P, adt)


@kernel
def solve_motion(w, ix, P, stage, t, angle, speed, acceleration, tau, adt):
    """Rotor and films at a stage's end, repeated until forces that depend on the motion agree with it."""
    guess_motion(w, P, tau)
    for n in range(MOST_ROUNDS):
        for m in range(ROTOR.n):
            w[ROTOR.f + m] = 0.0
        add_force(w, ROTOR, ROTOR.struck, w[ROTOR.disc_fx], w[ROTOR.disc_fy], ROTOR.f)
        add_forces(w, P, t, angle, speed, acceleration)
        if RIG.n_random_force > 0:
            add_random_forces(w, P, (t - w[RIG.begin]) / P.sample)
        add_motion(w, P, t, angle, speed, adt)
        free_velocity(w, ROTOR, adt)
        if ROTOR.n_films > 0:
            if solve_stage(w, ix, P, stage, speed, adt) < 0:
                return NOT_CONVERGED
            journal_forces(w)
        move_rotor(w, ROTOR, adt)
        if RIG.n_motion == 0:
            return 1
        missed = missed_motion(w, P, t, angle, speed, adt)
        if missed < P.motion_tolerance:
            return 1
        if room_left(w, FILM.convergence) < 1.0 or (P.corrections > 0.0 and n == MOST_ROUNDS - 1):
            cut_short(w, FILM.convergence, missed * P.tolerance / P.motion_tolerance)
            return 1
        correct_motion(w, P, t, angle, speed, adt)
    return NOT_CONVERGED


@kernel
def journal_forces(w):
    """Force [N] of film and contact on every journal where it is, into w[journal_force]."""
    for f in range(ROTOR.n_films):
        v, s = film_part(w, f), ROTOR.contact_k + 4 * f
        force(v, FILM)
        x, y = v[FILM.journal], v[FILM.journal + 1]
        g = 2 * f
        w[ROTOR.journal_force + g] = v[FILM.force] + (w[ROTOR.contact_push + g] - (w[s] * x + w[s + 1] * y))
        w[ROTOR.journal_force + g + 1] = v[FILM.force + 1] + (
            w[ROTOR.contact_push + g + 1] - (w[s + 2] * x + w[s + 3] * y)
        )


@inlined
def braking_torque(w, P, t, angle, speed, adt):
    """Torque [N m] that the friction of rub and contact exerts on the shaft in the motion found."""
    torque = motion_torque(w, P, t, angle, speed, adt)
    for f in range(ROTOR.n_films):
        if w[ROTOR.contact + f] != 0.0:
            _, _, _, _, _, _, one = touch(w, P, f, speed, adt)
            torque += one
    return torque


@inlined
def book_torque(w, P, stage, t, angle, speed, adt, dt):
    """Take the torque of rub and contact into the impulse, weighted as the step weights its forces."""
    torque = braking_torque(w, P, t, angle, speed, adt)
    if stage == TO_END:
        w[RIG.impulse] += dt * (STAGE * torque + 0.5 * (1.0 - STAGE) * (w[RIG.torque_old] + w[RIG.torque_mid]))
        w[RIG.torque_old] = torque
    else:
        w[RIG.torque_mid] = torque


@inlined
def start_stage(w, P, t, angle, speed, stage, order, adt):
    """Gaps, supply, starting values and right-hand sides of the films in a stage."""
    for f in range(ROTOR.n_films):
        if RIG.n_film > 0:
            shape_gap(w, P, f, t, angle, speed)
    feed_stage(w, P, t)
    # what the starting values of the last stage missed: far from it, polynomials through more steps miss by more
    far = w[FILM.convergence + SURPRISE] > FAR
    w[FILM.convergence + SURPRISE] = 0.0
    w[FILM.convergence + FRESH] = 1.0 if far else 0.0
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        v[FILM.convergence + DISTANT] = 1.0 if far else 0.0
        predict(v, FILM, stage, min(order, 1) if far else order)
        stage_rhs(v, FILM, stage, adt)


@inlined
def take_films_back(w):
    """Put films and journals back to the step's start."""
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        take_back(v, FILM)
        rows = ROTOR.journal + 2 * ROTOR.n * f
        v[FILM.journal], v[FILM.journal + 1] = project(w, ROTOR, rows, ROTOR.q_old)
        w[ROTOR.contact + f] = 0.0


@inlined
def nearing(w, P, f, gap, adt):
    """Whether journal f, as fast as it is and is accelerated, comes to its sleeve, `gap` [m] away, within `AHEAD`."""
    v, rows, ahead = film_part(w, f), ROTOR.journal + 2 * ROTOR.n * f, AHEAD * P.sample
    vx, vy = project(w, ROTOR, rows, ROTOR.v)
    ux, uy = project(w, ROTOR, rows, ROTOR.v_rhs)
    share = 0.5 * ahead / adt
    x, y = ahead * (vx + share * (vx - ux)), ahead * (vy + share * (vy - uy))
    if gap > abs(x) + abs(y) or least_gap(w, P, f, v[FILM.journal] + x, v[FILM.journal + 1] + y) > 0.0:
        return False
    c = film_constants(P, f).clearance
    fx, _, _, _, _, _ = contact_forces(f, 0.0, c, 1.0, 0.0, c, 0.0, 0.0, 0.0, P)
    return fx != 0.0


@inlined
def contact_error(w, P, dt, adt):
    """Error of a solved step at journals near contact, as its parts together would have it, in clearances.

    A journal deeper in its sleeve than the clearance is beyond what a contact is: no smaller parts are asked for.
    """
    worst = 0.0
    formed = False
    for f in range(ROTOR.n_films):
        v, c = film_part(w, f), film_constants(P, f).clearance
        gap = least_gap(w, P, f, v[FILM.journal], v[FILM.journal + 1])
        if gap > -c and nearing(w, P, f, gap, adt):
            if not formed:
                embedded_error(w, ROTOR, dt, adt)
                formed = True
            rows = ROTOR.journal + 2 * ROTOR.n * f
            x, y = project(w, ROTOR, rows, ROTOR.f)
            vx, vy = project(w, ROTOR, rows, ROTOR.free)
            error = (abs(x) + abs(y) + P.dt * (abs(vx) + abs(vy))) * P.dt / (dt * c)
            worst = max(worst, HELD * error if gap < THIN * c else error)
    return worst


@inlined
def allow_work(w, P, stage):
    """Bound the work of a stage by what the step's leaves to it."""
    c = FILM.convergence
    if stage == TO_MID:
        w[c + LIMIT] = w[c + ITERATIONS] + PRICE * w[c + FACTORISATIONS] + P.corrections - RESERVE
    else:
        w[c + LIMIT] += RESERVE
    w[c + CUT] = 0.0


@kernel
def try_step(w, ix, P, dt):
    """One TR-BDF2 step; returns 1, or NOT_CONVERGED or INEXACT with the film taken back (the rotor's start stays)."""
    wide_vectors()
    adt = STAGE * dt
    order = int(w[ROTOR.order])
    overrun = 0.0
    for stage in range(2):
        tau = dt if stage == TO_END else GAMMA * dt
        acceleration = w[ROTOR.acceleration]
        speed = w[ROTOR.speed] + acceleration * tau
        angle = w[ROTOR.angle] + (w[ROTOR.speed] + 0.5 * acceleration * tau) * tau
        t = w[ROTOR.time] + tau
        if P.corrections > 0.0:
            allow_work(w, P, stage)
        if adt != w[ROTOR.matrix_step] or abs(speed - w[ROTOR.matrix_speed]) > SPEED_STEP:
            new_step = adt != w[ROTOR.matrix_step]
            form(w, P, speed, adt)
            if new_step:
                factorise(w, ix, P, speed, 1.0 / adt)
        rotor_rhs(w, ROTOR, stage, adt)
        if ROTOR.n_films > 0:
            start_stage(w, P, t, angle, speed, stage, order, adt)
        if solve_motion(w, ix, P, stage, t, angle, speed, acceleration, tau, adt) < 0:
            take_films_back(w)
            w[ROTOR.matrix_step] = 0.0
            # the smaller step begins with the pressures that are there: no mass is carried into a gap that is not known
            w[FILM.convergence + SURPRISE] = 0.0
            return NOT_CONVERGED
        if RIG.n_contact > 0 and stage == TO_END and P.corrections == 0.0:
            error = contact_error(w, P, dt, adt)
            if error > ALLOWED and FINEST * dt > P.dt:
                take_films_back(w)
                w[ROTOR.matrix_step] = 0.0
                return INEXACT
            w[ROTOR.error] = max(w[ROTOR.error], error)
        for f in range(ROTOR.n_films):
            end_stage(film_part(w, f), FILM, stage, adt, w[FILM.convergence + CUT])
            if w[ROTOR.contact + f] != 0.0:
                w[ROTOR.touched] = 1.0
        overrun = 1.0 if w[FILM.convergence + CUT] > 0.0 else overrun
        if stage == TO_END:
            keep_motion(w, P, t, angle, speed, adt)
        end_rotor_stage(w, ROTOR, stage, adt)
        if RIG.n_braking > 0:
            book_torque(w, P, stage, t, angle, speed, adt, dt)
    w[FILM.convergence + OVERRUNS] += overrun
    w[ROTOR.order] = 0.0 if overrun > 0.0 else min(order + 1, 3)
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


@inlined
def largest_part(w, P):
    """Part of a step, of `PARTS`, that is tried first: all of it unless the error of the last one asked for less."""
    return int(w[ROTOR.largest]) if RIG.n_contact > 0 and w[ROTOR.largest] > 0.0 else PARTS


@inlined
def relax(w, largest):
    """Allow the next step `FEWER` times the part where this one's error leaves room for it."""
    w[ROTOR.largest] = largest
    if largest < PARTS and w[ROTOR.error] * (FEWER * FEWER) < ALLOWED:
        w[ROTOR.largest] = min(FEWER * largest, PARTS)
        w[ROTOR.order] = 0.0


@kernel
def step(w, ix, P):
    """Advance by the plant's time step, in smaller ones where needed; returns 1 or NOT_CONVERGED."""
    left = PARTS
    largest = largest_part(w, P)
    part = largest
    w[ROTOR.error] = 0.0
    while left > 0:
        status = try_step(w, ix, P, P.dt * part / PARTS)
        if status > 0:
            left -= part
            if part < PARTS:
                w[ROTOR.substeps] += 1.0
            if part < largest and left % (2 * part) == 0 and left > 0:
                part *= 2
                w[ROTOR.order] = 0.0
        else:
            part //= FEWER if status == INEXACT else 2
            if status == INEXACT:
                largest = part
            w[ROTOR.order] = 0.0
            if part == 0:
                return NOT_CONVERGED
    if part < largest:
        w[ROTOR.order] = 0.0
    if RIG.n_contact > 0:
        relax(w, largest)
    return 1

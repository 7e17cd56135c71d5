"""Several films on one rotor: their parts of the workspace, and Newton's method for all of them at once.

Every film has its own part of the workspace, laid out alike. A correction of a film is that of `reynolds.newton`, up to
its border; the displacements of all journals meet in one small system through the rotor's compliance, which couples
every journal with every film's force. Flows of injectors, which one film alone has to do with, are eliminated there.

This file is a template as `step` is.

Gap of every film as modified by the effects and where it is smallest, viscosity and slip.

This file is a template as `step` is.

Cites: golub_2013.
"""

from __future__ import annotations

from reynolds.film import closest_places, smallest_gap
from reynolds.jit import inlined, kernel, view
from reynolds.newton import (
    BOWED,
    ITERATIONS,
    begin_correction,
    eliminate_small,
    finish_correction,
    judge_correction,
    read_correction,
)
from rotorsim.plant.kernels.effect_calls import FILM, RIG, ROTOR, film_constants, film_shape, gas_state, warmed_film


@view
def film_part(w, f):
    """Part of the workspace that belongs to film f."""
    return w if ROTOR.n_films == 1 else w[f * FILM.size : (f + 1) * FILM.size]


@view
def film_indices(ix, f):
    """Part of the index array that belongs to film f."""
    return ix if ROTOR.n_films == 1 else ix[f * FILM.n_integers : (f + 1) * FILM.n_integers]


@inlined
def gather_borders(w, f):
    """Add the force of film f, which `read_correction` left, to the common system: it moves every journal."""
    v = film_part(w, f)
    nb, ni, n = FILM.n_border, FILM.n_inj, 2 * ROTOR.n_films
    o = FILM.small + nb + ni
    for row in range(n):
        b = ROTOR.compliance + n * row + 2 * f
        a = ROTOR.journal_a + n * row + 2 * f
        for col in range(2):
            m = FILM.small_matrix + (ni + col) * nb + ni
            w[ROTOR.small_matrix + (2 * f + col) * n + row] = w[b] * v[m] + w[b + 1] * v[m + 1] + w[a + col]
        w[ROTOR.small + row] += (
            w[b] * v[o] + w[b + 1] * v[o + 1] - w[a] * v[FILM.journal] - w[a + 1] * v[FILM.journal + 1]
        )


@kernel
def correct_films(w, ix, P, iadt):
    """One correction of all films and journals from the residuals; returns its size in the film where it is largest."""
    n = 2 * ROTOR.n_films
    for row in range(n):
        w[ROTOR.small + row] = w[ROTOR.journal_rhs + row]
    for f in range(ROTOR.n_films):
        read_correction(film_part(w, f), film_indices(ix, f), FILM, iadt)
        gather_borders(w, f)
        w[FILM.convergence + BOWED] = max(w[FILM.convergence + BOWED], film_part(w, f)[FILM.convergence + BOWED])
    eliminate_small(w, ROTOR.small_matrix, ROTOR.small, n, n)
    size = 0.0
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        for axis in range(2):
            v[FILM.small + FILM.n_inj + axis] = w[ROTOR.small + 2 * f + axis]
        own = finish_correction(v, film_indices(ix, f), film_constants(P, f), FILM)
        if size == size and not own <= size:  # NaN stays: it does not count as small
            size = own
    return size


@kernel
def iterate_films(w, ix, P, speed, iadt, tolerance, patient, careful):
    """Newton's method for all films and journals; as `reynolds.newton.newton` for one."""
    before = 0.0
    n = 0
    done = False
    first = film_part(w, 0)
    while True:
        for f in range(ROTOR.n_films):
            F = film_constants(P, f)
            v, numbers = film_part(w, f), film_indices(ix, f)
            begin_correction(v, numbers, F, FILM, speed * F.radius, iadt, careful or n >= 4)
        if done:
            return n
        size = correct_films(w, ix, P, iadt)
        n += 1
        first[FILM.convergence + ITERATIONS] += 1.0
        verdict = judge_correction(first, FILM.convergence, n, size, before, tolerance, patient)
        if verdict < 0:
            return verdict
        done = verdict > 0
        before = size


@inlined
def axial(F, row):
    """z [m] of a film row from the film's middle; the row after the last is the edge."""
    return row * F.dz if FILM.half == 1 else (row + 1 - 0.5 * (FILM.n_rows + 1)) * F.dz


@inlined
def shape_gap(w, P, f, t, angle, speed):
    """Write the sleeve's form and the effects into the clearance of film f, ghosts and edges too; keeps the mean."""
    F, v = film_constants(P, f), film_part(w, f)
    s = FILM.stride
    total, grown = 0.0, 0.0
    low, high, steepest = 1e300, -1e300, 0.0
    if RIG.n_heat > 0:
        grown, _ = warmed_film(f, w, P)
    for i in range(FILM.n_theta):
        height, slope = film_shape(f, t, angle, speed, i * (F.dy / F.radius), P)
        if RIG.n_heat > 0:
            height += grown
        total += height
        low, high, steepest = min(low, height), max(high, height), max(steepest, abs(slope))
        for j in range(FILM.half - 1, FILM.n_rows + 1):
            k = FILM.first + i * s + j
            v[FILM.clearance + k] = v[FILM.form + k] + height + slope * axial(F, j)
    start = FILM.clearance + FILM.first
    end = start + FILM.n_theta * s
    for j in range(FILM.half - 1, s + FILM.half - 1):
        v[start - s + j] = v[end - s + j]
        v[end + j] = v[start + j]
    w[RIG.clearance + f] = F.clearance + total / FILM.n_theta
    w[RIG.uneven + f] = max(F.uneven, high - low + steepest)


@inlined
def set_gas(w, P, f, t, speed):
    """Viscosity and slip of film f."""
    F, v = film_constants(P, f), film_part(w, f)
    factor, path = gas_state(f, t, speed, F.mean_free_path, P)
    if RIG.n_heat > 0:
        _, warmer = warmed_film(f, w, P)
        factor *= warmer
    v[FILM.mu] = F.mu * factor
    v[FILM.slip] = 6.0 * path * F.pa


@kernel
def find_places(w, P, f, x, y):
    """Put the places where journal f, at (x, y) in its sleeve, is closest to it into its part; returns their number."""
    return closest_places(film_part(w, f), film_constants(P, f), FILM, x, y, w[RIG.clearance + f], w[RIG.uneven + f])


@inlined
def least_gap(w, P, f, x, y):
    """Smallest gap [m] of film f with its journal at (x, y) in the sleeve."""
    return smallest_gap(film_part(w, f), FILM, find_places(w, P, f, x, y), w[RIG.clearance + f])

"""Gap of every film as modified by the effects and where it is smallest, viscosity and slip.

This file is a template as `step` is.
"""

from __future__ import annotations

from reynolds.film import closest_places, smallest_gap
from reynolds.jit import inlined, kernel
from rotorsim.plant.kernels.effect_calls import FILM, RIG, film_constants, film_shape, gas_state, warmed_film
from rotorsim.plant.kernels.films import film_part


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

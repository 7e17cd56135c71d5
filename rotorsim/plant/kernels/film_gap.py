"""Film thickness at zero journal displacement, viscosity and slip, as modified by the effects.

This file is a template as `step` is.
"""

from __future__ import annotations

from reynolds.jit import inlined
from rotorsim.plant.kernels.films import film_part
from rotorsim.plant.kernels.stubs import FILM, RIG, film_constants, film_shape, gas_state, warmed_film


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
    uneven = F.uneven
    if RIG.n_heat > 0:
        grown, _ = warmed_film(f, w, P)
    for i in range(FILM.n_theta):
        height, slope = film_shape(f, t, angle, speed, i * (F.dy / F.radius), P)
        if RIG.n_heat > 0:
            height += grown
        total += height
        uneven = max(uneven, abs(height) + abs(slope))
        for j in range(FILM.half - 1, FILM.n_rows + 1):
            k = FILM.first + i * s + j
            v[FILM.clearance + k] = v[FILM.form + k] + height + slope * axial(F, j)
    start = FILM.clearance + FILM.first
    end = start + FILM.n_theta * s
    for j in range(FILM.half - 1, s + FILM.half - 1):
        v[start - s + j] = v[end - s + j]
        v[end + j] = v[start + j]
    w[RIG.clearance + f] = F.clearance + total / FILM.n_theta
    w[RIG.uneven + f] = uneven


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


@inlined
def smallest_gap(v):
    """Smallest thickness [m] of a film over all nodes, edges included; v: its part of the workspace."""
    low = 1e300
    for i in range(FILM.n_theta):
        line = FILM.h + FILM.first + i * FILM.stride
        for j in range(FILM.n_rows + 1):
            low = min(low, v[line + j])
    return low

"""Film thickness at zero journal displacement, viscosity and slip, as modified by the effects.

This file is a template as `step` is.
"""

from __future__ import annotations

from reynolds.jit import inlined
from rotorsim.plant.kernels.stubs import FILM, RIG, film_shape, gas_state


@inlined
def axial(F, row):
    """z [m] of a film row from the film's middle; the row after the last is the edge."""
    return row * F.dz if FILM.half == 1 else (row + 1 - 0.5 * (FILM.n_rows + 1)) * F.dz


@inlined
def shape_gap(w, P, t, angle, speed):
    """Write c + effects into the film's clearance, ghosts and edges too; keeps the mean."""
    F = P.film
    s = FILM.stride
    total = 0.0
    uneven = 0.0
    for i in range(FILM.n_theta):
        height, slope = film_shape(t, angle, speed, i * (F.dy / F.radius), P)
        gap = F.clearance + height
        total += height
        uneven = max(uneven, abs(height) + abs(slope))
        line = FILM.clearance + FILM.first + i * s
        for j in range(FILM.n_rows + 1):
            w[line + j] = gap + slope * axial(F, j)
        if FILM.half == 0:
            w[line - 1] = gap + slope * axial(F, -1)
    start = FILM.clearance + FILM.first
    end = start + FILM.n_theta * s
    for j in range(FILM.half - 1, s + FILM.half - 1):
        w[start - s + j] = w[end - s + j]
        w[end + j] = w[start + j]
    w[RIG.clearance] = F.clearance + total / FILM.n_theta
    w[RIG.uneven] = uneven


@inlined
def set_gas(w, P, t, speed):
    """Viscosity and slip of the film."""
    factor, path = gas_state(t, speed, P)
    w[FILM.mu] = P.film.mu * factor
    w[FILM.slip] = 6.0 * path * P.film.pa


@inlined
def smallest_gap(w):
    """Smallest film thickness [m] over all nodes, edges included."""
    low = 1e300
    for i in range(FILM.n_theta):
        line = FILM.h + FILM.first + i * FILM.stride
        for j in range(FILM.n_rows + 1):
            low = min(low, w[line + j])
    return low

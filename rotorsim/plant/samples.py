"""What is written of the plant at each sample, as columns of one table."""

from __future__ import annotations

import math

from reynolds.jit import inlined
from rotorsim.plant.rotor import project

COLUMNS = (
    "disc_x", "disc_y", "journal_x", "journal_y", "angle", "speed", "pressure", "film_force_x", "film_force_y",
    "h_min", "mass_flow", "contact",
)  # fmt: skip
"""Before the pins: [m], angle [rad], speed [rad/s], gauge pressure [Pa], force [N], h_min [m], flow [kg/s], 0/1."""


@inlined
def write_sample(w, P, FL, R, out, i):
    """Write the present state into row i of out (n, len(COLUMNS) + n_inj)."""
    out[i, 0], out[i, 1] = project(w, R, R.disc, R.q)
    out[i, 4] = w[R.angle] + 2.0 * math.pi * w[R.turns]
    out[i, 5] = w[R.speed]
    if R.has_film == 1:
        x, y = project(w, R, R.journal, R.q)
        out[i, 2], out[i, 3] = x, y
        out[i, 6] = w[R.supply] - P.film.pa
        out[i, 7], out[i, 8] = w[FL.force], w[FL.force + 1]
        out[i, 9] = P.film.clearance - math.sqrt(x * x + y * y)
        flow = 0.0
        for k in range(FL.n_inj):
            flow += w[FL.film_flow + k]
            out[i, 12 + k] = w[R.pin + k]
        out[i, 10] = flow
        out[i, 11] = w[R.touched]
        w[R.touched] = 0.0

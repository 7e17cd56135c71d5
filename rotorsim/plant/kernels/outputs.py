"""Output row of a sample: true values and sensor readings, as columns of one table.

This file is a template as `step` is.
"""

from __future__ import annotations

import math

from reynolds.jit import inlined
from rotorsim.plant.columns import COLUMNS, READ
from rotorsim.plant.kernels.film_gap import smallest_gap
from rotorsim.plant.kernels.modal_rotor import project
from rotorsim.plant.kernels.rig_layout import AROUND
from rotorsim.plant.kernels.stubs import FILM, RIG, ROTOR, foundation, sense


@inlined
def move_housing(w, P):
    """Motion around the shaft into w[RIG.around:]: the housing against the foundation, and the foundation."""
    for m in range(AROUND):
        w[RIG.around + m] = 0.0
    # the journal's rows hold the sleeve's displacement with the opposite sign
    for axis in range(2):
        for m in range(ROTOR.n_shaft, ROTOR.n):
            share = w[ROTOR.journal + axis * ROTOR.n + m]
            w[RIG.around + axis] -= share * w[ROTOR.q + m]
            w[RIG.around + 2 + axis] -= share * w[ROTOR.v + m]
            w[RIG.around + 4 + axis] -= share * w[ROTOR.a_old + m]
    x, y, vx, vy, ax, ay = foundation(w[ROTOR.time], P)
    w[RIG.around + 6], w[RIG.around + 7] = x, y
    w[RIG.around + 8], w[RIG.around + 9] = vx, vy
    w[RIG.around + 10], w[RIG.around + 11] = ax, ay


@inlined
def read_probes(w, P, out, i):
    """Readings of the probes into row i of out, behind the pins: a row of factors each, times the motion."""
    move_housing(w, P)
    for k in range(RIG.n_probe):
        row = RIG.probe + k * (ROTOR.n_shaft + AROUND)
        value = 0.0
        for m in range(ROTOR.n_shaft):
            value += w[row + m] * w[ROTOR.q + m]
        for m in range(AROUND):
            value += w[row + ROTOR.n_shaft + m] * w[RIG.around + m]
        out[i, len(COLUMNS) + FILM.n_inj + k] = value


@inlined
def write_sample(w, P, out, i):
    """Write the present state into row i of out (n, len(COLUMNS) + n_inj + n_probe) and read the sensors."""
    out[i, 0], out[i, 1] = project(w, ROTOR, ROTOR.disc, ROTOR.q)
    out[i, 4] = w[ROTOR.angle] + 2.0 * math.pi * w[ROTOR.turns]
    out[i, 5] = w[ROTOR.speed]
    if ROTOR.has_film == 1:
        x, y = project(w, ROTOR, ROTOR.journal, ROTOR.q)
        out[i, 2], out[i, 3] = x, y
        out[i, 6] = w[RIG.line] - P.film.pa
        out[i, 7], out[i, 8] = w[FILM.force], w[FILM.force + 1]
        uneven = RIG.n_film > 0 and w[RIG.uneven] > 0.0
        out[i, 9] = smallest_gap(w) if uneven else P.film.clearance - math.sqrt(x * x + y * y)
        flow = 0.0
        for k in range(FILM.n_inj):
            flow += w[FILM.film_flow + k]
            out[i, len(COLUMNS) + k] = w[RIG.pin + k]
        out[i, 10] = flow
        out[i, 11] = w[ROTOR.touched]
        w[ROTOR.touched] = 0.0
    if RIG.n_probe > 0:
        read_probes(w, P, out, i)
    for n in range(2):
        w[RIG.reading + n] = out[i, n]
    for n in range(3):
        w[RIG.reading + 2 + n] = out[i, 4 + n]
    sense(w, P)
    for n in range(5):
        out[i, READ + n] = w[RIG.reading + n]

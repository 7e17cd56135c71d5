"""Output row of a sample: true values and sensor readings, as columns of one table.

This file is a template as `step` is.
"""

from __future__ import annotations

import math

from reynolds.jit import inlined
from rotorsim.plant.kernels.columns import (
    AT_ANGLE,
    AT_CONTACT,
    AT_FLOW,
    AT_FORCE,
    AT_GAP,
    AT_JOURNAL,
    AT_PRESSURE,
    AT_SPEED,
    COLUMNS,
    FILM_COLUMNS,
    HEAT_COLUMNS,
    READ,
)
from rotorsim.plant.kernels.effect_calls import FILM, RIG, ROTOR, foundation, sense
from rotorsim.plant.kernels.film_gap import least_gap
from rotorsim.plant.kernels.films import film_part
from rotorsim.plant.kernels.modal_rotor import project
from rotorsim.plant.kernels.rig_layout import AROUND
from rotorsim.plant.kernels.supply import flow_of_film, flow_of_injectors


@inlined
def move_housing(w, P):
    """Motion around the shaft into w[RIG.around:]: the housing against the foundation, and the foundation."""
    for m in range(AROUND):
        w[RIG.around + m] = 0.0
    # the rows of the journal whose sleeve is supported hold the sleeve's displacement with the opposite sign
    for row in range(2 * ROTOR.n_films):
        axis = row % 2
        for m in range(ROTOR.n_machine, ROTOR.n):
            share = w[ROTOR.journal + row * ROTOR.n + m]
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
        n = ROTOR.n_machine
        row = RIG.probe + k * (3 * n + AROUND)
        value = 0.0
        for m in range(n):
            value += w[row + m] * w[ROTOR.q + m]
        for m in range(AROUND):
            value += w[row + 3 * n + m] * w[RIG.around + m]
        if ROTOR.n_housings > 0:
            for m in range(n):
                value += w[row + n + m] * w[ROTOR.v + m] + w[row + 2 * n + m] * w[ROTOR.a_old + m]
        out[i, len(COLUMNS) + RIG.n_pin + k] = value


@inlined
def gap_of(w, P, f):
    """Smallest thickness [m] of film f."""
    x, y = project(w, ROTOR, ROTOR.journal + 2 * ROTOR.n * f, ROTOR.q)
    return least_gap(w, P, f, x, y)


@inlined
def write_films(w, P, out, i):
    """Journal, force, gap and flow: of the first film and of all together, then of each of several films."""
    v = film_part(w, 0)
    out[i, AT_JOURNAL], out[i, AT_JOURNAL + 1] = project(w, ROTOR, ROTOR.journal, ROTOR.q)
    out[i, AT_PRESSURE] = w[RIG.line] - P.film_0.pa
    out[i, AT_FORCE], out[i, AT_FORCE + 1] = v[FILM.force], v[FILM.force + 1]
    low = gap_of(w, P, 0)
    column = len(COLUMNS) + RIG.n_pin + RIG.n_probe
    for f in range(ROTOR.n_films if ROTOR.n_films > 1 else 0):
        v = film_part(w, f)
        gap = gap_of(w, P, f)
        out[i, column], out[i, column + 1] = project(w, ROTOR, ROTOR.journal + 2 * ROTOR.n * f, ROTOR.q)
        out[i, column + 2], out[i, column + 3] = v[FILM.force], v[FILM.force + 1]
        out[i, column + 4] = gap
        out[i, column + 5] = flow_of_film(w, f, FILM.film_flow)
        low = min(low, gap)
        column += FILM_COLUMNS
    if RIG.n_heat > 0:
        for k in range(HEAT_COLUMNS * ROTOR.n_films):
            out[i, column + k] = w[RIG.heat + k]
    out[i, AT_GAP] = low
    out[i, AT_FLOW] = flow_of_injectors(w, FILM.film_flow)
    out[i, AT_CONTACT] = w[ROTOR.touched]
    w[ROTOR.touched] = 0.0


@inlined
def write_pins(w, P, out, i):
    """Pins behind the columns that all machines have."""
    column = len(COLUMNS)
    for k in range(RIG.n_inj):
        if P.pinned[k] > 0.0:
            out[i, column] = w[RIG.pin + k]
            column += 1


@inlined
def write_sample(w, P, out, i):
    """Write the present state into row i of `out` (see `columns`) and read the sensors."""
    out[i, 0], out[i, 1] = project(w, ROTOR, ROTOR.disc, ROTOR.q)
    out[i, AT_ANGLE] = w[ROTOR.angle] + 2.0 * math.pi * w[ROTOR.turns]
    out[i, AT_SPEED] = w[ROTOR.speed]
    if ROTOR.n_films > 0:
        write_films(w, P, out, i)
    if RIG.n_pin > 0:
        write_pins(w, P, out, i)
    if RIG.n_probe > 0:
        read_probes(w, P, out, i)
    for n in range(2):
        w[RIG.reading + n] = out[i, n]
    for n in range(3):
        w[RIG.reading + 2 + n] = out[i, AT_ANGLE + n]
    w[RIG.reading + 5] = 0.0
    sense(w, P)
    for n in range(5):
        out[i, READ + n] = w[RIG.reading + n]

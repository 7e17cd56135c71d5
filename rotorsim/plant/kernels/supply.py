"""Gas supply of the injectors: pins, effects on single injectors, supply line.

With ideal actuators pin k = bias + gain_x r_x + gain_y r_y [m] at once; a longer pin closes its seat. Where pin or
supply jump between samples, the plenum's rate at the start of the step is the one after the jump; where they move
smoothly (piezos), every stage takes them as they are at its end.

This file is a template as `step` is.
"""

from __future__ import annotations

from reynolds.injector import nozzle_table, pin_flow
from reynolds.jit import inlined
from rotorsim.plant.kernels.piezo import drive_piezos, pin_at
from rotorsim.plant.kernels.stubs import FILM, RIG, inject, plenum_factor, supply_line


@inlined
def throttle(w, k, conductance, supply):
    """Give an injector a new conductance and supply pressure at once, and its plenum the rate that goes with them."""
    plenum = w[FILM.plenum_old + k]
    table = nozzle_table(w, FILM.nozzle)
    before, _ = pin_flow(plenum, w[FILM.supply + k], w[FILM.pin_conductance + k], FILM.law, table)
    w[FILM.pin_conductance + k] = conductance
    w[FILM.supply + k] = supply
    after, _ = pin_flow(plenum, supply, conductance, FILM.law, table)
    w[FILM.plenum_rate + k] += (after - before) / w[FILM.capacity + k]


@inlined
def open_injector(w, P, k, t, supply, at_once):
    """Let injector k have the opening of its pin and `supply` [Pa, absolute]."""
    gap = max(P.seat_gap - w[RIG.pin + k], P.minimum_gap)
    opening, behind = inject(t, k, gap / P.seat_gap, supply, P)
    if FILM.law == 1 and P.loss_exponent != 1.0:
        opening = opening**P.loss_exponent
    conductance = P.open_conductance * opening
    if at_once:
        throttle(w, k, conductance, behind)
    else:
        w[FILM.pin_conductance + k] = conductance
        w[FILM.supply + k] = behind


@inlined
def set_plena(w, P):
    """Give every plenum its capacity V / (kappa R_g T)."""
    for k in range(FILM.n_inj):
        w[FILM.capacity + k] = P.capacity[k] * plenum_factor(k, P)


@inlined
def feed_sample(w, P, supply, ref_x, ref_y):
    """Start a sample: supply pressure [Pa, absolute] and references [V] are held, piezos and line move on."""
    flow = 0.0
    for k in range(FILM.n_inj):
        flow += w[FILM.pin_flow + k]
    before = w[RIG.line_end]
    w[RIG.line], w[RIG.line_end] = supply_line(w, P, P.sample, supply, flow)
    jumped = w[RIG.line] != before
    moved = ref_x != w[RIG.held_x] or ref_y != w[RIG.held_y]
    w[RIG.held_x], w[RIG.held_y] = ref_x, ref_y
    if RIG.driven == 0 and moved:
        for k in range(FILM.n_inj):
            w[RIG.pin + k] = P.pin_bias[k] + P.pin_x[k] * ref_x + P.pin_y[k] * ref_y
    if RIG.driven > 0:
        drive_piezos(w, P, ref_x, ref_y)
    if jumped or (RIG.driven == 0 and moved):
        for k in range(FILM.n_inj):
            open_injector(w, P, k, w[RIG.begin], w[RIG.line], True)


@inlined
def feed_stage(w, P, t):
    """Pins, seats and supply at time t [s] within the sample."""
    if RIG.driven > 0:
        for k in range(FILM.n_inj):
            w[RIG.pin + k] = pin_at(w, P, k, t)
    if RIG.driven > 0 or RIG.n_injector > 0 or RIG.n_supply > 0:
        supply = w[RIG.line]
        if RIG.n_supply > 0:
            supply += (w[RIG.line_end] - w[RIG.line]) * ((t - w[RIG.begin]) / P.sample)
        for k in range(FILM.n_inj):
            open_injector(w, P, k, t, supply, False)

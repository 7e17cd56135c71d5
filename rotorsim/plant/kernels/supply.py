"""Gas supply of the injectors of all films: pins, effects on single injectors, supply line.

An injector without a pin is an orifice that is always open. Injector j of film f has the number f n_inj + j.

With ideal actuators pin k = bias + gain_x r_x + gain_y r_y [m] at once; a longer pin closes its seat. Where pin or
supply jump between samples, the plenum's rate at the start of the step is the one after the jump; where they move
smoothly (piezos), every stage takes them as they are at its end.

This file is a template as `step` is.
"""

from __future__ import annotations

from reynolds.injector import nozzle_table, pin_flow
from reynolds.jit import inlined
from rotorsim.plant.kernels.effect_calls import FILM, RIG, ROTOR, inject, plenum_factor, supply_line
from rotorsim.plant.kernels.films import film_part
from rotorsim.plant.kernels.piezo import drive_piezos, pin_at


@inlined
def throttle(v, j, conductance, supply):
    """Give an injector a new conductance and supply pressure at once, and its plenum the rate that goes with them."""
    plenum = v[FILM.plenum_old + j]
    table = nozzle_table(v, FILM.nozzle)
    before, _ = pin_flow(plenum, v[FILM.supply + j], v[FILM.pin_conductance + j], FILM.law, table)
    v[FILM.pin_conductance + j] = conductance
    v[FILM.supply + j] = supply
    after, _ = pin_flow(plenum, supply, conductance, FILM.law, table)
    v[FILM.plenum_rate + j] += (after - before) / v[FILM.capacity + j]


@inlined
def open_injector(w, P, f, j, t, supply, at_once):
    """Let injector j of film f have the opening of its pin, all of it without a pin, and `supply` [Pa, absolute]."""
    v, k = film_part(w, f), f * FILM.n_inj + j
    opening = 1.0
    if P.pinned[k] > 0.0:
        opening = max(P.seat_gap[k] - w[RIG.pin + k], P.minimum_gap[k]) / P.seat_gap[k]
    opening, behind = inject(f, t, j, opening, supply, P)
    if FILM.law == 1 and P.loss_exponent[k] != 1.0:
        opening = opening ** P.loss_exponent[k]
    conductance = P.open_conductance[k] * opening
    if at_once:
        throttle(v, j, conductance, behind)
    else:
        v[FILM.pin_conductance + j] = conductance
        v[FILM.supply + j] = behind


@inlined
def is_there(P, f, j):
    """Whether film f has an injector j; all films have room for as many."""
    return RIG.n_inj == RIG.n_pin or P.open_conductance[f * FILM.n_inj + j] > 0.0


@inlined
def open_injectors(w, P, t, supply, at_once):
    """Open all injectors at time t [s] for `supply` [Pa, absolute]."""
    for f in range(ROTOR.n_films):
        for j in range(FILM.n_inj):
            if is_there(P, f, j):
                open_injector(w, P, f, j, t, supply, at_once)


@inlined
def set_plena(w, P):
    """Give every plenum its capacity V / (kappa R_g T)."""
    for f in range(ROTOR.n_films):
        for j in range(FILM.n_inj):
            if is_there(P, f, j):
                v = film_part(w, f)
                v[FILM.capacity + j] = P.capacity[f * FILM.n_inj + j] * plenum_factor(f, j, P)


@inlined
def flow_of_film(w, f, place):
    """Mass flow [kg/s] of the injectors of film f: FILM.pin_flow or FILM.film_flow."""
    v, flow = film_part(w, f), 0.0
    for j in range(FILM.n_inj):
        flow += v[place + j]
    return flow


@inlined
def flow_of_injectors(w, place):
    """Mass flow [kg/s] of all injectors: FILM.pin_flow or FILM.film_flow."""
    flow = 0.0
    for f in range(ROTOR.n_films):
        v = film_part(w, f)
        for j in range(FILM.n_inj):
            flow += v[place + j]
    return flow


@inlined
def feed_sample(w, P, supply, ref_x, ref_y):
    """Start a sample: supply pressure [Pa, absolute] and references [V] are held, piezos and line move on."""
    flow = flow_of_injectors(w, FILM.pin_flow)
    before = w[RIG.line_end]
    w[RIG.line], w[RIG.line_end] = supply_line(w, P, P.sample, supply, flow)
    jumped = w[RIG.line] != before
    moved = ref_x != w[RIG.held_x] or ref_y != w[RIG.held_y]
    w[RIG.held_x], w[RIG.held_y] = ref_x, ref_y
    if RIG.driven == 0 and moved:
        for k in range(RIG.n_inj):
            w[RIG.pin + k] = P.pin_bias[k] + P.pin_x[k] * ref_x + P.pin_y[k] * ref_y
    if RIG.driven > 0:
        drive_piezos(w, P, ref_x, ref_y)
    if jumped or (RIG.driven == 0 and moved):
        open_injectors(w, P, w[RIG.begin], w[RIG.line], True)


@inlined
def feed_stage(w, P, t):
    """Pins, seats and supply at time t [s] within the sample."""
    if RIG.driven > 0:
        for k in range(RIG.n_inj):
            if P.pinned[k] > 0.0:
                w[RIG.pin + k] = pin_at(w, P, k, t)
    if RIG.driven > 0 or RIG.n_injector > 0 or RIG.n_supply > 0:
        supply = w[RIG.line]
        if RIG.n_supply > 0:
            supply += (w[RIG.line_end] - w[RIG.line]) * ((t - w[RIG.begin]) / P.sample)
        open_injectors(w, P, t, supply, False)

r"""Four piezo actuators over one sample: decentralised PD law, amplifier, stack, pin.

Actuator i follows its reference r_i [V] (thesis eq. C.1: r0 + r_y, r0 + r_x, r0 - r_y, r0 - r_x) by the law C.23 on the
measured travel m_i / s (s: transducer, [m/V]), where m_i is the travel y_i unless the pin has a sensor of its own,

.. math:: u_i = P_i \frac{s + z_i}{s + p}\,(r_i - m_i/s), \quad
          \tau_a \dot v = \mathrm{sat}(u) - v, \quad d = D[v], \quad \tau_s \dot y = d - y,

u held between the amplifier's limits; D is the stack: its sensitivity and the machine's actuator effects (hysteresis,
creep, dead zone) in their order. In voltage mode u is the reference itself. The lags are exact for inputs linear over a
substep, the loop is closed by one prediction and one correction: second order in the substep. Pins between substeps are
cubic (Hermite), so the film sees a smooth pin whatever its own step is.

The reference at rest, r0, is the one that keeps each pin at its bias. There the stack has been demagnetised: an
alternating voltage has died away about the resting one.

This file is a template as `step` is.

Gas supply of the injectors of all films: pins, effects on single injectors, supply line.

An injector without a pin is an orifice that is always open. Injector j of film f has the number f n_inj + j.

With ideal actuators pin k = bias + gain_x r_x + gain_y r_y [m] at once; a longer pin closes its seat. Where pin or
supply jump between samples, the plenum's rate at the start of the step is the one after the jump; where they move
smoothly (piezos), every stage takes them as they are at its end.

This file is a template as `step` is.

Cites: thesis.
"""

from __future__ import annotations

import math

from reynolds.injector import nozzle_table, pin_flow
from reynolds.jit import inlined
from rotorsim.plant.kernels.effect_calls import (
    FILM,
    RIG,
    ROTOR,
    amplifier_factor,
    inject,
    pin_reading_noise,
    plenum_factor,
    references_of,
    see_pin,
    stroke,
    supply_line,
)
from rotorsim.plant.kernels.films import film_part

LONG = 1e9
"""A substep [s] after which creep has ended."""
ALTERNATIONS, DECAY = 80, 0.9
TABLE = 5


@inlined
def blend(h, lag):
    """Weights (of the old value, of the input at start and end) of a lag over h for an input linear in time."""
    if lag <= 0.0:
        return 0.0, 0.0, 1.0
    keep = math.exp(-h / lag)
    mean = (1.0 - keep) * lag / h
    return keep, mean - keep, 1.0 - mean


@inlined
def fill_table(w, P):
    """Weights of amplifier and stack for the substep; the PD filter's are the same for all."""
    h = P.sample / RIG.substeps
    for k in range(RIG.n_inj):
        t = RIG.table + TABLE * k
        w[t], w[t + 1], _ = blend(h, P.amplifier_lag[k] * amplifier_factor(P, k))
        w[t + 2], w[t + 3], _ = blend(h, P.stack_lag[k])
        w[t + 4] = math.exp(-h * P.pd_pole)


@inlined
def rested_stroke(w, P, k, volt):
    """Stroke [m] at `volt` after an alternating voltage about it has died away; leaves the states there."""
    swing = P.volt_high - P.volt_low
    n = RIG.n_stroke_states
    end = 0.0
    for i in range(ALTERNATIONS + 1):
        swing = -DECAY * swing if i < ALTERNATIONS else 0.0
        end = stroke(w, P, k, volt + swing, LONG)
        for s in range(n):
            w[RIG.old + k * n + s] = w[RIG.new + k * n + s]
    return end


@inlined
def resting_volt(w, P, k, travel):
    """Voltage [V] at which the stack rests at `travel` [m]; the middle of those where a dead zone makes them many."""
    total, several = 0.0, True
    low, high = P.volt_low, P.volt_high
    for side in range(2):
        if several:
            low, high = P.volt_low, P.volt_high
            several = False
            for _ in range(60):
                middle = 0.5 * (low + high)
                end = rested_stroke(w, P, k, middle)
                several = several or end == travel
                if end < travel or (side == 1 and end == travel):
                    low = middle
                else:
                    high = middle
        # where no voltage that was tried gives the travel, the other side finds the same one
        total += high
    return 0.5 * total


@inlined
def rest_sensor(w, P, k):
    """Bring the sensor of pin k to rest at the pin's position; returns its signal [m]."""
    pin = w[RIG.pin + k]
    signal = see_pin(w, P, k, LONG, pin, pin, pin)
    if RIG.n_pin_sensor > 0:
        w[RIG.seen + k] = signal
        w[RIG.read + k] = signal
    return signal


@inlined
def begin_readings(w):
    """Let the sensors' signals at the end of the last sample be those at the start of the next."""
    for k in range(RIG.n_inj):
        w[RIG.read + k] = w[RIG.seen + k]


@inlined
def read_pin(w, P, k):
    """Reading [m] of pin k at the start of the sample, of a perfect sensor also where the pin has just jumped."""
    pin = w[RIG.pin + k]
    return see_pin(w, P, k, 0.0, w[RIG.read + k], pin, pin) + pin_reading_noise(w, P, k)


@inlined
def rest_piezos(w, P):
    """Bring every actuator to rest with its pin at the bias; returns 0 if a bias is beyond the amplifier's limits."""
    within = 1
    for k in range(RIG.n_inj):
        if P.pinned[k] == 0.0:
            continue
        for s in range(RIG.n_stroke_states):
            w[RIG.old + k * RIG.n_stroke_states + s] = 0.0
        bias = P.pin_bias[k]
        if rested_stroke(w, P, k, P.volt_low) > bias or rested_stroke(w, P, k, P.volt_high) < bias:
            within = 0
        volt = resting_volt(w, P, k, bias)
        w[RIG.stroke + k] = rested_stroke(w, P, k, volt)
        w[RIG.volt + k] = volt
        w[RIG.travel + k] = w[RIG.stroke + k]
        w[RIG.pin + k] = w[RIG.stroke + k]
        error = volt * P.pd_pole / (P.pd_gain[k] * P.pd_zero[k]) if P.controlled > 0.0 else 0.0
        w[RIG.lead + k] = error / P.pd_pole
        signal = rest_sensor(w, P, k)
        w[RIG.rest + k] = error + signal / P.transducer if P.controlled > 0.0 else volt
        for node in range(RIG.substeps + 1):
            w[RIG.nodes + k * (RIG.substeps + 1) + node] = w[RIG.travel + k]
            w[RIG.rates + k * (RIG.substeps + 1) + node] = 0.0
    fill_table(w, P)
    return within


@inlined
def drive_piezo(w, P, k, reference):
    """Advance actuator k over a sample at a held reference [V] and keep the path of its pin."""
    h = P.sample / RIG.substeps
    inverse = 1.0 / P.transducer
    t = RIG.table + TABLE * k
    keep_v, start_v = w[t], w[t + 1]
    keep_y, start_y, keep_x = w[t + 2], w[t + 3], w[t + 4]
    end_v, end_y = 1.0 - keep_v - start_v, 1.0 - keep_y - start_y
    mean_x = (1.0 - keep_x) / (P.pd_pole * h)
    start_x, end_x = (mean_x - keep_x) / P.pd_pole, (1.0 - mean_x) / P.pd_pole
    gain, lead = P.pd_gain[k], P.pd_zero[k] - P.pd_pole
    per_lag = 1.0 / max(P.stack_lag[k], 1e-9)
    n = RIG.n_stroke_states
    path = k * (RIG.substeps + 1)
    v, d, x, y = w[RIG.volt + k], w[RIG.stroke + k], w[RIG.lead + k], w[RIG.travel + k]
    m = w[RIG.seen + k] if RIG.n_pin_sensor > 0 else y
    w[RIG.nodes + path] = y
    w[RIG.rates + path] = (d - y) * per_lag
    for node in range(1, RIG.substeps + 1):
        if P.controlled > 0.0:
            e = reference - m * inverse
            u = min(max(gain * (e + lead * x), P.volt_low), P.volt_high)
            v_end = keep_v * v + (1.0 - keep_v) * u
            d_end = stroke(w, P, k, v_end, h)
            y_end = keep_y * y + start_y * d + end_y * d_end
            e_end = reference - see_pin(w, P, k, h, m, y, y_end) * inverse
            x_end = keep_x * x + start_x * e + end_x * e_end
            u_end = min(max(gain * (e_end + lead * x_end), P.volt_low), P.volt_high)
            v = keep_v * v + start_v * u + end_v * u_end
        else:
            v = keep_v * v + (1.0 - keep_v) * min(max(reference, P.volt_low), P.volt_high)
        d_end = stroke(w, P, k, v, h)
        y_end = keep_y * y + start_y * d + end_y * d_end
        m_end = see_pin(w, P, k, h, m, y, y_end)
        if P.controlled > 0.0:
            x = keep_x * x + start_x * e + end_x * (reference - m_end * inverse)
        d, y, m = d_end, y_end, m_end
        for s in range(n):
            w[RIG.old + k * n + s] = w[RIG.new + k * n + s]
        w[RIG.nodes + path + node] = y
        w[RIG.rates + path + node] = (d - y) * per_lag
    w[RIG.volt + k], w[RIG.stroke + k], w[RIG.lead + k], w[RIG.travel + k] = v, d, x, y
    if RIG.n_pin_sensor > 0:
        w[RIG.seen + k] = m


@inlined
def drive_piezos(w, P, ref_x, ref_y):
    """Advance all actuators over the coming sample."""
    for k in range(RIG.n_inj):
        if P.pinned[k] > 0.0:
            x, y = references_of(w, P, k, ref_x, ref_y)
            drive_piezo(w, P, k, w[RIG.rest + k] + P.sign_x[k] * x + P.sign_y[k] * y)


@inlined
def move_pins(w, P, ref_x, ref_y):
    """Let ideal pins follow their references [V]; returns whether one of them has moved."""
    moved = False
    for k in range(RIG.n_inj):
        if P.pinned[k] > 0.0:
            x, y = references_of(w, P, k, ref_x, ref_y)
            pin = P.pin_bias[k] + P.pin_x[k] * x + P.pin_y[k] * y
            moved = moved or pin != w[RIG.pin + k]
            w[RIG.pin + k] = pin
    return moved


@inlined
def pin_at(w, P, k, t):
    """Position [m] of pin k at time t [s] of the present sample."""
    h = P.sample / RIG.substeps
    at = (t - w[RIG.begin]) / h
    node = min(max(int(at), 0), RIG.substeps - 1)
    s = at - node
    path = k * (RIG.substeps + 1) + node
    a, b = w[RIG.nodes + path], w[RIG.nodes + path + 1]
    da, db = w[RIG.rates + path] * h, w[RIG.rates + path + 1] * h
    # Hermite's cubic in differences: a pin at rest stays where it is to the last bit
    jump = b - a
    return a + s * (da + s * (3.0 * jump - 2.0 * da - db + s * (da + db - 2.0 * jump)))


@inlined
def throttle(v, j, conductance, supply):
    """Give an injector a new conductance and supply pressure at once, and its plenum the rate that goes with them."""
    plenum = v[FILM.plenum_old + j]
    table = nozzle_table(v, FILM.nozzle)
    before, _ = pin_flow(plenum, v[FILM.supply + j], v[FILM.pin_conductance + j], v[FILM.law], table)
    v[FILM.pin_conductance + j] = conductance
    v[FILM.supply + j] = supply
    after, _ = pin_flow(plenum, supply, conductance, v[FILM.law], table)
    v[FILM.plenum_rate + j] += (after - before) / v[FILM.capacity + j]


@inlined
def open_injector(w, P, f, j, t, supply, at_once):
    """Let injector j of film f have the opening of its pin, all of it without a pin, and `supply` [Pa, absolute]."""
    v, k = film_part(w, f), f * FILM.n_inj + j
    opening = 1.0
    if P.pinned[k] > 0.0:
        opening = max(P.seat_gap[k] - w[RIG.pin + k], P.minimum_gap[k]) / P.seat_gap[k]
    opening, behind = inject(f, t, j, opening, supply, P)
    if v[FILM.law] == 1.0 and P.loss_exponent[k] != 1.0:
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
    w[RIG.supply], w[RIG.held_x], w[RIG.held_y] = supply, ref_x, ref_y
    if RIG.n_pin_sensor > 0:
        begin_readings(w)
    if RIG.driven == 0 and (moved or RIG.n_reference > 0):
        moved = move_pins(w, P, ref_x, ref_y) or moved
    if RIG.driven == 0 and RIG.n_pin_sensor > 0:
        for k in range(RIG.n_inj):
            pin = w[RIG.pin + k]
            w[RIG.seen + k] = see_pin(w, P, k, P.sample, w[RIG.seen + k], pin, pin)
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

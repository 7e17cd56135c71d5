"""One sample: rest before the first, inputs at its start, true values and readings at its end.

This file is a template as `step` is.
"""

from __future__ import annotations

import math

from reynolds.jit import inlined, kernel
from reynolds.texture import friction_torque
from rotorsim.plant.kernels.effect_calls import (
    FILM,
    RIG,
    ROTOR,
    begin_forces,
    build_supports,
    draw_forces,
    driven_speed,
    film_constants,
    foundation,
    sense,
    shaft_torque,
    supply_line,
    warm,
)
from rotorsim.plant.kernels.films import film_part, least_gap, set_gas, shape_gap
from rotorsim.plant.kernels.injectors import (
    feed_sample,
    flow_of_film,
    flow_of_injectors,
    open_injectors,
    read_pin,
    rest_piezos,
    rest_sensor,
    set_plena,
)
from rotorsim.plant.kernels.layout import (
    AROUND,
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
from rotorsim.plant.kernels.modal_rotor import add_force, project


@kernel
def prepare(w, P, speed, supply, flow):
    """Everything but film and rotor at rest at angle 0, for a speed [rad/s] and a supply [Pa, absolute].

    `flow` [kg/s] is what the supply line carries. Returns 0 if an actuator cannot hold its pin at the bias.
    """
    build_supports(w, P)
    w[ROTOR.speed] = speed
    w[RIG.command] = speed
    within = 1
    if ROTOR.n_films > 0:
        set_plena(w, P)
        for f in range(ROTOR.n_films):
            set_gas(w, P, f, 0.0, speed)
            shape_gap(w, P, f, 0.0, 0.0, speed)
        for s in range(RIG.n_states):
            w[RIG.states + s] = 0.0
        _, w[RIG.line] = supply_line(w, P, 1e9, supply, flow)
        w[RIG.line_end] = w[RIG.line]
        w[RIG.supply] = supply
        if RIG.driven > 0:
            within = rest_piezos(w, P)
        else:
            for k in range(RIG.n_inj):
                w[RIG.pin + k] = P.pin_bias[k]
                rest_sensor(w, P, k)
        open_injectors(w, P, 0.0, w[RIG.line], False)
    return within


@inlined
def warm_films(w, P, rate):
    """Move the films' temperatures on by a sample of 1/rate [s], to rest for rate 0; returns the largest change [K]."""
    change = 0.0
    for f in range(ROTOR.n_films):
        v, at = film_part(w, f), RIG.heat + 3 * f
        gas, journal, sleeve = w[at], w[at + 1], w[at + 2]
        power = friction_torque(v, film_constants(P, f), FILM, w[ROTOR.speed]) * w[ROTOR.speed]
        warm(f, w, P, rate, power, flow_of_film(w, f, FILM.film_flow))
        change = max(change, abs(w[at] - gas), abs(w[at + 1] - journal), abs(w[at + 2] - sleeve))
    return change


@inlined
def outer_torque(w, P):
    """Torque [N m] on the shaft besides those of drive, films and drag: rub and contact as in the last sample."""
    torque = shaft_torque(w[ROTOR.time], w[ROTOR.angle], w[ROTOR.speed], P)
    if RIG.n_braking > 0:
        torque += w[RIG.impulse] / P.sample
        w[RIG.impulse] = 0.0
    return torque


@inlined
def beyond(torque, held):
    """Part of a torque [N m] that friction which can hold `held` [N m] leaves."""
    return math.copysign(max(abs(torque) - held, 0.0), torque)


@inlined
def coasting(w, P):
    """Acceleration [rad/s2] of the shaft under a constant torque, film friction and the drag of the other bearings.

    Drag opposes the motion and stops it but does not turn it round; dry drag holds a shaft at rest up to its own size.
    """
    speed = w[ROTOR.speed]
    sense = 0.0 if speed == 0.0 else math.copysign(1.0, speed)
    driving = outer_torque(w, P) + P.drive_torque
    torque = driving - P.viscous_drag * speed - sense * P.dry_drag
    for f in range(ROTOR.n_films):
        torque -= friction_torque(film_part(w, f), film_constants(P, f), FILM, speed)
    if sense == 0.0:
        return beyond(torque, P.dry_drag) / P.inertia
    if sense * (speed + torque / P.inertia * P.sample) > 0.0:
        return torque / P.inertia
    stopping = -speed / P.sample
    return stopping + beyond(driving - P.inertia * stopping, abs(driving - torque)) / P.inertia


@inlined
def drive(w, P, end_speed):
    """Acceleration over the coming sample: the drive holds a speed about which torques ripple, or is off (NaN)."""
    if end_speed != end_speed:
        w[ROTOR.acceleration] = coasting(w, P)
        w[RIG.command] = w[ROTOR.speed] + w[ROTOR.acceleration] * P.sample
        w[RIG.ripple] = 0.0
    else:
        torque = outer_torque(w, P)
        w[RIG.ripple] += P.sample * (torque / P.inertia - w[RIG.ripple] / P.drive_time)
        w[RIG.command] = end_speed
        w[ROTOR.acceleration] = (driven_speed(w, P, end_speed) + w[RIG.ripple] - w[ROTOR.speed]) / P.sample


@kernel
def set_inputs(w, P, end_speed, supply, ref_x, ref_y, fx, fy):
    """Hold the inputs of the coming sample; the speed reaches `end_speed` [rad/s] at its end, NaN: drive off."""
    w[RIG.begin] = w[ROTOR.time]
    drive(w, P, end_speed)
    draw_forces(w, P, w[ROTOR.speed])
    begin_forces(w, P)
    # a force that jumps: the rates at the start of the sample are those after the jump
    jump_x, jump_y = fx - w[ROTOR.disc_fx], fy - w[ROTOR.disc_fy]
    if jump_x != 0.0 or jump_y != 0.0:
        add_force(w, ROTOR, ROTOR.struck, jump_x, jump_y, ROTOR.a_old)
        w[ROTOR.disc_fx] = fx
        w[ROTOR.disc_fy] = fy
    if ROTOR.n_films > 0:
        if RIG.n_heat > 0:
            warm_films(w, P, 1.0 / P.sample)
        for f in range(ROTOR.n_films):
            if RIG.n_gas > 0:
                set_gas(w, P, f, w[ROTOR.time], w[ROTOR.speed])
        feed_sample(w, P, supply, ref_x, ref_y)


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
        out[i, len(COLUMNS) + RIG.n_pin_columns + k] = value


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
    column = len(COLUMNS) + RIG.n_pin_columns + RIG.n_probe
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
    """Pins, and behind them their readings, behind the columns that all machines have."""
    column = len(COLUMNS)
    for k in range(RIG.n_inj):
        if P.pinned[k] > 0.0:
            out[i, column] = w[RIG.pin + k]
            if RIG.n_pin_sensor > 0:
                out[i, column + RIG.n_pin] = read_pin(w, P, k)
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

"""Entry points of a composed module: initialisation at rest and the loop over samples.

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
    build_supports,
    film_constants,
    shaft_torque,
    supply_line,
    warm,
)
from rotorsim.plant.kernels.film_gap import set_gas, shape_gap
from rotorsim.plant.kernels.films import film_part
from rotorsim.plant.kernels.modal_rotor import add_force
from rotorsim.plant.kernels.outputs import write_sample
from rotorsim.plant.kernels.piezo import rest_piezos
from rotorsim.plant.kernels.step import step
from rotorsim.plant.kernels.supply import feed_sample, flow_of_film, open_injectors, set_plena


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
        for s in range(RIG.size - RIG.states):
            w[RIG.states + s] = 0.0
        _, w[RIG.line] = supply_line(w, P, 1e9, supply, flow)
        w[RIG.line_end] = w[RIG.line]
        if RIG.driven > 0:
            within = rest_piezos(w, P)
        else:
            for k in range(RIG.n_inj):
                w[RIG.pin + k] = P.pin_bias[k]
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
        w[ROTOR.acceleration] = (end_speed + w[RIG.ripple] - w[ROTOR.speed]) / P.sample


@kernel
def set_inputs(w, P, end_speed, supply, ref_x, ref_y, fx, fy):
    """Hold the inputs of the coming sample; the speed reaches `end_speed` [rad/s] at its end, NaN: drive off."""
    w[RIG.begin] = w[ROTOR.time]
    drive(w, P, end_speed)
    # a force that jumps: the rates at the start of the sample are those after the jump
    jump_x, jump_y = fx - w[ROTOR.disc_fx], fy - w[ROTOR.disc_fy]
    if jump_x != 0.0 or jump_y != 0.0:
        add_force(w, ROTOR, ROTOR.disc, jump_x, jump_y, ROTOR.a_old)
        w[ROTOR.disc_fx] = fx
        w[ROTOR.disc_fy] = fy
    if ROTOR.n_films > 0:
        if RIG.n_heat > 0:
            warm_films(w, P, 1.0 / P.sample)
        for f in range(ROTOR.n_films):
            if RIG.n_gas > 0:
                set_gas(w, P, f, w[ROTOR.time], w[ROTOR.speed])
        feed_sample(w, P, supply, ref_x, ref_y)


@kernel
def run(w, ix, P, inputs, out, steps_per_sample):
    """Advance by one sample for each row of `inputs`; out gets the state BEFORE each. Returns samples done.

    inputs (n, 6): speed at the sample's end [rad/s], supply pressure [Pa, absolute], reference x, y [V], disc force
    x, y [N].
    """
    for i in range(inputs.shape[0]):
        set_inputs(w, P, inputs[i, 0], inputs[i, 1], inputs[i, 2], inputs[i, 3], inputs[i, 4], inputs[i, 5])
        write_sample(w, P, out, i)
        w[RIG.tick] += 1.0
        for _ in range(steps_per_sample):
            if step(w, ix, P) < 0:
                return i
    return inputs.shape[0]

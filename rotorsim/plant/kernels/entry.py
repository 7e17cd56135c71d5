"""Entry points of a composed module: the loop over samples, and the one of code that runs outside Python.

This file is a template as `step` is.
"""

from __future__ import annotations

from reynolds.jit import inlined, kernel
from reynolds.newton import NOT_CONVERGED
from reynolds.texture import friction_torque
from rotorsim.plant.kernels.effect_calls import (
    FILM,
    RIG,
    ROTOR,
    film_constants,
)
from rotorsim.plant.kernels.equilibrium_kernel import settle
from rotorsim.plant.kernels.films import film_part
from rotorsim.plant.kernels.injectors import begin_readings
from rotorsim.plant.kernels.layout import (
    COLUMNS,
    FILM_COLUMNS,
    HEAT_COLUMNS,
)
from rotorsim.plant.kernels.sample import set_inputs, write_sample
from rotorsim.plant.kernels.step import step

SETTLE, ADVANCE, LOOK = 0, 1, 2
"""Tasks of `serve`."""


@inlined
def columns_of_samples(P):
    """Columns of the sample table."""
    columns = len(COLUMNS) + RIG.n_pin_columns + RIG.n_probe
    columns += FILM_COLUMNS * (ROTOR.n_films if ROTOR.n_films > 1 else 0)
    return columns + HEAT_COLUMNS * (ROTOR.n_films if RIG.n_heat > 0 else 0)


@inlined
def film_friction(w, P):
    """Friction torque [N m] of all films."""
    torque = 0.0
    for f in range(ROTOR.n_films):
        torque += friction_torque(film_part(w, f), film_constants(P, f), FILM, w[ROTOR.speed])
    return torque


@kernel
def run(w, ix, P, inputs, out, steps_per_sample):
    """Advance by one sample for each row of `inputs`; out gets the state BEFORE each. Returns samples done.

    A column more than the sample table has gets the torque [N m] with which the films brake the shaft then, and rub and
    contact in the mean over the sample before.

    inputs (n, 6): speed at the sample's end [rad/s], supply pressure [Pa, absolute], reference x, y [V], disc force
    x, y [N].
    """
    for i in range(inputs.shape[0]):
        braking = -w[RIG.impulse] / P.sample
        set_inputs(w, P, inputs[i, 0], inputs[i, 1], inputs[i, 2], inputs[i, 3], inputs[i, 4], inputs[i, 5])
        write_sample(w, P, out, i)
        if ROTOR.n_films > 0 and out.shape[1] > columns_of_samples(P):
            out[i, out.shape[1] - 1] = braking + film_friction(w, P)
        w[RIG.tick] += 1.0
        for _ in range(steps_per_sample):
            if step(w, ix, P) < 0:
                return i
    return inputs.shape[0]


@inlined
def observe(w, P, out):
    """Row 0 of `out`: the columns of a record, then friction torque [N m] and pin travel along x and y [m]."""
    w[RIG.line] = w[RIG.line_end]
    if RIG.n_pin_sensor > 0:
        begin_readings(w)
    write_sample(w, P, out, 0)
    extra = columns_of_samples(P)
    out[0, extra + 1] = out[0, extra + 2] = 0.0
    out[0, extra] = film_friction(w, P)
    for k in range(RIG.n_inj):
        out[0, extra + 1] += P.sign_x[k] * w[RIG.pin + k]
        out[0, extra + 2] += P.sign_y[k] * w[RIG.pin + k]


@inlined
def advance(w, ix, P, u, steps):
    """Hold the inputs u over one sample of so many steps; returns 1 or NOT_CONVERGED."""
    set_inputs(w, P, u[0], u[1], u[2], u[3], u[4], u[5])
    w[RIG.tick] += 1.0
    for _ in range(steps):
        if step(w, ix, P) < 0:
            return NOT_CONVERGED
    return 1


@kernel
def serve(task, w, initial, ix, P, u, out, steps):
    """Do a task on the workspace; u (6): a row of inputs as `run` takes them, out (1, columns + 3); returns a status.

    SETTLE brings the machine to rest at the speed and supply in u, ADVANCE runs one sample, LOOK reads the present
    state (and its sensors, which count one sample for it).
    """
    status = 1
    if task == SETTLE:
        status = settle(w, initial, ix, P, u[0], u[1], False)
    elif task == ADVANCE:
        status = advance(w, ix, P, u, steps)
    if status > 0 and task != SETTLE:
        observe(w, P, out)
    return status

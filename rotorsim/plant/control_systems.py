"""Controllers and plants as systems of the package `control`, one sample a step.

A system sees the displacement from `centre`, the equilibrium, as a linear model does; a function or an object with a
`step` sees the measured displacement as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.errors import ControllerError, DataError
from rotorsim.base.exchange.control_systems import (
    DISC,
    REFERENCES,
    channel_order,
    check_channels,
    check_period,
    check_runs,
    control_package,
    is_control_system,
    is_linear,
    matrices,
    period,
)
from rotorsim.plant.controller import STEP, Controller, check_controller
from rotorsim.plant.kernels import columns
from rotorsim.plant.simulation import Simulation

MEASURED = DISC
SCHEDULED = (*MEASURED, "speed", "pressure")
INPUTS = ("speed", "supply_pressure", *REFERENCES, "disc_force_x", "disc_force_y")
"""Inputs of the plant as a system: shaft speed at a sample's end [rad/s], gauge pressure [Pa], V, N."""


RESPONSE = "control.input_output_response(system, T, U, system.initial)"
"""How the plant as a system is run from its equilibrium."""


class SystemController:
    """A sampled system of the package `control` as a controller: disc x, y [m] in, references x, y [V] out.

    One with four inputs is also given speed [rad/s] and gauge pressure [Pa]. Labels that are the names of these
    channels in another order are followed.
    """

    def __init__(self, system: Any, centre: ArrayLike = (0.0, 0.0), Ts: float | None = None) -> None:
        self.name = str(getattr(system, "name", None) or type(system).__name__)
        what = f"controller {self.name}"
        self.scheduled = system.ninputs == len(SCHEDULED)
        seen = SCHEDULED if self.scheduled else MEASURED
        try:
            check_channels(system, what, seen, REFERENCES)
            check_runs(system, what)
            self.matrices = matrices(system) if is_linear(system) else None
            self.order = int(system.nstates or 0) if self.matrices is None else len(self.matrices.A)
            self.Ts = (period(system) or RIG_SAMPLE) if Ts is None else Ts
            check_period(system, what, self.Ts, self.order)
        except ControllerError:
            raise
        except DataError as error:
            raise ControllerError(str(error)) from error
        self.inputs = channel_order(system.input_labels, seen)
        self.outputs = channel_order(system.output_labels, REFERENCES)
        self.system = system
        self.centre = np.array(centre, float)
        self.reset()

    def reset(self) -> None:
        """States at zero, time at zero."""
        self.state, self.time = np.zeros(self.order), 0.0

    def step(self, measured: np.ndarray, speed: float, pressure: float) -> np.ndarray:
        """Reference (2,) [V] from the measured disc (2,) [m], speed [rad/s] and gauge pressure [Pa]."""
        u = np.asarray(measured, float) - self.centre
        if self.scheduled:
            u = np.append(u, (speed, pressure))
        u[self.inputs] = u.copy()
        m = self.matrices
        if m is not None:
            y = m.C @ self.state + m.D @ u
            self.state = m.A @ self.state + m.B @ u
            return np.asarray(y)[self.outputs]
        y = np.asarray(self.system.output(self.time, self.state, u), float)
        if len(self.state):
            self.state = np.asarray(self.system.dynamics(self.time, self.state, u), float)
        self.time += self.Ts
        return y[self.outputs] if y.shape == (2,) else y

    def attrs(self) -> dict[str, Any]:
        """Name and order for a record's attributes."""
        return {"controller": type(self.system).__name__, "law": self.name, "law_order": len(self.state)}


class FunctionController:
    """A function of (measured, speed, pressure) as a controller."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.name, self.step = str(getattr(function, "__name__", type(function).__name__)), function

    def attrs(self) -> dict[str, Any]:
        """Name of the function for a record's attributes."""
        return {"controller": "function", "law": self.name}


def as_controller(given: Any, centre: Callable[[], ArrayLike], Ts: float | None = None) -> Controller:
    """What can be asked for references: an object with a `step`, a sampled system of `control`, or a function.

    `centre` gives the equilibrium (2,) [m] that a system's displacements are counted from, `Ts` [s] the sampling time
    that a system must have; any where it is not given. Raises ControllerError.
    """
    if is_control_system(given):
        return SystemController(given, centre(), Ts)
    if is_function(given):
        return FunctionController(given)
    check_controller(given)
    controller: Controller = given
    return controller


def is_function(given: Any) -> bool:
    """Whether a value without a `step` can be called; raises ControllerError where it takes other arguments."""
    if isinstance(given, type) or hasattr(given, "step") or not callable(given):
        return False
    try:
        signature(given).bind(None, None, None)
    except ValueError:  # compiled code may have none
        return True
    except TypeError as error:
        name = getattr(given, "__name__", type(given).__name__)
        raise ControllerError(
            f"controller {name}: a function must be f(measured, speed, pressure), two voltages [V] from what an object "
            f"gets in {STEP}; {error}"
        ) from error
    return True


def check_any_controller(given: Any) -> None:
    """Raise ControllerError for what `as_controller` takes no controller from."""
    as_controller(given, lambda: (0.0, 0.0))


def plant_system(simulation: Simulation) -> Any:
    """A simulation as control.NonlinearIOSystem, sampled as its machine is.

    Its states are the plant's whole flat vector; `initial` has those of now. Raises DataError for states of zero,
    which the package takes where it is given none.
    """
    control = control_package()
    start, name = simulation.save(), simulation.assembly.machine.name
    kept: dict[str, Any] = {"x": None}

    def advanced(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Disc (2,) before and states after a sample."""
        if start.any() and not np.any(x):
            raise DataError(f"{name}: starts from states of zero; give {RESPONSE}")
        if kept["x"] is None or not (np.array_equal(kept["x"], x) and np.array_equal(kept["u"], u)):
            simulation.restore(x)
            table = simulation.advance(np.asarray(u, float)[None])
            kept.update(x=np.array(x), u=np.array(u), disc=table[0, columns.DISC], after=simulation.save())
        return kept["disc"], kept["after"]

    system = control.NonlinearIOSystem(
        lambda t, x, u, params: advanced(x, u)[1],
        lambda t, x, u, params: advanced(x, u)[0],
        inputs=list(INPUTS), outputs=list(MEASURED), states=len(start), dt=simulation.assembly.sampling_time,
        name=name,
    )  # fmt: skip
    system.initial = start
    return system

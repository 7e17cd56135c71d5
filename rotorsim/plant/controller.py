"""Controllers of a plant: their protocol, checks of the references that they return, systems of `control`.

A controller is an object with a `step`, a function, or a sampled system of the package `control`; the plant itself can
be such a system. A system sees the displacement from `centre`, the equilibrium, as a linear model does; a function or
an object with a `step` sees the measured displacement as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rotorsim.base import foreign_systems as foreign
from rotorsim.base.errors import ControllerError, DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.machine.schema import Machine
from rotorsim.plant.kernels import layout
from rotorsim.plant.simulation import Simulation


class Controller(Protocol):
    """Anything that makes a reference [V] from a measurement [m]; called once per sample.

    A method `reset()`, where it has one, is called before a run from an equilibrium, and `check_sampling(Ts)`
    before every run: it may refuse the machine's sampling time [s]. `check_machine(name)` may warn of the machine.
    `applied(reference)`, before every step, gives it the reference [V] that acts, which is not its own where one is
    added to it. One whose attribute `runout` is not None is given the shaft angle [rad] as a fourth value.

    Examples
    --------
    >>> class Damper:
    ...     def step(self, measured, speed, pressure):
    ...         return 1e5 * measured
    >>> plant.simulate(0.02, speed=300.0, pressure=0.5e6, controller=Damper()).sizes["time"]
    100
    """

    def step(self, measured: np.ndarray, speed: float, pressure: float) -> ArrayLike:
        """Reference (2,) [V] that acts from the next sample on."""


STEP = "step(measured, speed, pressure)"
"""Required method of a controller."""


def check_controller(controller: Any) -> None:
    """Raise ControllerError for an object without a method that takes measured (2,) [m], speed and pressure."""
    step = getattr(controller, "step", None)
    if isinstance(controller, type) or not callable(step):
        what = "is a class" if isinstance(controller, type) else "has no such method"
        raise ControllerError(
            f"controller = {_short(controller)}: {what}; give an object with a method {STEP} that returns two "
            "voltages [V], e.g. rotorsim.experiments.ProportionalLaw()"
        )
    try:
        signature(step).bind(None, None, None)
    except ValueError:  # compiled code may have none
        return
    except TypeError as error:
        raise ControllerError(f"controller {name_of(controller)}: its step must be {STEP}; {error}") from error


def prepare(controller: Controller, machine: Machine, continued: bool = False) -> None:
    """Check a controller for a run, and reset it unless the run is continued.

    Raises ControllerError for a machine without injector pins, or with another sampling time than the controller's.
    """
    check_actuators(machine, name_of(controller))
    call(controller, "check_sampling", machine.sampling_time)
    call(controller, "check_machine", machine.name)
    if not continued:
        call(controller, "reset")


def check_actuators(machine: Machine, name: str) -> None:
    """Raise ControllerError for a machine without injector pins, which a controller of that name could not drive."""
    if not machine.injectors:
        raise ControllerError(
            f"{machine.name}: has no actuators that controller {name} could drive; leave the controller out or take "
            "a machine with [[injectors]]",
            argument="controller",
            value=name,
        )


def call(controller: Controller, method: str, *given: Any) -> None:
    """Call a method of a controller where it has one."""
    found = getattr(controller, method, None)
    if callable(found):
        found(*given)


def alarms_of(controller: Any) -> dict[str, str]:
    """Attribute `controller_alarms` of a record: bad samples that the controller had, as a sentence; none without."""
    past = getattr(controller, "past_alarms", "")
    return {"controller_alarms": past} if past and isinstance(past, str) else {}


def ask(
    controller: Controller, measured: np.ndarray, speed: float, pressure: float, angle: float, time: float,
    acting: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Reference (2,) [V] for the disc (2,) [m], speed [rad/s], gauge pressure [Pa] and angle [rad] measured.

    At `time` [s] the reference `acting` (2,) [V] acts. Only a controller with a `runout` table is given the angle.
    Raises ControllerError for anything but two finite numbers.
    """
    call(controller, "applied", acting)
    turning = () if getattr(controller, "runout", None) is None else (float(angle),)
    given: Any = controller.step(np.array(measured, float), float(speed), float(pressure), *turning)
    try:
        reference = np.asarray(given, float)
    except (TypeError, ValueError):
        reference = np.zeros(0)
    if reference.shape == (2,) and np.all(np.isfinite(reference)):
        return reference
    seen = ", ".join(f"{value:.4g}" for value in (*measured, speed, pressure))
    raise ControllerError(
        f"controller {name_of(controller)}: gave {_short(given)} at t = {time:.4f} s for measured x, y [m], speed "
        f"[rad/s], pressure [Pa] = {seen}; its step must return two finite voltages [V], check it there",
        argument="controller",
        value=given,
    )


def check_range(controller: Controller, reference: np.ndarray, limit: float, time: float) -> None:
    """Raise ControllerError if the references (2,) [V], external ones included, pass the range of the actuators."""
    largest = float(np.abs(reference).max())
    if largest > limit * (1 + 1e-12):
        raise ControllerError(
            f"controller {name_of(controller)}: drives the reference to {largest:.4g} V at t = {time:.4f} s, the "
            f"actuators take {limit:g} V; limit what its step returns, or run it with experiments.controlled, which "
            "limits the sum",
            argument="controller",
            value=largest,
        )


def name_of(controller: Any) -> str:
    """The name of a law, or the class of any other controller."""
    name = getattr(controller, "name", None)
    return name if isinstance(name, str) and name else type(controller).__name__


def provenance(controller: Any) -> dict[str, Any]:
    """Attributes of a record that was made with a controller: its class and its own attributes."""
    about = getattr(controller, "attrs", None)
    return {"controller": type(controller).__name__} | (about() if callable(about) else {})


def _short(given: Any) -> str:
    return " ".join(repr(given).split())[:60]


MEASURED = foreign.DISC
SCHEDULED = (*MEASURED, "speed", "pressure")
INPUTS = ("speed", "supply_pressure", *foreign.REFERENCES, "disc_force_x", "disc_force_y")
"""Inputs of the plant as a system: shaft speed at a sample's end [rad/s], gauge pressure [Pa], V, N."""


RESPONSE = "control.input_output_response(system, T, U, system.initial)"
"""Call that runs the plant as a system from its equilibrium."""


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
            foreign.check_channels(system, what, seen, foreign.REFERENCES)
            foreign.check_runs(system, what)
            self.matrices = foreign.matrices(system) if foreign.is_linear(system) else None
            self.order = int(system.nstates or 0) if self.matrices is None else len(self.matrices.A)
            self.Ts = (foreign.period(system) or RIG_SAMPLE) if Ts is None else Ts
            foreign.check_period(system, what, self.Ts, self.order)
        except ControllerError:
            raise
        except DataError as error:
            raise ControllerError(str(error)) from error
        self.inputs = foreign.channel_order(system.input_labels, seen)
        self.outputs = foreign.channel_order(system.output_labels, foreign.REFERENCES)
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
    """A controller: an object with a `step`, a sampled system of `control`, or a function.

    `centre` gives the equilibrium (2,) [m] that a system's displacements are counted from, `Ts` [s] the sampling time
    that a system must have; any where it is not given. Raises ControllerError.
    """
    if foreign.is_control_system(given):
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
    control = foreign.control_package()
    start, name = simulation.w.copy(), simulation.assembly.machine.name
    kept: dict[str, Any] = {"x": None}

    def advanced(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Disc (2,) before and states after a sample."""
        if start.any() and not np.any(x):
            raise DataError(f"{name}: starts from states of zero; give {RESPONSE}")
        if kept["x"] is None or not (np.array_equal(kept["x"], x) and np.array_equal(kept["u"], u)):
            simulation.restore(x)
            table = simulation.advance(np.asarray(u, float)[None])
            kept.update(x=np.array(x), u=np.array(u), disc=table[0, layout.DISC], after=simulation.w.copy())
        return kept["disc"], kept["after"]

    system = control.NonlinearIOSystem(
        lambda t, x, u, params: advanced(x, u)[1],
        lambda t, x, u, params: advanced(x, u)[0],
        inputs=list(INPUTS), outputs=list(MEASURED), states=len(start), dt=simulation.assembly.sampling_time,
        name=name,
    )  # fmt: skip
    system.initial = start
    return system

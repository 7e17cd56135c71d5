"""Controller protocol of a plant, and checks of the references that a controller returns."""

from __future__ import annotations

from inspect import signature
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rotorsim.base.errors import ControllerError
from rotorsim.machine.schema import Machine


class Controller(Protocol):
    """Anything that makes a reference [V] from a measurement [m]; called once per sample.

    A method `reset()`, where it has one, is called before a run from an equilibrium, and `check_sampling(Ts)`
    before every run: it may refuse the machine's sampling time [s]. `check_machine(name)` may warn of the machine.
    `applied(reference)`, before every step, gives it the reference [V] that acts, which is not its own where one is
    added to it.

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

    Raises
    ------
    ControllerError
        For a machine without injector pins, or with another sampling time than the controller's.
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
            "a machine with [[injectors]]"
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
    controller: Controller, measured: np.ndarray, speed: float, pressure: float, time: float, acting: np.ndarray
) -> np.ndarray:
    """Reference (2,) [V] of a controller for what was measured at `time` [s], while a reference `acting` (2,) [V] acts.

    Parameters
    ----------
    controller : object
        With a method ``step(measured, speed, pressure)``.
    measured : array (2,)
        Measured disc [m].
    speed, pressure : float
        Measured speed [rad/s] and gauge pressure [Pa].

    Raises
    ------
    ControllerError
        If it gives anything but two finite numbers.
    """
    call(controller, "applied", acting)
    given: Any = controller.step(np.array(measured, float), float(speed), float(pressure))
    try:
        reference = np.asarray(given, float)
    except (TypeError, ValueError):
        reference = np.zeros(0)
    if reference.shape == (2,) and np.all(np.isfinite(reference)):
        return reference
    seen = ", ".join(f"{value:.4g}" for value in (*measured, speed, pressure))
    raise ControllerError(
        f"controller {name_of(controller)}: gave {_short(given)} at t = {time:.4f} s for measured x, y [m], speed "
        f"[rad/s], pressure [Pa] = {seen}; its step must return two finite voltages [V], check it there"
    )


def check_range(controller: Controller, reference: np.ndarray, limit: float, time: float) -> None:
    """Raise ControllerError if the references (2,) [V], external ones included, pass the range of the actuators."""
    largest = float(np.abs(reference).max())
    if largest > limit * (1 + 1e-12):
        raise ControllerError(
            f"controller {name_of(controller)}: drives the reference to {largest:.4g} V at t = {time:.4f} s, the "
            f"actuators take {limit:g} V; limit what its step returns, or run it with experiments.controlled, which "
            "limits the sum"
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

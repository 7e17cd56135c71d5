"""What a physical effect is: a frozen dataclass of parameters, a port, one kernel.

An effect file holds the equation and its source, a dataclass whose fields are made by `param`
(unit, bounds, NEUTRAL default, a sentence) and one kernel of its port's signature:

``force``    ``(t, angle, speed, acceleration, p) -> (fx, fy)``  force [N] on the shaft at the effect's
             `position`, at time t [s]; with ``influence = "mass"`` the pair is an acceleration [m/s^2] of the
             whole shaft. `angle` [rad] stays within one turn, so only whole orders of it are continuous.
``contact``  ``(clearance, x, y, vx, vy, surface_speed, p) -> (fx, fy, kxx, kxy, kyx, kyy)``  force on the
             journal at (x, y) [m] in the gas bearing and its negative derivative after the displacement, met
             implicitly by the step.

`p` is the record of the effect's own parameters in SI units. At its neutral values an effect leaves every
bit of a trajectory as it is without it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

PORTS = ("force", "contact")


def param(unit: str, default: float | None = 0.0, bounds: tuple[float, float] = (-1e300, 1e300), doc: str = "") -> Any:
    """A parameter in SI: its unit as pint reads it, neutral default, closed bounds, one sentence."""
    return field(default=default, metadata={"unit": unit, "bounds": bounds, "doc": doc})


@dataclass(frozen=True)
class Effect:
    """Base of every effect; `name` is the table's name in the machine file."""

    name: ClassVar[str]
    port: ClassVar[str]
    kernel: ClassVar[Callable[..., Any]]
    place: ClassVar[str] = "disc"
    """Where it acts when `position` is not given: 'disc' (the first), 'film' or 'start' (the left shaft end)."""
    influence: ClassVar[str] = "node"
    steady: ClassVar[bool] = False
    """Whether its force is constant in time, so that an equilibrium includes it."""


REGISTRY: dict[str, type[Effect]] = {}


def register(effect: type[Effect]) -> type[Effect]:
    """Make an effect known under its `name` (a class decorator, also for effects in a user's own module)."""
    if effect.port not in PORTS:
        raise ValueError(f"effect {effect.name}: port {effect.port!r} is none of {', '.join(PORTS)}")
    REGISTRY[effect.name] = effect
    return effect


def numeric_fields(effect: type[Effect]) -> tuple[str, ...]:
    """Names of the parameters that enter the kernel's record (all but `position`)."""
    return tuple(f.name for f in fields(effect) if f.name != "position")

"""A controller that is not a law, to be verified: a function, an object with a `step`, a system of `control`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.exchange.control_systems import is_linear
from rotorsim.control.law import LIMIT, Law
from rotorsim.plant.controller import check_any_controller, name_of


@dataclass(frozen=True, eq=False)
class Other:
    """Any controller under the names that a verification prints; its matrices are not known."""

    given: Any
    name: str
    Ts: float = RIG_SAMPLE
    limit: float = LIMIT
    order: str = "not known"
    hash: str = "none"
    about: dict[str, Any] = field(default_factory=dict)


AnyLaw = Law | Other


def as_law(given: Any) -> AnyLaw:
    """The law of a linear system of the package `control`, else the controller as it is; raises DataError."""
    if isinstance(given, (Law, Other)):
        return given
    if is_linear(given) and given.ninputs == 2:
        return Law.from_control(given)
    check_any_controller(given)
    name = getattr(given, "name", None) or getattr(given, "__name__", None)
    return Other(given, str(name or name_of(given)), about={"controller": type(given).__name__})

"""Parameters of an experiment, each declared by a `Quantity`; the source of the command-line options."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import Field, fields
from typing import TYPE_CHECKING, Any

from rotorsim.base.errors import DataError
from rotorsim.base.quantity import Quantity, check_fields, declared, quantity_of

if TYPE_CHECKING:
    from rotorsim.machine.schema import Machine

LARGEST = 1e15
"""Largest SI value of a parameter without limits of its own: its square is a number still."""


def param(unit: str, doc: str, default: Any, *, low: float = -LARGEST, high: float = LARGEST, **limits: Any) -> Any:
    """A parameter in SI: unit, sentence, default and the limits of its `Quantity`."""
    example = default if isinstance(default, (int, float)) and default else None
    return declared(default, Quantity(unit, doc, low=low, high=high, example=example, **limits))


def sequence() -> Any:
    """The field of an experiment that draws: the number of what it draws."""
    doc = "Number of the random sequence; the seed makes the sensors' noise alone."
    return param("1", doc, 0, low=0, high=2**53, multiple=1)


def parameters(experiment: Any) -> Iterator[tuple[Field[Any], Quantity]]:
    """Fields of an experiment (class or instance) that are parameters."""
    for entry in fields(experiment):
        quantity = quantity_of(entry)
        if quantity is not None:
            yield entry, quantity


def check_parameters(experiment: Any) -> None:
    """Make every parameter a plain number or word; raises DataError with one sentence for a bad one.

    Warns Unusual of one far from all that is done.
    """
    from rotorsim.machine.plausibility import ask  # which reads the catalogue of effects: help of commands does without

    for name, sentence in check_fields(experiment):
        raise DataError(f"{name}: {sentence}")
    for entry, known in parameters(experiment):
        value = getattr(experiment, entry.name)
        if value is not None and not isinstance(value, str):
            ask(entry.name, value, known.unit)


def ask_speeds(machine: Machine, experiment: Any) -> None:
    """Question the speeds of an experiment at which the machine's rim would be too fast."""
    from rotorsim.machine.limits import ask_rim_speed

    for entry, known in parameters(experiment):
        if known.unit == "rad/s" and getattr(experiment, entry.name) is not None:
            ask_rim_speed(machine, getattr(experiment, entry.name), entry.name)


def fastest(experiment: Any) -> float:
    """Highest speed [rad/s] among the parameters of an experiment."""
    speeds = [getattr(experiment, entry.name) for entry, known in parameters(experiment) if known.unit == "rad/s"]
    return max((speed for speed in speeds if speed is not None), default=0.0)


def attributes(experiment: Any) -> dict[str, Any]:
    """Parameters as attributes of a record, SI; those that are not given are left out."""
    values = {known.attribute or entry.name: getattr(experiment, entry.name) for entry, known in parameters(experiment)}
    return {name: value for name, value in values.items() if value is not None}

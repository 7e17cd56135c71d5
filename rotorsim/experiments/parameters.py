"""Parameters of an experiment with SI unit, limits and description, the source of the command-line options."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import Field, dataclass, field, fields
from math import isfinite
from numbers import Real
from typing import TYPE_CHECKING, Any

from rotorsim.base.constants import SAMPLE
from rotorsim.base.errors import DataError
from rotorsim.base.units import show
from rotorsim.machine.rim_speed import ask_rim_speed
from rotorsim.machine.usual import ask

if TYPE_CHECKING:
    from rotorsim.machine.schema import Machine

LARGEST = 1e15
"""Largest SI value of a parameter without limits of its own: its square is a number still."""


@dataclass(frozen=True)
class Param:
    """SI unit ('1' for a number) and limits: `above` is open, `low`, `high` closed; `samples`: a time of whole samples.

    `choices` makes it one of some words, `whole` a whole number, `attr` the name of the record's attribute.
    """

    unit: str
    doc: str
    above: float | None = None
    low: float | None = None
    high: float | None = None
    samples: bool = False
    whole: bool = False
    choices: tuple[str, ...] = ()
    attr: str = ""


def param(unit: str, doc: str, default: Any, **limits: Any) -> Any:
    """A dataclass field with a `Param`."""
    return field(default=default, metadata={"param": Param(unit, doc, **limits)})


def sequence() -> Any:
    """The field of an experiment that draws: the number of what it draws."""
    doc = "Number of the random sequence; the seed makes the sensors' noise alone."
    return param("1", doc, 0, low=0, high=2**53, whole=True)


def parameters(experiment: Any) -> Iterator[tuple[Field[Any], Param]]:
    """Fields of an experiment (class or instance) that are parameters."""
    for entry in fields(experiment):
        if "param" in entry.metadata:
            yield entry, entry.metadata["param"]


def check_parameters(experiment: Any) -> None:
    """Make every parameter a plain number or word; raises DataError with one sentence for a bad one.

    Warns Unusual of one far from all that is done.
    """
    for entry, known in parameters(experiment):
        value = getattr(experiment, entry.name)
        if value is not None or entry.default is not None:
            object.__setattr__(experiment, entry.name, checked(entry.name, value, known, entry.default))
            ask_of(entry.name, getattr(experiment, entry.name), known)


def ask_of(name: str, value: Any, known: Param) -> None:
    """Question an unusual number."""
    if not isinstance(value, str):
        ask(name, value, known.unit)


def ask_speeds(machine: Machine, experiment: Any) -> None:
    """Question the speeds of an experiment at which the machine's rim would be too fast."""
    for entry, known in parameters(experiment):
        if known.unit == "rad/s" and getattr(experiment, entry.name) is not None:
            ask_rim_speed(machine, getattr(experiment, entry.name), entry.name)


def attributes(experiment: Any) -> dict[str, Any]:
    """Parameters as attributes of a record, SI; those that are not given are left out."""
    values = {known.attr or entry.name: getattr(experiment, entry.name) for entry, known in parameters(experiment)}
    return {name: value for name, value in values.items() if value is not None}


def example(default: Any, known: Param) -> str:
    """Value to recommend instead of one that is not a number: the default, else a number within the limits, in SI."""
    least = known.low if known.low is not None else (known.above or 0.0)
    number = default if default is not None else least + 1.0 if known.high is None else 0.5 * (least + known.high)
    return f"{number:.6g}{'' if known.unit == '1' else f' ({known.unit})'}"


def checked(name: str, value: Any, known: Param, default: Any = None) -> Any:
    """The value as a plain one; raises DataError."""
    if known.choices:
        if value not in known.choices:
            raise DataError(f"{name} = {value!r}: is not known; choose one of {', '.join(known.choices)}")
        return value
    if not isinstance(value, Real) or isinstance(value, bool) or not isfinite(value):
        raise DataError(f"{name} = {value}: must be a finite number; give e.g. {example(default, known)}")
    number = float(value)
    _check_limits(name, number, known)
    if known.whole:
        if number != int(number):
            raise DataError(
                f"{name} = {value}: must be a whole number; give e.g. {max(int(known.low or 1), round(number))}"
            )
        return int(number)
    if known.samples:
        whole_samples(name, number)
    return number


def _check_limits(name: str, number: float, known: Param) -> None:
    shown = f"{name} = {show(number, known.unit)}"
    if known.above is not None and number <= known.above:
        raise DataError(f"{shown}: must be above {show(known.above, known.unit)}; give more")
    low = -LARGEST if known.low is None else known.low
    if number < low:
        raise DataError(f"{shown}: is below the limit; give at least {show(low, known.unit)}")
    high = known.high or LARGEST
    if number > high:
        raise DataError(f"{shown}: is above the limit; give at most {show(high, known.unit)}")


def whole_samples(name: str, seconds: float) -> int:
    """Samples in a time [s]; raises DataError if it is not a whole number of them."""
    count = round(seconds / SAMPLE)
    if count < 1 and seconds > 0:
        raise DataError(f"{name} = {show(seconds, 's')}: is shorter than a sample; give at least {show(SAMPLE, 's')}")
    if abs(count * SAMPLE - seconds) > 1e-6 * SAMPLE * max(1.0, 1e-6 * count):
        shown, sample = show(seconds, "s"), show(SAMPLE, "s")
        better = show(float(f"{max(count, 1) * SAMPLE:.12g}"), "s")
        raise DataError(f"{name} = {shown}: is not a whole number of samples of {sample}; give e.g. {better}")
    return count

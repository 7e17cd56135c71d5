"""Specifications of controllers: dataclasses whose numbers are declared with unit, limits and sentence.

A number is kept in the unit in which its design computes (um, V, ms, Hz, ...), which is the declared one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, dataclass
from inspect import cleandoc
from typing import Any, TypeVar

from rotorsim.base.errors import DesignError
from rotorsim.base.quantity import Quantity, check_fields, declared, quantities, quantity_of
from rotorsim.base.units import RIG_SAMPLE

FIELDS = "__dataclass_fields__"
Design = TypeVar("Design", bound=Callable[..., Any])
DESIGNS: dict[str, str] = {}
"""Controller designs by name, each in a few words."""


def register(words: str) -> Callable[[Design], Design]:
    """Decorator of the function `design` of a file: list it under the file's name, described by a few words."""

    def mark(design: Design) -> Design:
        DESIGNS[design.__module__.rpartition(".")[2]] = words
        return design

    return mark


@dataclass(frozen=True)
class Specification:
    """Base of specifications; raises DesignError with one sentence for a number beyond its limits.

    The documentation of a specification lists its numbers with their units, from their declarations.
    """

    def __init_subclass__(cls) -> None:
        cls.__doc__ = f"{cleandoc(cls.__doc__ or '')}\n\n{_listed(cls)}"

    def __post_init__(self) -> None:
        kind = type(self)
        name = "weights" if kind.__name__.endswith("Weights") else kind.__module__.rpartition(".")[2]
        for field, sentence in check_fields(self):
            raise DesignError(
                f"{name}.{field}: {explained(self, field, sentence)}",
                argument=f"{name}.{field}",
                value=getattr(self, field),
            )


def _listed(kind: type) -> str:
    """Section of a specification's documentation: its numbers with type, unit, default and meaning."""
    parents = {name: value for base in kind.__mro__[:0:-1] for name, value in getattr(base, FIELDS, {}).items()}
    own = parents | {name: value for name, value in vars(kind).items() if isinstance(value, Field)}
    types = {name: text for base in kind.__mro__[::-1] for name, text in vars(base).get("__annotations__", {}).items()}
    known = {name: found for name, value in own.items() if (found := quantity_of(value)) is not None}
    lines = (
        f"{name} : {types[name]}, default {_shown(own[name].default)}\n    {one.doc.removesuffix('.')} [{one.unit}]."
        for name, one in known.items()
    )
    return "\n".join(("Parameters", "----------", *lines))


def _shown(default: Any) -> str:
    """A default in readable form."""
    if isinstance(default, tuple):
        return f"({', '.join(map(_shown, default))})"
    return f"{default:.6g}" if isinstance(default, float) else repr(default)


def explained(spec: Any, field: str, sentence: str) -> str:
    """A sentence about a field with the meaning of that."""
    known = quantities(spec).get(field)
    return f"{sentence} ({known.doc.rstrip('.')})" if known else sentence


def number(default: Any, unit: str, doc: str, **limits: Any) -> Any:
    """A number (or tuple of numbers) of a specification."""
    first = default[0] if isinstance(default, tuple) else default
    limits.setdefault("example", first or None)
    return declared(default, Quantity(unit, doc, **limits))


def count(default: Any, doc: str, low: int = 1) -> Any:
    """A whole number (or tuple of them) of a specification."""
    return number(default, "1", doc, low=low, multiple=1)


def shaft_speed(default: float) -> Any:
    """Speed [rad/s] of the operating point."""
    return number(default, "rad/s", "Shaft speed of the operating point.", low=0)


def supply_pressure(default: float) -> Any:
    """Gauge pressure [Pa] of the operating point."""
    return number(default, "Pa", "Injection pressure of the operating point, gauge.")


def sampling_time() -> Any:
    """Sampling time [s] of the law."""
    return number(RIG_SAMPLE, "s", "Sampling time of the law: that of the machine it is for.", above=0, high=1)


def loop_delay(default: float | None) -> Any:
    """Delay [s] of the loop in the design model."""
    return number(default, "s", "Loop delay in the design model; none: 1.5 Ts, a sample and half a hold.", low=0)


def delay_of(spec: Any) -> float:
    """Delay [s] of the loop in a specification's design model: one sample and half a sample of hold where not given."""
    return float(1.5 * spec.Ts if spec.delay is None else spec.delay)

"""Base class of machine parts and their fields, each declared by a `Quantity`.

A value is text with a unit (or a bare number where there is none) until `Part` has validated it, and an SI
float afterwards. Unknown fields are refused, instances are frozen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, fields
from types import new_class
from typing import Any, ClassVar, Self, cast, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from rotorsim.base.quantity import Quantity, quantity_of

SI = {"values": "SI"}
"""Context of a validation whose values are SI floats already, not text with units."""


class PartError(ValueError):
    """Several problems of one part: pairs of a path below it and a sentence."""

    def __init__(self, *items: tuple[str, str]) -> None:
        super().__init__("; ".join(f"{path}: {sentence}" for path, sentence in items))
        self.items = items


def _field(default: Any, declaration: Quantity) -> Any:
    return Field(default, description=declaration.doc, json_schema_extra=cast(Any, {"quantity": declaration}))


def quantity(unit: str, doc: str, default: Any = ..., *, example: float | None = None, **limits: float) -> Any:
    """A field with an SI unit ('1' for a plain number), a sentence, an SI default, SI limits and an SI example."""
    own = example if example is not None or default in (..., None, 0) else default
    return _field(default, Quantity(unit, doc, example=own, **limits))  # type: ignore[arg-type]


def count(doc: str, default: int, *, low: int, high: int, multiple: int = 1) -> Any:
    """A field that is a whole number."""
    return _field(default, Quantity("1", doc, low=low, high=high, multiple=multiple, example=default))


class Part(BaseModel):
    """A part of a machine: frozen, known fields only, SI values."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    tag: ClassVar[str] = "kind"
    """Field that distinguishes it from the other parts of a union."""
    earlier_keys: ClassVar[dict[str, str]] = {}
    """Keys of earlier versions of machine files and the fields that replace them."""

    def problems(self) -> Iterator[tuple[str, str]]:
        """Conflicts between its values: paths below it and sentences."""
        return iter(())

    @model_validator(mode="after")
    def _fits(self) -> Self:
        problems = tuple(self.problems())
        if problems:
            raise PartError(*problems)
        return self

    @field_validator("*", mode="before")
    @classmethod
    def _to_si(cls, value: Any, info: ValidationInfo) -> Any:
        field = cls.model_fields[cast(str, info.field_name)]
        known = quantity_of(field)
        if known is None or (value is None and field.default is None and info.context is SI):
            return value
        return known.check(value) if info.context is SI else known.parse(value)


def part_of(declared: Any, module: str) -> Any:
    """Part of a machine file that a dataclass with declared fields is: its instances are instances of both.

    Parameters
    ----------
    declared : class
        A frozen dataclass whose fields carry a `Quantity`, or under 'doc' a sentence and under 'stated' whether a file
        must give a value that has a default in Python. Its method `problems` is that of the part.
    module : str
        Module that has the part under the name of the dataclass.
    """
    hints = get_type_hints(declared)
    body: dict[str, Any] = {"__module__": module, "__doc__": declared.__doc__, "__annotations__": {}}
    body["problems"] = declared.problems
    for entry in fields(declared):
        known, stated = quantity_of(entry), entry.default is MISSING or entry.metadata.get("stated", False)
        default = ... if stated else entry.default
        body["__annotations__"][entry.name] = hints[entry.name]
        body[entry.name] = _field(default, known) if known else Field(default, description=entry.metadata["doc"])
    return new_class(declared.__name__, (Part, declared), exec_body=lambda space: space.update(body))

"""Base of every part of a machine, and the fields it is made of: a unit, limits and a sentence each.

A value is text with a unit (or a bare number where there is none) until `Part` has validated it, and an SI
float afterwards. Unknown fields are refused, instances are frozen.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import ceil
from typing import Any, cast

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator
from pydantic.fields import FieldInfo

from rotorsim.machine import units
from rotorsim.machine.unit_table import dimension


class PartError(ValueError):
    """Several problems of one part: pairs of a path below it and a sentence."""

    def __init__(self, *items: tuple[str, str]) -> None:
        super().__init__("; ".join(f"{path}: {sentence}" for path, sentence in items))
        self.items = items


@dataclass(frozen=True)
class Spec:
    """Unit and limits of a field: `above` is open, `low`, `high` are closed; `multiple` makes it whole."""

    unit: str = "1"
    above: float | None = None
    low: float | None = None
    high: float | None = None
    multiple: int = 0

    def read(self, value: Any) -> float:
        """SI value of what the file says; raises ValueError with a sentence."""
        number = units.parse(value, self.unit)
        self._check_limits(units.quote(value), number)
        return self._whole(value, number) if self.multiple else number

    def _whole(self, value: Any, number: float) -> int:
        said = units.quote(value)
        if isinstance(value, float) or number != int(number):
            raise ValueError(f"{said} is not a whole number; write e.g. {max(1, round(number))}")
        if number % self.multiple:
            kind = "even" if self.multiple == 2 else f"a multiple of {self.multiple}"
            raise ValueError(f"{said} is not {kind}; write e.g. {ceil(number / self.multiple) * self.multiple}")
        return int(number)

    def _check_limits(self, said: str, number: float) -> None:
        if self.above is not None and number <= self.above:
            limit = units.show(self.above, self.unit) if self.above else "0"
            mirrored = self.above == 0 and number < 0
            example = units.show(-number, self.unit) if mirrored else dimension(self.unit).example
            raise ValueError(f"{said} must be above {limit}; write e.g. {self._quoted(example)}")
        if self.low is not None and number < self.low:
            limit = self._quoted(units.show(self.low, self.unit))
            raise ValueError(f"{said} is below the limit; write at least {limit}")
        if self.high is not None and number > self.high:
            limit = self._quoted(units.show(self.high, self.unit))
            raise ValueError(f"{said} is above the limit; write at most {limit}")

    def _quoted(self, text: str) -> str:
        return text if self.unit == "1" else f"'{text}'"


def spec_of(info: FieldInfo) -> Spec | None:
    """Unit and limits of a pydantic field, None for one without (text, a table, a list)."""
    extra = info.json_schema_extra
    return Spec(**cast(dict[str, Any], extra)) if isinstance(extra, dict) else None


def quantity(
    unit: str,
    doc: str,
    default: Any = ...,
    *,
    above: float | None = None,
    low: float | None = None,
    high: float | None = None,
) -> Any:
    """A field with an SI unit ('1' for a plain number), a sentence, an SI default and SI limits."""
    return Field(default, description=doc, json_schema_extra=asdict(Spec(unit, above, low, high)))


def count(doc: str, default: int, *, low: int, high: int, multiple: int = 1) -> Any:
    """A field that is a whole number."""
    return Field(default, description=doc, json_schema_extra=asdict(Spec("1", None, low, high, multiple)))


class Part(BaseModel):
    """A part of a machine: frozen, known fields only, SI values."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @field_validator("*", mode="before")
    @classmethod
    def _to_si(cls, value: Any, info: ValidationInfo) -> Any:
        spec = spec_of(cls.model_fields[cast(str, info.field_name)])
        return spec.read(value) if spec else value

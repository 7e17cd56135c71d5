"""Base class of machine parts and their fields: unit, limits and description.

A value is text with a unit (or a bare number where there is none) until `Part` has validated it, and an SI
float afterwards. Unknown fields are refused, instances are frozen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from math import ceil
from typing import Any, ClassVar, Self, cast

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator
from pydantic.fields import FieldInfo

from rotorsim.base import units
from rotorsim.base.sentences import quote

FAR = 2.0
"""Beyond a limit by this factor a number is a slip of its unit more likely than of itself."""


class PartError(ValueError):
    """Several problems of one part: pairs of a path below it and a sentence."""

    def __init__(self, *items: tuple[str, str]) -> None:
        super().__init__("; ".join(f"{path}: {sentence}" for path, sentence in items))
        self.items = items


@dataclass(frozen=True)
class Spec:
    """Unit and limits of a field: `above` is open, `low`, `high` are closed; `multiple` makes it whole.

    `example` [SI] is the value that messages recommend.
    """

    unit: str = "1"
    above: float | None = None
    low: float | None = None
    high: float | None = None
    multiple: int = 0
    example: float | None = None

    def read(self, value: Any) -> float:
        """SI value of the file's text; raises ValueError with a sentence."""
        number = units.parse(value, self.unit, self.suggestion)
        self._check_limits(value, number)
        return self._whole(value, number) if self.multiple else number

    def holds(self, number: float) -> bool:
        """Whether a number is within the limits."""
        whole = not self.multiple or number % self.multiple == 0
        above = self.above is None or number > self.above
        return (
            whole and above and (self.low is None or number >= self.low) and (self.high is None or number <= self.high)
        )

    def suggestion(self, digits: str = "") -> str:
        """Recommended text: the digits with a unit that fits the limits, else an example."""
        own = "" if self.example is None else self._show(self.example)
        text = units.suggestion(self.unit, digits, self.holds, own)
        return text if self.holds(units.parse(text, self.unit)) else self._show(self._within())

    def _within(self) -> float:
        """A number within the limits that no example meets."""
        low = self.low if self.low is not None else self.above or 0.0
        high = self.high if self.high is not None else max(2 * low, 1.0)
        return float(high if self.multiple else 0.5 * (low + high))

    def _show(self, number: float) -> str:
        text = units.show(number, self.unit)
        return str(int(number)) if self.multiple else text

    def _whole(self, value: Any, number: float) -> int:
        given = quote(value)
        near = max(round(number / self.multiple), 1) * self.multiple
        if isinstance(value, float) or number != int(number):
            raise ValueError(f"{given} is not a whole number; write e.g. {self.suggestion(str(near))}")
        if number % self.multiple:
            kind = "even" if self.multiple == 2 else f"a multiple of {self.multiple}"
            near = ceil(number / self.multiple) * self.multiple
            raise ValueError(f"{given} is not {kind}; write e.g. {self.suggestion(str(near))}")
        return int(number)

    def _check_limits(self, value: Any, number: float) -> None:
        given = quote(value)
        if self.above is not None and number <= self.above:
            limit = units.show(self.above, self.unit) if self.above else "0"
            example = self._show(-number) if self.holds(-number) else self.suggestion()
            raise ValueError(f"{given} must be above {limit}; write e.g. {units.quoted(example, self.unit)}")
        if self.low is not None and number < self.low:
            slip, low = self._slip(value, number, self.low), units.quoted(self._show(self.low), self.unit)
            raise ValueError(f"{given} is below the limit{slip}; write at least {low}")
        if self.high is not None and number > self.high:
            slip, high = self._slip(value, number, self.high), units.quoted(self._show(self.high), self.unit)
            raise ValueError(f"{given} is above the limit{slip}; write at most {high}")

    def _slip(self, value: Any, number: float, limit: float) -> str:
        """The digits of a text with a unit that fits, where a number is far beyond its limit; else empty."""
        digits = units.split(value)[0] if isinstance(value, str) else ""
        if not digits or limit == 0 or 1 / FAR <= number / limit <= FAR:
            return ""
        meant = self.suggestion(digits)
        return f" (is '{meant}' meant?)" if meant.startswith(f"{digits} ") else ""


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
    example: float | None = None,
) -> Any:
    """A field with an SI unit ('1' for a plain number), a sentence, an SI default, SI limits and an SI example."""
    own = example if example is not None or default in (..., None, 0) else default
    return Field(default, description=doc, json_schema_extra=asdict(Spec(unit, above, low, high, example=own)))


def count(doc: str, default: int, *, low: int, high: int, multiple: int = 1) -> Any:
    """A field that is a whole number."""
    return Field(default, description=doc, json_schema_extra=asdict(Spec("1", None, low, high, multiple, default)))


class Part(BaseModel):
    """A part of a machine: frozen, known fields only, SI values."""

    model_config = ConfigDict(frozen=True, extra="forbid")
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
        spec = spec_of(cls.model_fields[cast(str, info.field_name)])
        return spec.read(value) if spec else value

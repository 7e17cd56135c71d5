"""Declaration of a quantity: unit, limits, sentence; the same for machine files, effects, experiments, designs.

A declared value is read by `Quantity.parse` from text with a unit and checked by `Quantity.check` as a number; both
raise ValueError with one sentence that names the value, the limit and the way out. A dataclass carries declarations in
its fields' metadata (`declared`, `quantities`), a machine part in its pydantic fields (`rotorsim.machine.part`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from math import ceil, inf, isfinite, nextafter
from numbers import Real
from typing import Any

from rotorsim.base import units
from rotorsim.base.display import quote
from rotorsim.base.units import RIG_SAMPLE, dimension

UNLIMITED = 1e299
"""Size of the bounds of a quantity without limits."""
FAR = 2.0
"""Factor beyond a limit from which a wrong unit is more likely than a wrong number."""


@dataclass(frozen=True)
class Quantity:
    """Unit and limits of a value: `above` is open, `low`, `high` are closed; `multiple` makes it whole.

    `unit` is the one that the number is kept in, SI but for controller designs ('1' for a plain number). `samples`
    makes it a time of whole samples, `sampled` a frequency up to half the sampling rate or a time of one sample or
    more, `choices` one of some words. `attribute` is its name in a record, `example` the value that messages recommend.
    """

    unit: str = "1"
    doc: str = ""
    above: float | None = None
    low: float | None = None
    high: float | None = None
    multiple: int = 0
    samples: bool = False
    sampled: bool = False
    choices: tuple[str, ...] = ()
    attribute: str = ""
    example: float | None = None

    def at(self, Ts: float) -> Quantity:
        """The declaration for a sampling time [s]: with the limit that this sets, if it sets one."""
        if not self.sampled:
            return self
        return replace(self, high=0.5 / Ts) if self.unit == "Hz" else replace(self, low=Ts)

    def parse(self, value: Any) -> Any:
        """Value of text with a unit (a bare number where there is none); raises ValueError with a sentence."""
        if self.choices:
            return self._word(value)
        number = units.parse(value, self.unit, self.suggestion)
        return self._checked(number, quote(value), units.split(value)[0] if isinstance(value, str) else "")

    def check(self, value: Any) -> Any:
        """A number in `unit`, or text for `parse`, as a plain float, int or word; raises ValueError with a sentence."""
        if isinstance(value, str) or self.choices:
            return self.parse(value)
        number = _plain(value)
        if number is None or not isfinite(number):
            kind, example = units.a(dimension(self.unit).name), units.quoted(self.suggestion(), self.unit)
            raise ValueError(f"{quote(value if number is None else number)} is not {kind}; write e.g. {example}")
        return self._checked(number, units.quoted(units.show(number, self.unit), self.unit))

    def fault(self, value: Any) -> str:
        """Fault of a value in a sentence; empty for a good one."""
        try:
            self.check(value)
        except ValueError as error:
            return str(error)
        return ""

    def holds(self, number: float) -> bool:
        """Whether a number is within the limits."""
        low, high = self.bounds
        return low <= number <= high and (not self.multiple or number % self.multiple == 0)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest number within the limits; `UNLIMITED` where there is none."""
        low = -UNLIMITED if self.low is None else self.low
        if self.above is not None:
            low = max(low, nextafter(self.above, inf) if self.above else 1e-300)
        return low, UNLIMITED if self.high is None else self.high

    @property
    def limits(self) -> str:
        """The limits in words; empty where there are none."""
        above = [] if self.above is None else [f"above {self._show(self.above)}"]
        low = [] if self.low is None else [f"at least {self._show(self.low)}"]
        return ", ".join((*above, *low, *([] if self.high is None else [f"at most {self._show(self.high)}"])))

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
        return str(int(number)) if self.multiple else units.show(number, self.unit)

    def _quoted(self, number: float) -> str:
        return units.quoted(self._show(number), self.unit)

    def _word(self, value: Any) -> str:
        if value not in self.choices:
            raise ValueError(f"{quote(value)} is not known; choose one of {', '.join(self.choices)}")
        return str(value)

    def _checked(self, number: float, given: str, digits: str = "") -> float:
        """The number within the limits; `given` is how it was written and `digits` those of a text."""
        if self.above is not None and number <= self.above:
            limit = units.show(self.above, self.unit) if self.above else "0"
            example = self._show(-number) if self.holds(-number) else self.suggestion()
            raise ValueError(f"{given} must be above {limit}; write e.g. {units.quoted(example, self.unit)}")
        if self.low is not None and number < self.low:
            slip = self._slip(digits, number, self.low)
            raise ValueError(f"{given} is below the limit{slip}; write at least {self._quoted(self.low)}")
        if self.high is not None and number > self.high:
            slip = self._slip(digits, number, self.high)
            raise ValueError(f"{given} is above the limit{slip}; write at most {self._quoted(self.high)}")
        return self._whole(number, given) if self.multiple else number

    def _whole(self, number: float, given: str) -> int:
        near = max(round(number / self.multiple), 1) * self.multiple
        if number != int(number):
            raise ValueError(f"{given} is not a whole number; write e.g. {self.suggestion(str(near))}")
        if number % self.multiple:
            kind = "even" if self.multiple == 2 else f"a multiple of {self.multiple}"
            near = ceil(number / self.multiple) * self.multiple
            raise ValueError(f"{given} is not {kind}; write e.g. {self.suggestion(str(near))}")
        return int(number)

    def _slip(self, digits: str, number: float, limit: float) -> str:
        """The digits of a text with a unit that fits, where a number is far beyond its limit; else empty."""
        if not digits or limit == 0 or 1 / FAR <= number / limit <= FAR:
            return ""
        meant = self.suggestion(digits)
        return f" (is '{meant}' meant?)" if meant.startswith(f"{digits} ") else ""


def _plain(value: Any) -> float | None:
    """A number as a float, infinite where it is too large for one; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return inf


def declared(default: Any, quantity: Quantity) -> Any:
    """A dataclass field with a default and its declaration."""
    return field(default=default, metadata={"quantity": quantity})


def number(unit: str, doc: str, default: Any = MISSING, *, example: float | None = None, **limits: float) -> Any:
    """A dataclass field that is a number: SI unit ('1' for a plain number), sentence, SI default, limits, example."""
    shown = example if example is not None or default in (MISSING, None, 0) else default
    return declared(default, Quantity(unit, doc, example=shown, **limits))  # type: ignore[arg-type]


def quantity_of(entry: Any) -> Quantity | None:
    """Declaration of a dataclass field or of a pydantic one, None for a field without (text, a table, a list)."""
    carried = entry.metadata if isinstance(entry, Field) else entry.json_schema_extra
    return carried.get("quantity") if isinstance(carried, Mapping) else None


def quantities(owner: Any) -> dict[str, Quantity]:
    """Declarations of a dataclass (or an instance) by field."""
    return {entry.name: found for entry in fields(owner) if (found := quantity_of(entry)) is not None}


def check_fields(owner: Any) -> Iterator[tuple[str, str]]:
    """Make every declared value of a frozen dataclass a plain one; fields with faults and their sentences.

    None stays where the annotation allows it. Times of whole samples are those of its sampling time `Ts` [s].
    """
    Ts = getattr(owner, "Ts", None) or RIG_SAMPLE
    for entry in fields(owner):
        quantity, value = quantity_of(entry), getattr(owner, entry.name)
        if quantity is None or (value is None and "None" in str(entry.type)):
            continue
        try:
            read = _read(entry, quantity.at(Ts), value)
            object.__setattr__(owner, entry.name, read)
            if quantity.samples:
                whole_samples(read, Ts)
        except ValueError as error:
            yield entry.name, str(error)


def _read(entry: Field[Any], quantity: Quantity, value: Any) -> Any:
    """A value of a field: one, or a tuple of as many as its default has (of any number above 0 for tuple[X, ...])."""
    if not isinstance(entry.default, tuple):
        return quantity.check(value)
    try:
        items = () if isinstance(value, str) else tuple(value)
    except TypeError:
        items = ()
    free = "..." in str(entry.type)
    if not items or not (free or len(items) == len(entry.default)):
        number = "one or more" if free else len(entry.default)
        raise ValueError(f"{quote(value)} is not {number} values; write e.g. {entry.default}")
    return tuple(quantity.check(item) for item in items)


def whole_samples(seconds: float, Ts: float = RIG_SAMPLE) -> int:
    """Samples of Ts [s] in a time [s]; raises ValueError if it is not a whole number of them."""
    count, given, sample = round(seconds / Ts), units.show(seconds, "s"), units.show(float(f"{Ts:.12g}"), "s")
    if count < 1 and seconds > 0:
        raise ValueError(f"'{given}' is shorter than a sample; write at least '{sample}'")
    if abs(count * Ts - seconds) > 1e-6 * Ts * max(1.0, 1e-6 * count):
        better = units.show(float(f"{max(count, 1) * Ts:.12g}"), "s")
        raise ValueError(f"'{given}' is not a whole number of samples of {sample}; write e.g. '{better}'")
    return count

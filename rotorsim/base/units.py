"""Conversion of text with a unit to an SI float and back; the only user of pint.

`parse` and `show` are inverse to each other, to the last bit. Numbers are scaled as decimals: '25 um' is the
double nearest to 25e-6. A gauge pressure is a plain pressure here.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from functools import lru_cache, partial
from math import isclose, isfinite, log
from typing import Any

from rotorsim.base.sentences import quote
from rotorsim.base.unit_table import CHARACTERS, CLOSED, NUMBER, advised, dimension

_TEXT = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*", re.ASCII | re.DOTALL)
_UNIT = re.compile(r"(?!.*\d\d)[\w°%*/^(). -]{1,40}")
_SPELLINGS = CHARACTERS | {" * ": "*", " / ": "/", "°C": "degC"}
LONGEST = 25
"""Longest digits that an advice repeats as they stand; repr of a double has up to 24 characters."""


CLOSE = 25.0
"""Up to this factor from the example a number is advised in the example's unit."""
Suggest = Callable[[str], str]
"""Recommended text in place of an unreadable value, from its digits if there are any."""


def parse(value: Any, unit: str, suggest: Suggest | None = None) -> float:
    """SI value of `value`, text such as '25 um', or a bare number when `unit` is '1'.

    `suggest` makes the example of an error's sentence; by default it is one that is typical of the dimension.

    Raises
    ------
    ValueError
        With a sentence that names the value and the way out, if it has no unit, a wrong or an unknown one, or
        is not finite.
    """
    kind = dimension(unit)
    suggest = suggest or partial(suggestion, unit)

    def wrong(fault: str, digits: str = "") -> ValueError:
        return ValueError(f"{quote(value)} {fault}; write e.g. {quoted(suggest(digits), unit)}")

    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise wrong(f"is not {a(kind.name)}")
    match = _TEXT.fullmatch(value if isinstance(value, str) else _plain_repr(value))
    if not match:
        raise wrong(f"is not {a(kind.name)}")
    digits, written = match.groups()
    if not written and unit != "1":
        raise wrong("has no unit", digits)
    if written and unit == "1":
        plain = _shortest(_scaled(digits, "0.01", "0")) if written == "%" else digits
        raise wrong("has a unit but is a plain number", plain)
    factor, offset, fault = _conversion(written, unit) if written else ("1", "0", "")
    if fault:
        raise wrong(fault)
    number = _scaled(digits, factor, offset) if written else float(digits)
    if not isfinite(number):
        raise wrong("is too large a number")
    return number


def suggestion(unit: str, digits: str = "", fits: Callable[[float], bool] = lambda value: True, own: str = "") -> str:
    """A text that can be read: the digits with the unit that brings them nearest to an example, if they fit.

    Else the example; `own` is one of the field that is asked for, instead of the dimension's typical one.
    """
    example = own or dimension(unit).example
    if unit == "1":
        return digits if digits and isfinite(float(digits)) and fits(float(digits)) else example
    number, _, typical = example.partition(" ")
    typical_size = abs(_value(example, unit))
    units = list(dict.fromkeys((typical, *advised(unit))))
    short = digits if len(digits) <= LONGEST else _shortest(float(digits))
    for n in (short, number):
        own_unit = _value(f"{n} {typical}", unit) if n else 0.0
        if fits(own_unit) and _apart(abs(own_unit), typical_size) < log(CLOSE) and own_unit:
            return f"{n} {typical}"
        fitting = [f"{n} {u}" for u in units if n and isfinite(v := _value(f"{n} {u}", unit)) and fits(v)]
        if fitting:
            return min(fitting, key=lambda text: _apart(abs(_value(text, unit)), typical_size))
    return example


def _apart(a: float, b: float) -> float:
    """Distance of two sizes in powers; 0 where one of them is 0."""
    return abs(log(a / b)) if a > 0 and b > 0 else 0.0


def _value(text: str, unit: str) -> float:
    """SI value of a number with a unit of the table; not a number where it is none."""
    number, _, written = text.partition(" ")
    return _scaled(number, dimension(unit).factors.get(written, "nan"), "0")


def quoted(text: str, unit: str) -> str:
    """A value as a machine file has it: in quotes where it has a unit."""
    return text if unit == "1" else f"'{text}'"


def show(value: float, unit: str) -> str:
    """Text of an SI value in a unit people use; `parse` gives exactly the same value back."""
    if unit == "1":
        return _shortest(value)
    kind = dimension(unit)
    if value == 0:
        return "0 " + kind.example.split(" ", 1)[1]
    fitting = [u for u in kind.people if abs(value) >= 0.1 * float(kind.factors[u])] or list(kind.people[:1])
    decimal = Decimal(repr(float(value)))
    for written in (fitting[-1], kind.people[-1]):
        scaled = float(decimal / Decimal(kind.factors[written]))
        for candidate in (float(f"{scaled:.12g}"), scaled):
            text = f"{_shortest(candidate)} {written}"
            if _reads_back(text, unit, value):
                return text
    return f"{_shortest(value)} {unit}"


def split(text: str) -> tuple[str, str]:
    """Digits and unit of a text such as '25 um'; the text and nothing where it has no digits."""
    match = _TEXT.fullmatch(text)
    return match.groups() if match else (text, "")  # type: ignore[return-value]


def _reads_back(text: str, unit: str, value: float) -> bool:
    try:
        return parse(text, unit) == value
    except ValueError:  # out of range in this unit
        return False


def a(noun: str) -> str:
    """A noun with its article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _plain_repr(value: float) -> str:
    """A number as Python writes it, also one of NumPy."""
    return repr(int(value) if isinstance(value, int) else float(value))


def _shortest(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


def _scaled(digits: str, factor: str, offset: str) -> float:
    plain = float(digits)
    if plain == 0 or not isfinite(plain):
        return plain + float(offset)
    return float(Decimal(digits) * Decimal(factor) + Decimal(offset))


def _conversion(written: str, unit: str) -> tuple[str, str, str]:
    """Factor and offset from `written` to `unit`, and what is wrong with it (nothing if it is a unit of this kind)."""
    for spelling, plain in _SPELLINGS.items():
        written = written.replace(spelling, plain)
    kind = dimension(unit)
    if written in kind.factors:
        return kind.factors[written], "0", ""
    problem = "" if _UNIT.fullmatch(written) else "unknown"
    factor, offset = "", ""
    if not problem:
        factor, offset, problem = _ask_pint(written, unit)
    if problem == "unknown":
        return "", "", "has an unknown unit"
    if problem or unit in CLOSED:
        return "", "", f"is not {a(kind.name)}"
    return factor, offset, ""


@lru_cache(maxsize=256)
def _ask_pint(written: str, unit: str) -> tuple[str, str, str]:
    """Factor, offset and problem ('', 'unknown' or 'wrong') of a unit that the table does not list."""
    from pint import DimensionalityError

    ureg = _registry()
    try:
        offset = ureg.Quantity(0.0, written).to(unit).magnitude
        factor = ureg.Quantity(1.0, written).to(unit).magnitude - offset
    except DimensionalityError:
        return "", "", "wrong"
    except Exception:  # pint's parser answers nonsense with anything from TokenError to AttributeError
        return "", "", "unknown"
    return repr(_round(factor)), repr(_round(offset)), ""


def _round(number: float) -> float:
    """`number` without pint's rounding error where a short decimal is meant."""
    short = float(f"{number:.12g}")
    return short if isclose(short, number, rel_tol=2e-15) else number


@lru_cache(maxsize=1)
def _registry() -> Any:
    from pint import UnitRegistry

    return UnitRegistry()

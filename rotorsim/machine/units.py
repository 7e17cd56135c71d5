"""Text with a unit to an SI float and back: the only place that knows pint.

`parse` and `show` are inverse to each other, to the last bit. Numbers are scaled as decimals: '25 um' is the
double nearest to 25e-6. A gauge pressure is a plain pressure here.
"""

from __future__ import annotations

import re
from decimal import Decimal
from functools import lru_cache
from math import isclose, isfinite
from typing import Any

from rotorsim.machine.unit_table import CLOSED, dimension

_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.ASCII | re.DOTALL)
_UNIT = re.compile(r"(?!.*\d\d)[\w°%*/^(). -]{1,40}")
_SPELLINGS = {
    "µ": "u",
    "μ": "u",
    "·": "*",
    "²": "^2",
    "³": "^3",
    "**": "^",
    " * ": "*",
    " / ": "/",
    "°C": "degC",
}


def parse(value: Any, unit: str) -> float:
    """SI value of `value`, text such as '25 um', or a bare number when `unit` is '1'.

    Raises
    ------
    ValueError
        With a sentence that names the value and the way out, if it has no unit, a wrong or an unknown one, or
        is not finite.
    """
    kind = dimension(unit)
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise ValueError(f"{quote(value)} is not {_a(kind.name)}; write e.g. {_example(unit)}")
    match = _TEXT.fullmatch(value if isinstance(value, str) else repr(value))
    if not match:
        raise ValueError(f"{quote(value)} is not {_a(kind.name)}; write e.g. {_example(unit)}")
    digits, written = match.groups()
    if not written and unit != "1":
        hint = f"{digits[:20]} {kind.example.split(' ', 1)[1]}"
        raise ValueError(f"{quote(value)} has no unit; write e.g. '{hint}'")
    if written and unit == "1":
        raise ValueError(f"{quote(value)} has a unit but is a plain number; write e.g. {kind.example}")
    number = _scaled(digits, *_conversion(written, unit, str(value))) if written else float(digits)
    if not isfinite(number):
        raise ValueError(f"{quote(value)} is too large a number; write e.g. {_example(unit)}")
    return number


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


def quote(value: Any) -> str:
    """A value as it stands in a machine file, cut to a readable length."""
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 50 else text[:46] + "..." + text[-1]


def _reads_back(text: str, unit: str, value: float) -> bool:
    try:
        return parse(text, unit) == value
    except ValueError:  # out of range in this unit
        return False


def _example(unit: str) -> str:
    return dimension(unit).example if unit == "1" else f"'{dimension(unit).example}'"


def _a(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _shortest(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


def _scaled(digits: str, factor: str, offset: str) -> float:
    plain = float(digits)
    if plain == 0 or not isfinite(plain):
        return plain + float(offset)
    return float(Decimal(digits) * Decimal(factor) + Decimal(offset))


def _conversion(written: str, unit: str, value: str) -> tuple[str, str]:
    """Factor and offset from `written` to `unit`, or a sentence about `value`."""
    for spelling, plain in _SPELLINGS.items():
        written = written.replace(spelling, plain)
    kind = dimension(unit)
    if written in kind.factors:
        return kind.factors[written], "0"
    problem = "" if _UNIT.fullmatch(written) else "unknown"
    if not problem:
        factor, offset, problem = _ask_pint(written, unit)
    if problem == "unknown":
        raise ValueError(f"{quote(value)} has an unknown unit; write e.g. {_example(unit)}")
    if problem or unit in CLOSED:
        raise ValueError(f"{quote(value)} is not {_a(kind.name)}; write e.g. {_example(unit)}")
    return factor, offset


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

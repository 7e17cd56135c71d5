"""JSON from outside: `loads` as that of the standard library, with a bound on how deeply values are nested.

Code that reads such values further calls itself for each level.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from json import JSONDecodeError, dumps
from typing import Any

__all__ = ["JSONDecodeError", "dumps", "loads"]

DEEPEST = 100
"""Largest number of levels of lists and tables in each other; files of rotorsim have ten."""


class NestingError(ValueError):
    """Raised for a value that is nested too deeply."""


def bounded(parse: Callable[[Any], Any], text: str | bytes) -> Any:
    """The value that `parse` makes of a text; raises NestingError if it is nested deeper than `DEEPEST` levels."""
    try:
        value = parse(text)
    except RecursionError as error:
        raise NestingError(f"brackets are nested deeper than {DEEPEST} levels") from error
    level: list[Any] = [value]
    for _ in range(DEEPEST + 1):
        level = [below for one in level for below in _inside(one)]
        if not level:
            return value
    raise NestingError(f"brackets are nested deeper than {DEEPEST} levels")


def _inside(value: Any) -> Iterable[Any]:
    """Lists and tables directly in a value."""
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [one for one in parts if isinstance(one, (dict, list))]


def loads(text: str | bytes) -> Any:
    """Value of a JSON text; raises JSONDecodeError, and UnicodeDecodeError for bytes that are no text."""
    try:
        return bounded(json.loads, text)
    except NestingError as error:
        raise JSONDecodeError(str(error), "", 0) from error

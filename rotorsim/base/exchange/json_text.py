"""JSON of other people: `loads` as that of the standard library, with a bound on how deeply values are nested."""

from __future__ import annotations

import json
from json import JSONDecodeError, dumps
from typing import Any

from rotorsim.base.exchange.nesting import NestingError, bounded

__all__ = ["JSONDecodeError", "dumps", "loads"]


def loads(text: str | bytes) -> Any:
    """Value of a JSON text; raises JSONDecodeError, and UnicodeDecodeError for bytes that are no text."""
    try:
        return bounded(json.loads, text)
    except NestingError as error:
        raise JSONDecodeError(str(error), "", 0) from error

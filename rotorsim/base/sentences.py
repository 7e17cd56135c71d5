"""Values in the sentences of errors."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def quote(value: Any) -> str:
    """A value as a file has it: control characters escaped, cut to a readable length."""
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:56] + "..." + text[-1]


def listing(names: Iterable[Any], most: int = 6) -> str:
    """The first few names of many, quoted."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(quote(name) for name in names[:most]) + more

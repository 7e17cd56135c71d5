"""Values in the sentences of errors, and names of files in tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any


def quote(value: Any) -> str:
    """A value as a file has it: control characters escaped, cut to a readable length."""
    if hasattr(value, "item") and getattr(value, "ndim", None) == 0:  # a number of NumPy, as a plain one
        value = value.item()
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:56] + "..." + text[-1]


def listing(names: Iterable[Any], most: int = 6) -> str:
    """The first few names of many, quoted."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(quote(name) for name in names[:most]) + more


def told_apart(paths: Sequence[Path]) -> list[str]:
    """Name of each file, after as many of its folders as tell it from the others."""
    most = max((len(path.parts) for path in paths), default=0)
    ends = [[str(Path(*path.parts[-k:])) for k in range(1, most + 1)] for path in paths]
    counts = [Counter(column) for column in zip(*ends, strict=True)]
    return [next((end for end, count in zip(own, counts, strict=True) if count[end] == 1), own[-1]) for own in ends]

"""Values and suggestions in the sentences of errors, names of files in tables, and foreign text on a terminal."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

OBEYED = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
"""Characters that a terminal obeys instead of showing them, and those that turn the direction of what follows."""


def visible(text: str) -> str:
    """A text with the escapes of the characters that a terminal would obey; ends of lines and tabs stay."""
    return OBEYED.sub(lambda found: ascii(found[0])[1:-1], text)


class VisibleStream:
    """Text stream to a terminal or pipe that writes `visible` text; Rich, whose own escapes are meant, goes round it.

    It has no `buffer`: Click would write there what it supposes that the encoding does not take.
    """

    def __init__(self, stream: Any) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write a text."""
        return int(self.rich_proxied_file.write(visible(text)))

    def writelines(self, lines: Iterable[str]) -> None:
        """Write texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        if name in ("buffer", "rich_proxied_file"):
            raise AttributeError(name)
        return getattr(self.rich_proxied_file, name)


def direct(stream: Any) -> Any:
    """The stream below a `VisibleStream`, for escapes of our own."""
    return getattr(stream, "rich_proxied_file", stream)


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


def closest(name: Any, known: Iterable[str]) -> str:
    """The known name that is most like this one; empty if none is."""
    return next(iter(get_close_matches(str(name), sorted(known), n=1)), "")


def did_you_mean(name: Any, known: Iterable[str]) -> str:
    """'did you mean ...?' where a known name is similar, else the known names."""
    known = list(known)
    close = closest(name, known)
    return f"did you mean '{close}'?" if close else f"known are {', '.join(known)}"

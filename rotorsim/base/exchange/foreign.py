"""Objects of other programs: every attribute is read, derived from what is read, or named in a sentence.

An importer takes each object through a `Foreign`, which counts the attributes that are read. What is left over when the
importer is done reaches the user by `Leftovers.warn` as a `NotCarried` warning, so that a later version of the other
program cannot lose a property here in silence.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable
from typing import Any

from rotorsim.base.errors import NotCarried

_REQUIRED: Any = object()
_NAMED = 8
"""Names in a sentence, before the rest is counted."""


class Foreign:
    """One object of another program; `what` names it in sentences."""

    def __init__(self, value: Any, what: str) -> None:
        self.value, self.what = value, what
        self._read: set[str] = set()

    def read(self, name: str, default: Any = _REQUIRED) -> Any:
        """An attribute, counted as read; the default where the object has none.

        Raises
        ------
        AttributeError
            If there is neither the attribute nor a default.
        """
        self._read.add(name)
        return getattr(self.value, name) if default is _REQUIRED else getattr(self.value, name, default)

    def unread(self, derived: Collection[str] = ()) -> tuple[str, ...]:
        """Names of the attributes that hold something, were not read and do not follow from others.

        `derived` lists those that follow from others or only concern drawing.
        """
        found = getattr(self.value, "__dict__", {})
        names = (name for name in found if not name.startswith("_") and name not in self._read)
        return tuple(sorted(name for name in names if name not in derived and not _empty(found[name])))


class Leftovers:
    """Sentences about what an importer did not carry over, the same about many objects in one."""

    def __init__(self, importer: str) -> None:
        self.importer = importer
        self._places: dict[str, list[str]] = {}

    def add(self, what: str, sentence: str) -> None:
        """A sentence about one object."""
        self._places.setdefault(sentence, []).append(what)

    def unread(self, one: Foreign, derived: Collection[str] = ()) -> None:
        """Name the attributes of an object that were not read."""
        if names := one.unread(derived):
            self.add(one.what, f"{_few(names)} of {type(one.value).__name__} not carried over; there is no counterpart")

    def warn(self) -> None:
        """Raise one `NotCarried` warning a sentence, at the caller of the importer."""
        for sentence, places in self._places.items():
            warnings.warn(f"{self.importer}: {_few(dict.fromkeys(places))}: {sentence}.", NotCarried, stacklevel=4)


def _few(names: Iterable[str]) -> str:
    names = list(names)
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def _empty(value: Any) -> bool:
    """Whether an attribute holds nothing: None, an empty text, list or table."""
    return value is None or (isinstance(value, (str, list, tuple, dict, set)) and not value)

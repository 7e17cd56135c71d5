"""Errors about data: one sentence with variable or file, value, limit and remedy."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


class SchemaError(ValueError):
    """A record that does not fit the schema; the message names variable, problem and way out."""


class ReadError(ValueError):
    """A file or a mapping that cannot be read; the message names file, place and way out."""


def quote(value: Any) -> str:
    """A value as a sentence shows it: control characters escaped, cut to a readable length."""
    text = repr(value)
    return text if len(text) <= 60 else text[:56] + "..." + text[-1]


def listing(names: Iterable[Any], most: int = 6) -> str:
    """The first few names of many, quoted."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(quote(name) for name in names[:most]) + more


class UnfitError(SchemaError):
    """A record, or a set of records, that fits the schema but not the identification asked for."""


class ModelError(ValueError):
    """A model that cannot be read, converted or made; the message names what, why and the way out."""

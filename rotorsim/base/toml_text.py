"""TOML from outside: `loads` as that of the standard library, with a bound on how deeply values are nested."""

from __future__ import annotations

import tomllib
from tomllib import TOMLDecodeError
from typing import Any

from rotorsim.base.json_text import NestingError, bounded

__all__ = ["TOMLDecodeError", "loads"]


def loads(text: str) -> dict[str, Any]:
    """Tables of a TOML text; raises TOMLDecodeError."""
    try:
        tables: dict[str, Any] = bounded(tomllib.loads, text)
    except NestingError as error:
        raise TOMLDecodeError(str(error)) from error
    return tables

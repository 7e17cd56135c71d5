"""Suggestion of the name that was probably meant, for messages about unknown names."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any


def closest(name: Any, known: Iterable[str]) -> str:
    """The known name that is most like this one; empty if none is."""
    return next(iter(get_close_matches(str(name), sorted(known), n=1)), "")


def did_you_mean(name: Any, known: Iterable[str]) -> str:
    """'did you mean ...?' where a known name is similar, else the known names."""
    known = list(known)
    close = closest(name, known)
    return f"did you mean '{close}'?" if close else f"known are {', '.join(known)}"

"""Differences between two plans, as short sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rotorsim.base.sentences import quote


def differences(there: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Differences of a store's plan (`there`) from the `wanted` plan, as sentences."""
    return [
        sentence
        for name in [*there, *(key for key in wanted if key not in there)]
        if there.get(name) != wanted.get(name)
        for sentence in _sentences(name, there.get(name), wanted.get(name))
    ]


def _sentences(name: str, there: Any, wanted: Any) -> Iterator[str]:
    if there is None or wanted is None:
        yield f"{name} {'is only in this plan' if there is None else 'is only in the store'}"
    elif name.startswith("machine "):
        yield from _lines(name, there, wanted)
    elif isinstance(there, list) and isinstance(wanted, list) and len(there) != len(wanted):
        yield f"{name}: {len(there)} values there, {len(wanted)} here"
    elif isinstance(there, list) and isinstance(wanted, list):
        first = next(i for i, (a, b) in enumerate(zip(there, wanted, strict=True)) if a != b)
        yield f"{name}: {quote(there[first])} there, {quote(wanted[first])} here"
    else:
        yield f"{name}: {quote(there)} there, {quote(wanted)} here"


def _lines(name: str, there: str, wanted: str) -> Iterator[str]:
    """Lines of a machine's text that are not the same."""
    old, new = set(there.splitlines()), set(wanted.splitlines())
    gone = [line for line in there.splitlines() if line not in new]
    come = [line for line in wanted.splitlines() if line not in old]
    yield f"{name}: {'; '.join(gone[:2]) or 'nothing'} there, {'; '.join(come[:2]) or 'nothing'} here"

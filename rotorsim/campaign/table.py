"""Columns of the table of all cases."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rotorsim.campaign.index import Row
from rotorsim.campaign.plan import Plan

FIRST = ("number", "experiment", "repeat", "seed")
LAST = ("status", "error", "duration", "cpu", "bytes", "host", "versions", "finished", "attempts", "key")


def header(plan: Plan, rows: Iterable[Row]) -> tuple[str, ...]:
    """Names of the columns: what was set, what came out, how it went; values in SI."""
    axes = [f"set.{axis.name}" for axis in plan.axes if axis.name != "seed"]
    found = dict.fromkeys(name for row in rows for name in row.summary)
    return (*FIRST, *axes, *found, *LAST)


def line(row: Row, names: Iterable[str]) -> list[Any]:
    """A row's values; nothing where there is none."""
    own = set(FIRST + LAST)
    told = {f"set.{name}": value for name, value in row.parameters.items()} | row.summary
    return [getattr(row, name) if name in own else told.get(name) for name in names]

"""Columns of the CSV table of all cases."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rotorsim.campaign.plan.plan import Plan
from rotorsim.campaign.store.index import Row

FIRST = ("number", "experiment", "repeat", "seed")
LAST = ("status", "error", "duration", "cpu", "bytes", "host", "versions", "finished", "attempts", "key")


def header(plan: Plan, rows: Iterable[Row]) -> tuple[str, ...]:
    """Column names of the table: axis values, results, status; values in SI."""
    axes = [f"set.{axis.name}" for axis in plan.axes if axis.name != "seed"]
    found = dict.fromkeys(name for row in rows for name in row.summary)
    return (*FIRST, *axes, *found, *LAST)


def line(row: Row, names: Iterable[str]) -> list[Any]:
    """Values of a row; empty where there is none."""
    own = set(FIRST + LAST)
    values = {f"set.{name}": value for name, value in row.parameters.items()} | row.summary
    return [getattr(row, name) if name in own else values.get(name) for name in names]

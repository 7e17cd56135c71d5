"""Axes of a plan: lists, grids, or columns of a Latin hypercube."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log
from typing import Any

import numpy as np

from rotorsim.campaign.errors import PlanError
from rotorsim.campaign.plan.plan_file import AxisTable, LatinTable, Value
from rotorsim.campaign.plan.targets import Target

MOST_POINTS = 10_000_000


@dataclass(frozen=True)
class Axis:
    """Axis of a plan: a target and its values; all `latin` axes vary together."""

    target: Target
    values: tuple[Value, ...]
    latin: bool = False

    @property
    def name(self) -> str:
        """Path, parameter, 'seed' or 'machine'."""
        return self.target.name


@dataclass(frozen=True)
class Limits:
    """Limits of an axis of the Latin hypercube, before its points are drawn."""

    target: Target
    low: float
    high: float
    log: bool

    def values(self, unit: np.ndarray) -> tuple[Value, ...]:
        """Points between the limits for points (n,) in [0, 1)."""
        if self.log:
            raw = [exp(log(self.low) + u * (log(self.high) - log(self.low))) for u in unit]
        else:
            raw = [self.low + u * (self.high - self.low) for u in unit]
        return tuple(self.target.neat(min(max(value, self.low), self.high)) for value in raw)


def read_axis(target: Target, table: AxisTable) -> Axis | Limits:
    """Axis from a plan's table; raises PlanError."""
    where = f"axes.{target.name}"
    given = [kind for kind in ("list", "grid", "latin") if getattr(table, kind) is not None]
    if len(given) != 1:
        problem = " and ".join(given) if given else "neither list nor grid nor latin"
        raise PlanError(f"{where}: {problem}; give one of list, grid, latin")
    if table.points is not None and given != ["grid"]:
        raise PlanError(f"{where}.points: only a grid has points; leave it out or write grid = [from, to]")
    if table.spacing != "linear" and given == ["list"]:
        raise PlanError(f"{where}.spacing: a list has no spacing; leave it out")
    if given == ["list"]:
        return _list(target, table, where)
    if not target.numeric and not (given == ["grid"] and target.whole):
        raise PlanError(f"{where}: {target.name} has no values in between; give a list")
    return _grid(target, table, where) if given == ["grid"] else _limits(target, table, where)


def _list(target: Target, table: AxisTable, where: str) -> Axis:
    assert table.list is not None
    values = tuple(target.read(value, f"{where}.list") for value in table.list)
    if not values:
        raise PlanError(f"{where}.list: is empty; give at least one value or leave the axis out")
    for number, value in enumerate(values):
        if value in values[:number]:
            raise PlanError(f"{where}.list: {table.list[number]!r} is there twice; remove one")
    return Axis(target, values)


def _grid(target: Target, table: AxisTable, where: str) -> Axis:
    assert table.grid is not None
    first, last = (float(target.read(value, f"{where}.grid")) for value in table.grid)
    points = table.points
    if points is None or not 1 <= points <= MOST_POINTS:
        problem = "missing" if points is None else f"{points} is not from 1 to {MOST_POINTS}"
        raise PlanError(f"{where}.points: {problem}; give the number of values, e.g. 5")
    if (first == last) != (points == 1):
        raise PlanError(f"{where}.grid: {points} points from {table.grid[0]!r} to {table.grid[1]!r}; give two ends")
    _check_log(table, min(first, last), where)
    spread = np.geomspace(first, last, points) if table.spacing == "log" else np.linspace(first, last, points)
    return Axis(target, tuple(_whole(target, target.neat(float(value)), where) for value in spread))


def _whole(target: Target, value: float, where: str) -> Value:
    if not target.whole:
        return value
    if value != int(value):
        raise PlanError(f"{where}.grid: {value:g} is not a whole number; change points or give a list")
    return int(value)


def _limits(target: Target, table: AxisTable, where: str) -> Limits:
    assert table.latin is not None
    low, high = (float(target.read(value, f"{where}.latin")) for value in table.latin)
    if not low < high:
        problem = f"{table.latin[0]!r} is not below {table.latin[1]!r}"
        raise PlanError(f"{where}.latin: {problem}; give the lower limit first and a higher one")
    _check_log(table, low, where)
    return Limits(target, low, high, table.spacing == "log")


def _check_log(table: AxisTable, low: float, where: str) -> None:
    if table.spacing == "log" and low <= 0:
        raise PlanError(f"{where}.spacing: 'log' needs values above 0; change the limits or write 'linear'")


def draw(limits: list[Limits], table: LatinTable | None) -> list[Axis]:
    """Axes of the Latin hypercube; the same seed gives the same points."""
    if not limits:
        if table is not None:
            raise PlanError("latin: no axis is latin; leave the table out or give an axis limits, latin = [low, high]")
        return []
    if table is None:
        raise PlanError(f"latin: missing for axes.{limits[0].target.name}; write [latin] with samples = 100")
    if not 1 <= table.samples <= MOST_POINTS:
        raise PlanError(f"latin.samples: {table.samples} is not from 1 to {MOST_POINTS}; give e.g. 100")
    if table.seed < 0:
        raise PlanError(f"latin.seed: {table.seed} is negative; give a whole number from 0")
    points = _hypercube(len(limits), table)
    return [Axis(one.target, one.values(column), True) for one, column in zip(limits, points.T, strict=True)]


def _hypercube(dimensions: int, table: LatinTable) -> Any:
    from scipy.stats import qmc

    # scipy renamed `seed` to `rng` and took a Generator by either name
    return qmc.LatinHypercube(dimensions, rng=np.random.default_rng(table.seed)).random(table.samples)

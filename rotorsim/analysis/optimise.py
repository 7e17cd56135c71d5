"""Search for the values of a few parameters that make a quantity largest or smallest and keep limits.

Powell's COBYLA, which needs no gradients and keeps bounds and limits by linear models, on parameters scaled to their
bounds (scipy). Onset and critical speeds are followed from the machine that the search begins at, as in `tolerances`;
those of the best machine are searched wholly at the end, and the difference is stated.

Cites: powell_1994.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

from rotorsim.analysis import tolerances
from rotorsim.analysis.axes import Field
from rotorsim.analysis.sweep_definition import read_over
from rotorsim.analysis.targets import split, value_at
from rotorsim.analysis.tolerances import Requirement, Task, quantity_of, read_requirements
from rotorsim.base.errors import DataError
from rotorsim.base.units import TABLE as UNITS, parse
from rotorsim.machine.file_text import expanded, with_values
from rotorsim.machine.schema import Machine
from rotorsim.plant.plant import Plant, as_plant, point

FIRST = 0.25
"""First size of a step, over the width of the bounds."""
LAST = 2e-3
"""Size of a step, likewise, at which the search ends."""
MOST = 60
"""Machines of a search."""
MOST_GOAL = 10.0
"""Size of the objective, over that of the first machine, that an onset above the highest speed counts as."""


@dataclass(frozen=True, eq=False)
class Optimisation:
    """Path of a search: `data` has parameters in their units, quantities [SI] and `kept` over the step.

    `best` is the number of the best step that keeps every limit, None where none does; `confirmed` the relative
    difference of its followed speeds to a whole search, `modes` the critical speeds of the first machine in words.
    """

    data: xr.Dataset
    objective: str
    largest: bool
    requirements: tuple[Requirement, ...]
    best: int | None
    confirmed: dict[str, float]
    modes: dict[str, str] = field(default_factory=dict)

    @property
    def machine(self) -> dict[str, str]:
        """Values of the best machine by path, with their units; empty without one."""
        if self.best is None:
            return {}
        names = [n for n in self.data.data_vars if "path" in self.data[n].attrs]
        return {
            str(self.data[n].attrs["path"]): f"{float(self.data[n][self.best]):.6g} {self.data[n].attrs['units']}"
            for n in names
        }

    def table(self) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
        """Head with units and a row a step, in the order of the search."""
        heads, columns = ["step"], [np.arange(1, self.data.sizes["step"] + 1).astype(float)]
        for name in map(str, self.data.data_vars):
            if name == "kept":
                continue
            attrs = self.data[name].attrs
            shown = quantity_of(name) if "path" not in attrs else None
            heads.append(f"{attrs['path']} [{attrs['units']}]" if shown is None else shown.heading)
            columns.append(self.data[name].values * (1.0 if shown is None else shown.factor))
        kept = ["yes" if one else "no" for one in self.data["kept"].values.tolist()]
        rows = [(*(float(v) for v in row), word) for row, word in zip(np.transpose(columns), kept, strict=True)]
        return (*heads, "limits kept"), rows

    def numbers(self) -> dict[str, Any]:
        """Best machine and the path as plain values."""
        heads, rows = self.table()
        return {
            "best": self.machine, "best_step": None if self.best is None else self.best + 1,
            "path": [dict(zip(heads, row, strict=True)) for row in rows],
            "difference_to_whole_search": self.confirmed,
        }  # fmt: skip


@dataclass
class _Search:
    """Machines that were computed, in their order."""

    task: Task
    fields: tuple[Field, ...]
    paths: list[list[str]]
    rows: list[dict[str, float]] = field(default_factory=list)
    followed: list[dict[str, float]] = field(default_factory=list)
    """Speeds by the modes that they were followed with, from which the next ones start."""
    points: list[np.ndarray] = field(default_factory=list)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Parameters in their units at shares x (k,) of their bounds."""
        ends = np.array([one.numbers[:: len(one.numbers) - 1] for one in self.fields])
        return np.asarray(ends[:, 0] + np.clip(x, 0, 1) * (ends[:, 1] - ends[:, 0]))

    def changes(self, x: np.ndarray) -> list[tuple[str, str | float]]:
        """Values as a machine file has them, by path."""
        pairs = zip(self.fields, self.paths, self.values(x), strict=True)
        return [(path, f"{v:.12g} {one.unit}" if one.unit else float(v)) for one, paths, v in pairs for path in paths]

    def row(self, x: np.ndarray) -> dict[str, float]:
        """Quantities [SI] at x, computed once."""
        for known, row in zip(self.points, self.rows, strict=True):
            if np.abs(known - x).max() < 1e-12:
                return row
        starts = [self._start(one.name, one.speed, x) for one in self.task.followed]
        found = tolerances.row_of(self.task, [v for _, v in self.changes(x)], starts)
        self.points.append(np.array(x))
        self.followed.append(found)
        self.rows.append(tolerances.in_order(found))
        return self.rows[-1]

    def _start(self, name: str, nominal: float, x: np.ndarray) -> float:
        """A followed speed [rad/s] of the nearest machine so far."""
        known = [(np.abs(p - x).max(), r[name]) for p, r in zip(self.points, self.followed, strict=True)
                 if np.isfinite(r.get(name, np.nan))]  # fmt: skip
        return min(known)[1] if known else nominal


def optimise(
    machine: Plant | Machine | str,
    over: Mapping[str, Any] | Sequence[str],
    objective: str,
    require: Sequence[str] = (),
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest: float | str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Optimisation:
    """Values of a few parameters between bounds for which a quantity is best and limits are kept.

    Parameters
    ----------
    machine : Plant, Machine or str
        Where the search begins, if it lies within the bounds; else it begins in their middle.
    over : mapping or sequence of str
        Bounds by path: 'bearings.*.clearance=15 um, 25 um'; a star changes every entry together.
    objective : str
        A quantity of `sweep` or a critical speed: best is what `sweep` calls best; '+onset' and '-onset' state it.
    require : sequence of str
        Limits: 'flow < 450 mg/s'.
    speed, pressure, highest : float or str
        As of `random_machines`.
    progress : callable, optional
        Called with the machines done and the most there may be.

    Raises
    ------
    DataError, MachineFileError
        For bounds, quantities or limits that cannot be read.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.optimise("plain_rotor", {"discs.0.mass": "3 kg, 5 kg"}, "critical_1", highest="5000 rpm")
    >>> found.machine
    {'discs.0.mass': '3 kg'}
    """
    plant = as_plant(machine)
    fields = read_over(over, plant.machine)
    for one in fields:
        if len(one.numbers) < 2 or "." not in one.path:
            raise DataError(f"--over {one.path}: give two bounds of a value of the machine, e.g. '15 um, 25 um'")
    name = objective.lstrip("+-")
    wanted = [name, *(text.split("<")[0].split(">")[0].strip() for text in require)]
    paths = [list(expanded(plant.machine.text, one.path)) for one in fields]
    begin = _begin(plant, fields, paths)
    search = _Search(None, fields, paths)  # type: ignore[arg-type]
    start = Plant(Machine.from_text(with_values(plant.machine.text, dict(search.changes(begin)))))
    every = [path for group in paths for path in group]
    names = {tolerances.CRITICALS if one.startswith("critical_") else one for one in wanted}
    requirements = read_requirements(require, sorted(names))
    search.task = tolerances.task_of(start, sorted(names), every, *point(speed, pressure), highest)
    tolerances.check_critical([one.quantity for one in requirements], search.task)
    tolerances.check_critical([name], search.task, "--objective")
    largest = objective[0] == "+" or (objective[0] != "-" and quantity_of(name).best == "highest")
    _run(search, begin, name, -1.0 if largest else 1.0, requirements, progress)
    return _result(search, plant, name, largest, requirements)


def _begin(plant: Plant, fields: Sequence[Field], paths: Sequence[Sequence[str]]) -> np.ndarray:
    """Shares of the bounds at which the machine itself lies, one half where it lies beyond."""
    found = []
    for one, group in zip(fields, paths, strict=True):
        own, low, high = _in_one_unit(value_at(plant.machine.text, group[0]), one.values[0], one.values[-1])
        share = (own - low) / (high - low)
        found.append(share if 0 <= share <= 1 else 0.5)
    return np.array(found)


def _in_one_unit(*values: Any) -> list[float]:
    """Numbers of values of one field, in the first unit that reads them all."""
    for unit in UNITS:
        with suppress(ValueError):
            return [float(parse(value, unit)) for value in values]
    return [split("over", value)[0] for value in values]


def _run(
    search: _Search, begin: np.ndarray, name: str, sign: float, requirements: Sequence[Requirement],
    progress: Callable[[int, int], None] | None,
) -> None:  # fmt: skip
    unit = abs(search.row(begin).get(name, 1.0))
    unit = unit if 0 < unit < np.inf else search.task.highest

    def goal(x: np.ndarray) -> float:
        value = search.row(x).get(name, np.nan) / unit
        if progress:
            progress(min(len(search.rows), MOST), MOST)
        return sign * float(np.clip(value, -MOST_GOAL, MOST_GOAL)) if not np.isnan(value) else 2.0

    def room(one: Requirement) -> Callable[[np.ndarray], float]:
        def left(x: np.ndarray) -> float:
            value = search.row(x).get(one.quantity, np.nan)
            return min(margin(one, value), 1.0) if not np.isnan(value) else -1.0

        return left

    limits = [{"type": "ineq", "fun": room(one)} for one in requirements]
    limits += [{"type": "ineq", "fun": lambda x, k=k: x[k]} for k in range(len(begin))]
    limits += [{"type": "ineq", "fun": lambda x, k=k: 1 - x[k]} for k in range(len(begin))]
    minimize(goal, begin, method="COBYLA", constraints=limits, options={"rhobeg": FIRST, "tol": LAST, "maxiter": MOST})


def margin(one: Requirement, value: float) -> float:
    """Distance of a value from a limit, over its size unless that is 0; below 0 beyond it."""
    return (value - one.limit) / (abs(one.limit) or 1.0) * (1 if one.above else -1)


def _result(
    search: _Search, plant: Plant, name: str, largest: bool, requirements: tuple[Requirement, ...]
) -> Optimisation:
    points = np.array([search.values(x) for x in search.points])
    columns: dict[str, Any] = {}
    for k, one in enumerate(search.fields):
        columns[one.name] = ("step", points[:, k], {"units": one.unit or "1", "path": one.path})
    for quantity in dict.fromkeys([name, *(one.quantity for one in requirements)]):
        values = np.array([row.get(quantity, np.nan) for row in search.rows])
        columns[quantity] = ("step", values, {"units": quantity_of(quantity).unit})
    kept = ~np.isnan(columns[name][1])
    for limit in requirements:
        kept &= np.array([margin(limit, row.get(limit.quantity, np.nan)) >= 0 for row in search.rows])
    columns["kept"] = ("step", kept)
    goal = np.where(kept, columns[name][1] * (1.0 if largest else -1.0), -np.inf)
    best = int(goal.argmax()) if kept.any() else None
    confirmed: dict[str, float] = {}
    if best is not None and search.task.followed:
        own = [v for _, v in search.changes(search.points[best])]
        confirmed = tolerances.compared(search.rows[best], tolerances.whole_row(search.task, own))
    return Optimisation(
        xr.Dataset(columns, attrs=plant.provenance() | {"kind": "optimisation"}), name, largest, requirements, best,
        confirmed, tolerances.modes_in_words(search.task),
    )  # fmt: skip

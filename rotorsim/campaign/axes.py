"""Tables of a plan file, and its axes: what each varies (a machine value, a parameter, the seed, the machine).

Values of an axis are a list, a grid, or a column of a Latin hypercube.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp, log
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Strict, ValidationError

from rotorsim.analysis.sweep_definition import ANALYSES, Analysis
from rotorsim.base.display import did_you_mean, quote
from rotorsim.base.errors import DataError, MachineFileError, RotorsimError
from rotorsim.base.input_files import parse_toml
from rotorsim.base.quantity import Quantity, quantities
from rotorsim.base.units import Suggest, dimension, parse, show
from rotorsim.effects import REGISTRY, Effect
from rotorsim.experiments import EXPERIMENTS, Experiment
from rotorsim.experiments.experiment import check_seed
from rotorsim.machine import Machine
from rotorsim.machine.file_text import ANY, declarations
from rotorsim.machine.part import Part

MAX_BYTES = 10_000_000
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,63}")
Value = str | int | float
Words = Annotated[tuple[str, ...], Strict(False)]
Values = Annotated[tuple[Any, ...], Strict(False)]
Pair = Annotated[tuple[Any, Any], Strict(False)]
_WANTED = {
    "list": "a list of values, e.g. ['0 rpm', '3000 rpm']",
    "grid": "the two ends, e.g. ['0.2 MPa', '0.7 MPa']",
    "latin": "the two limits, e.g. ['1 g*mm', '20 g*mm']",
    "points": "a whole number, e.g. 5",
    "samples": "a whole number, e.g. 100",
    "repeats": "a whole number, e.g. 3",
    "seed": "a whole number, e.g. 1",
    "machine": "the name of a shipped machine or a path in quotes",
    "time_limit": "a time in quotes, e.g. '10 min'",
    "keep": "'all' or a list of variables, e.g. ['disc_measured', 'reference']",
    "summary": "a list of names, e.g. ['numbers']",
    "experiments": "tables, e.g. [experiments.first]",
    "axes": "tables, e.g. [axes.speed]",
    "changes": "a table, e.g. [changes] with trial_weight = { me = '12 g*mm', phase = '30 deg' }",
}
Kind = type[Experiment] | type[Analysis]
KINDS: dict[str, Kind] = {**EXPERIMENTS, **ANALYSES}
"""Every kind of a case by its name."""
MOST_POINTS = 10_000_000


class PlanError(RotorsimError):
    """Raised for a plan that cannot be read or does not describe a campaign."""


class TomlTable(BaseModel):
    """A table of a plan: known fields only."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


T = TypeVar("T", bound=TomlTable)


class AxisTable(TomlTable):
    """One axis: `list` of values, `grid` from .. to in a number of `points`, or limits of a `latin` hypercube."""

    list: Values | None = None
    grid: Pair | None = None
    latin: Pair | None = None
    points: int | None = None
    spacing: Literal["linear", "log"] = "linear"


class LatinTable(TomlTable):
    """Number of points and seed of the Latin hypercube of all `latin` axes."""

    samples: int
    seed: int = 0


class PlanTable(TomlTable):
    """The whole plan."""

    name: str = "campaign"
    description: str = ""
    machine: str | None = None
    set: dict[str, Value] = {}
    changes: dict[str, Any] = {}
    experiment: dict[str, Any] | None = None
    experiments: dict[str, dict[str, Any]] = {}
    axes: dict[str, dict[str, Any]] = {}
    latin: dict[str, Any] | None = None
    repeats: int = 1
    seed: int = 0
    seeds: Literal["same", "different"] = "same"
    keep: Literal["all"] | Words = "all"
    summary: Words = ("numbers",)
    time_limit: str = "1 h"


def read_plan(path: Path) -> str:
    """Text of a plan's file; raises PlanError if it cannot be one."""
    if not path.is_file():
        raise PlanError(f"{path}: is not a file; give the path of a plan")
    if path.stat().st_size > MAX_BYTES:
        raise PlanError(f"{path}: {path.stat().st_size / 1e6:.3g} MB is above the limit of 10 MB; is it a plan?")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PlanError(f"{path}: is not text; a plan is TOML in UTF-8") from error


def parse_plan(text: str) -> PlanTable:
    """Tables of a plan; raises PlanError with the first problem."""
    try:
        tables = parse_toml(text)
    except ValueError as error:
        raise PlanError(f"not a TOML file: {str(error)[:200]}; correct that line") from error
    return read_table(PlanTable, tables, "")


def read_table(kind: type[T], table: Any, where: str) -> T:
    """One table; raises PlanError that names the field."""
    if not isinstance(table, dict):
        raise PlanError(f"{where}: {quote(table)} is not a table; write its fields below a [header]")
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        problem = error.errors()[0]
        path = ".".join(filter(None, (where, *(str(key) for key in problem["loc"][:1]))))
        raise PlanError(f"{path}: {_sentence(problem, kind)}") from error


def _sentence(problem: Any, kind: type[TomlTable]) -> str:
    given, key = problem["input"], str(problem["loc"][0]) if problem["loc"] else ""
    if problem["type"] == "missing" and len(problem["loc"]) == 1:
        return "missing; add it"
    if problem["type"] == "extra_forbidden":
        return unknown(key, kind.model_fields, "field")
    expected = problem.get("ctx", {}).get("expected")
    return f"{quote(given)} does not fit here; write {expected or _WANTED.get(key, 'what the documentation shows')}"


def unknown(name: str, known: Any, what: str) -> str:
    """Sentence about a name that is none of `known`."""
    return f"unknown {what}; {did_you_mean(name, known)}"


def is_analysis(name: str) -> bool:
    """Whether cases of a kind are analyses, without a record."""
    return name in ANALYSES


def make(kind: str, parameters: Mapping[str, Any], Ts: float) -> Experiment | Analysis:
    """The experiment of a kind at a sampling time [s], or the analysis."""
    return ANALYSES[kind](**parameters) if is_analysis(kind) else EXPERIMENTS[kind](**parameters, Ts=Ts)


@dataclass(frozen=True)
class AxisTarget:
    """Target of an axis; `kind` is 'path', 'parameter', 'seed' or 'machine'; no `unit` for text values.

    `sample` is the sampling time [s] of a time of whole samples, 0 for anything else.
    """

    kind: str
    name: str
    unit: str | None = None
    whole: bool = False
    sample: float = 0.0
    suggest: Suggest | None = field(default=None, compare=False, repr=False)

    def read(self, value: Any, where: str) -> Value:
        """SI value, whole number or word from the plan's text; raises PlanError."""
        if self.kind == "seed":
            return read_seed(value, where)
        if self.unit is None:
            if isinstance(value, str):
                return value
            raise PlanError(f"{where}: {value!r} is not text; write it in quotes")
        try:
            number = parse(value, self.unit, self.suggest)
        except ValueError as error:
            raise PlanError(f"{where}: {error}") from error
        return int(number) if self.whole and number == int(number) else number

    def neat(self, number: float) -> float:
        """An SI value near another that is short to write in people's unit; a time in whole samples."""
        if self.sample:
            number = round(number / self.sample) * self.sample
        kind = dimension(self.unit or "1")
        if not kind.people:
            return float(f"{number:.12g}")
        unit = kind.people[-1]
        return parse(f"{number / float(kind.factors[unit]):.12g} {unit}", self.unit or "1")

    def written(self, value: Value) -> Value:
        """A value as a machine file has it."""
        if self.unit is None or self.unit == "1" or isinstance(value, str):
            return value
        return show(value, self.unit)

    @property
    def numeric(self) -> bool:
        """Whether values lie on a scale, so that there are others between two of them."""
        return self.unit is not None and not self.whole


def read_seed(value: Any, where: str) -> int:
    """A seed of a plan; raises PlanError."""
    try:
        return check_seed(value)
    except DataError as error:
        raise PlanError(f"{where}: {error}") from error


def find_target(name: str, machine: Machine, kinds: Mapping[str, Kind]) -> AxisTarget:
    """Target of an axis by its name; raises PlanError if there is none."""
    if name in ("seed", "machine"):
        return AxisTarget(name, name, whole=name == "seed")
    known = {own: quantity for kind in kinds.values() for own, quantity in quantities(kind).items()}
    if name in known:
        return _target("parameter", name, known[name], machine.sampling_time)
    if "." in name:
        return _target("path", name, quantity_at(machine, name, f"axes.{name}"))
    raise PlanError(
        f"axes.{name}: {unknown(name, [*known, 'seed', 'machine'], 'axis')}; a path of the machine has dots"
    )


def _target(kind: str, name: str, quantity: Quantity | None, Ts: float = 0.0) -> AxisTarget:
    if quantity is None or quantity.choices:
        return AxisTarget(kind, name)
    sample = Ts if quantity.samples else 0.0
    return AxisTarget(kind, name, quantity.unit, bool(quantity.multiple), sample, quantity.suggestion)


def quantity_at(machine: Machine, path: str, where: str) -> Quantity | None:
    """Declaration of a machine value, None for text; raises PlanError if the path leads to no value."""
    here: Any = machine
    *tables, last = path.split(".")
    for key, after in zip(tables, [*tables[1:], last], strict=True):
        here = _below(here, key, where, after)
    names = _names(here)
    if last not in names:
        raise PlanError(f"{where}: {unknown(last, sorted(names), 'value')}")
    if not isinstance(names[last], (Quantity, type(None))):
        raise PlanError(f"{where}: holds several values; name one of them")
    return names[last]


def _below(here: Any, key: str, where: str, after: str | None = None) -> Any:
    if isinstance(here, tuple):
        if key == ANY and here:
            return next((one for one in here if after is None or hasattr(one, after)), here[0])
        if key.isdecimal() and int(key) < len(here):
            return here[int(key)]
        if len(here) == 1:
            return _below(here[0], key, where)
        raise PlanError(f"{where}: '{key}' is none of {len(here)} entries, counted from 0; give its number")
    if isinstance(here, dict):
        if key not in here and key not in REGISTRY:
            raise PlanError(f"{where}: {unknown(key, sorted(REGISTRY), 'effect')}")
        return here.get(key) or REGISTRY[key]
    if isinstance(here, type) and key == "0":  # an effect that the machine has not got yet
        return here
    value = getattr(here, key, None) if isinstance(here, Part) and key in type(here).model_fields else None
    if value is None:
        raise PlanError(f"{where}: {unknown(key, sorted(_names(here)), 'table')}")
    return value


def _names(here: Any) -> dict[str, Any]:
    """Values below a part or an effect with their unit and limits; a table stands for itself."""
    if isinstance(here, tuple) and len(here) == 1:
        here = here[0]
    kind = here if isinstance(here, type) else type(here)
    if not issubclass(kind, (Part, Effect)):
        return {}
    found: dict[str, Any] = {name: quantity for name, (quantity, _) in declarations(kind).items()}
    if isinstance(here, Part):
        found |= {name: value for name in found if isinstance(value := getattr(here, name), (Part, tuple, dict))}
    return found


def read_parameters(kind: Kind, table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """SI values of an experiment's parameters from a plan's table; raises PlanError."""
    known = quantities(kind)
    values = {}
    for name, value in table.items():
        if name not in known:
            raise PlanError(f"{where}.{name}: {unknown(name, known, f'parameter of {kind.name}')}")
        try:
            values[name] = known[name].parse(value)
        except ValueError as error:
            raise PlanError(f"{where}.{name}: {error}") from error
    return values


def find_experiment(name: Any, where: str) -> Kind:
    """Kind of experiment by name; raises PlanError for an unknown one."""
    known = {key: kind for key, kind in KINDS.items() if key != "controlled"}
    if name not in known:
        raise PlanError(f"{where}.kind: {unknown(str(name), known, 'experiment')}")
    return known[name]


def change(machine: Machine, path: str, value: Value, where: str) -> Machine:
    """Machine with one value changed; the error names the plan's field."""
    try:
        return machine.replace(path, value)
    except MachineFileError as error:
        raise PlanError(f"{where}: {error.problems[0]}") from error


@dataclass(frozen=True)
class Axis:
    """Axis of a plan: a target and its values; all `latin` axes vary together."""

    target: AxisTarget
    values: tuple[Value, ...]
    latin: bool = False

    @property
    def name(self) -> str:
        """Path, parameter, 'seed' or 'machine'."""
        return self.target.name


@dataclass(frozen=True)
class LatinLimits:
    """Limits of an axis of the Latin hypercube, before its points are drawn."""

    target: AxisTarget
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


def read_axis(target: AxisTarget, table: AxisTable) -> Axis | LatinLimits:
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


def _list(target: AxisTarget, table: AxisTable, where: str) -> Axis:
    assert table.list is not None
    values = tuple(target.read(value, f"{where}.list") for value in table.list)
    if not values:
        raise PlanError(f"{where}.list: is empty; give at least one value or leave the axis out")
    for number, value in enumerate(values):
        if value in values[:number]:
            raise PlanError(f"{where}.list: {table.list[number]!r} is there twice; remove one")
    return Axis(target, values)


def _grid(target: AxisTarget, table: AxisTable, where: str) -> Axis:
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


def _whole(target: AxisTarget, value: float, where: str) -> Value:
    if not target.whole:
        return value
    if value != int(value):
        raise PlanError(f"{where}.grid: {value:g} is not a whole number; change points or give a list")
    return int(value)


def _limits(target: AxisTarget, table: AxisTable, where: str) -> LatinLimits:
    assert table.latin is not None
    low, high = (float(target.read(value, f"{where}.latin")) for value in table.latin)
    if not low < high:
        problem = f"{table.latin[0]!r} is not below {table.latin[1]!r}"
        raise PlanError(f"{where}.latin: {problem}; give the lower limit first and a higher one")
    _check_log(table, low, where)
    return LatinLimits(target, low, high, table.spacing == "log")


def _check_log(table: AxisTable, low: float, where: str) -> None:
    if table.spacing == "log" and low <= 0:
        raise PlanError(f"{where}.spacing: 'log' needs values above 0; change the limits or write 'linear'")


def draw(limits: list[LatinLimits], table: LatinTable | None) -> list[Axis]:
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

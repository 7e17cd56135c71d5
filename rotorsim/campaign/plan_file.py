"""TOML tables of a plan file: known fields and their types."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Strict, ValidationError

from rotorsim.base.display import did_you_mean, quote
from rotorsim.base.input_files import parse_toml
from rotorsim.campaign.errors import PlanError

MAX_BYTES = 10_000_000
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,63}")
Value = str | int | float
Words = Annotated[tuple[str, ...], Strict(False)]
Values = Annotated[tuple[Any, ...], Strict(False)]
Pair = Annotated[tuple[Any, Any], Strict(False)]


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

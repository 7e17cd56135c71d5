"""Axes of maps and sweeps: speeds, pressures and any field of the machine file; an analysis repeated over fields."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.units import NUMBER, parse
from rotorsim.machine.plausibility import ask

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine.schema import Machine
    from rotorsim.plant import Plant

TEXT = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*", re.ASCII)
"""Number and unit."""
DECIMAL_COMMA = re.compile(r"\s*([+-]?\d+),(\d+\s*[^\d,:\s][^,:]*)", re.ASCII)
"""Number with a decimal comma and a unit: a list of values has a unit at each."""
MOST = 100_000
"""Points of a map: more is a mistake of typing."""


@dataclass(frozen=True)
class Field:
    """A field of the machine file that varies: dotted path, values as a machine file has them, numbers, their unit."""

    path: str
    values: tuple[Any, ...]
    numbers: tuple[float, ...]
    unit: str

    @property
    def name(self) -> str:
        """Name of the dimension: the path with underscores."""
        return self.path.replace(".", "_")


def checked(name: str, values: Sequence[float] | np.ndarray, texts: Sequence[str] = ()) -> np.ndarray:
    """A grid (n,) of finite, strictly ascending numbers, which errors show as the `texts` given; raises DataError."""
    grid = np.atleast_1d(np.asarray(values, float))
    if grid.ndim != 1 or not grid.size:
        raise DataError(f"{name}: the grid is empty; give at least one value")
    if not np.all(np.isfinite(grid)):
        raise DataError(f"{name}: value {int(np.argmin(np.isfinite(grid))) + 1} is not a finite number; correct it")
    falls = np.flatnonzero(np.diff(grid) <= 0)
    if falls.size:
        k = int(falls[0]) + 1
        value, before = (texts[k], texts[k - 1]) if len(texts) == grid.size else (f"{grid[k]:g}", f"{grid[k - 1]:g}")
        raise DataError(f"{name}: value {k + 1}, {value}, is not above the one before it, {before}; sort it")
    return grid


def read_axis(option: str, text: str, unit: str) -> np.ndarray:
    """SI values of 'FROM:TO:COUNT' or of values with commas, each with its unit; raises DataError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.read_axis("speed", "0 rpm:6000 rpm:3", "rad/s").round(1).tolist()
    [0.0, 314.2, 628.3]
    """
    ends, count = split_range(option, text)
    try:
        numbers = [float(parse(end, unit)) for end in ends]
    except ValueError as error:
        raise DataError(f"--{option}: {error}") from error
    for number, end in zip(numbers, ends, strict=True):
        ask(option, number, unit, end, "--")
    if count > 1 and not numbers[1] > numbers[0]:
        raise DataError(f"--{option}: the end, {ends[1]}, is not above the one before it, {ends[0]}; exchange them")
    return checked(f"--{option}", np.linspace(numbers[0], numbers[1], count) if count else numbers, ends)


def read_field(text: str) -> Field:
    """A field of 'PATH=FROM:TO:COUNT' or 'PATH=VALUE, VALUE'; raises DataError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.read_field("bearings.1.clearance=24 um, 26 um").name
    'bearings_1_clearance'
    """
    path, equals, values = text.partition("=")
    if not equals or not path.strip():
        raise DataError(f"--over: '{text}' is not PATH=VALUES; write e.g. 'bearings.1.clearance=20 um:30 um:5'")
    ends, count = split_range("over", values)
    found = [TEXT.fullmatch(end) for end in ends]
    units = {match[2] for match in found if match}
    if None in found or len(units) != 1:
        raise DataError(f"--over: '{values.strip()}' needs numbers with one and the same unit, e.g. '20 um:30 um:5'")
    unit = units.pop()
    numbers = [float(match[1]) for match in found if match]
    grid = checked(f"--over {path.strip()}", np.linspace(numbers[0], numbers[1], count) if count else numbers)
    shown = tuple(f"{v:.12g} {unit}" if unit else (int(v) if v == int(v) else float(v)) for v in grid)
    return Field(path.strip(), shown, tuple(map(float, grid)), unit)


def split_range(option: str, text: str) -> tuple[list[str], int]:
    """Ends and number of points of a range, or the values of a list and 0."""
    if one := DECIMAL_COMMA.fullmatch(text):
        raise DataError(
            f"--{option}: '{text}' has a comma; write '{one[1]}.{one[2]}', or each value with its unit",
            argument=option,
            value=text,
        )
    if ":" not in text:
        return [part.strip() for part in text.split(",") if part.strip()], 0
    parts = [part.strip() for part in text.split(":")]
    if len(parts) != 3 or not parts[2].isdecimal() or not 1 <= int(parts[2]) <= MOST:
        raise DataError(f"--{option}: '{text}' is not FROM:TO:COUNT; write e.g. '0 rpm:6000 rpm:7'")
    if parts[2] == "1":
        return parts[:1], 0
    return parts[:2], int(parts[2])


def with_fields(machine: Machine, fields: Sequence[Field], values: Sequence[Any]) -> Machine:
    """The machine with one value of each field; raises MachineFileError where it would not be valid."""
    for field, value in zip(fields, values, strict=True):
        machine = machine.replace(field.path, value)
    return machine


def over_fields(plant: Plant, fields: Sequence[Field], analysis: Callable[[Plant], xr.Dataset]) -> xr.Dataset:
    """`analysis` of the machine at every combination of the fields' values: a Dataset over (fields..., its own dims).

    ``over_fields(plant, [read_field("bearings.1.clearance=24 um, 26 um")], lambda p: whirl_onset(p, [0.5e6]))``

    Examples
    --------
    >>> import rotorsim as rs
    >>> fields = [rs.analysis.read_field("bearings.1.clearance=24 um, 26 um")]
    >>> found = rs.analysis.over_fields(plant, fields, lambda one: rs.analysis.critical_speeds(one, [0.5e6], (1,)))
    >>> found.sizes["bearings_1_clearance"]
    2
    """
    import xarray as xr

    if not fields:
        return analysis(plant)
    first, *others = fields
    parts = [over_fields(type(plant)(with_fields(plant.machine, [first], [v])), others, analysis) for v in first.values]
    axis = xr.DataArray(list(first.numbers), dims=first.name, name=first.name, attrs=labelled(first))
    return xr.concat(parts, axis, data_vars="all", coords="minimal", compat="equals", join="exact")


def labelled(field: Field) -> dict[str, str]:
    """Attributes of a field's coordinate."""
    return {"units": field.unit or "1", "long_name": field.path}

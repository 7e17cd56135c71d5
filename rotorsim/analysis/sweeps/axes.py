"""Axes of a sweep from 'PATH=FROM:TO:COUNT', 'PATH=A, B' or, in percent of the machine's value, 'PATH=-10%:+10%:5'."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rotorsim.analysis.axes import Field, checked, read_axis, read_field, split_range
from rotorsim.analysis.targets import split, value_at
from rotorsim.base.errors import DataError
from rotorsim.base.suggest import did_you_mean
from rotorsim.base.unit_table import NUMBER
from rotorsim.base.units import parse
from rotorsim.machine.file_text import expanded
from rotorsim.machine.schema import Machine

POINTS = {"speed": "rad/s", "pressure": "Pa"}
"""Axes that are no values of the machine, with their units."""
PERCENT = re.compile(rf"({NUMBER})\s*%", re.ASCII)
MOST = 100_000
"""Cells of a sweep."""

Over = Mapping[str, Any] | Sequence[str]


def read_over(over: Over, machine: Machine) -> tuple[Field, ...]:
    """Axes of texts 'PATH=VALUES', or of values by path; raises DataError or MachineFileError."""
    if not over:
        raise DataError("--over: no axis is given; write e.g. --over 'bearings.0.clearance=15 um:25 um:5'")
    texts = [f"{path}={_values(values)}" for path, values in over.items()] if isinstance(over, Mapping) else over
    fields = tuple(_axis(text, machine) for text in texts)
    names = [field.path for field in fields]
    for name in names:
        if names.count(name) > 1:
            raise DataError(f"--over: {name} is given twice; write all its values in one axis")
    cells = int(np.prod([float(len(field.values)) for field in fields]))
    if cells > MOST:
        raise DataError(f"--over: {cells} cells are above the limit of {MOST}; take fewer points per axis")
    return fields


def _values(values: Any) -> str:
    return values if isinstance(values, str) else ", ".join(map(str, values))


def _axis(text: str, machine: Machine) -> Field:
    path, _, values = (part.strip() for part in text.partition("="))
    if values and path in POINTS:
        return _point_axis(path, values)
    if "%" in values:
        return _percent(path, values, machine)
    field = read_field(text)
    _check(field, machine)
    return field


def _point_axis(path: str, values: str) -> Field:
    if "%" in values:
        raise DataError(f"--over: {path} is no value of the machine; give values with units, e.g. {EXAMPLES[path]}")
    read_axis(path, values, POINTS[path])
    field = read_field(f"{path}={values}")
    if parse(field.values[0], POINTS[path]) < 0:
        raise DataError(f"--over {path}: '{field.values[0]}' is below 0; start at 0 or above")
    return field


EXAMPLES = {"speed": "'speed=0 rpm:30000 rpm:5'", "pressure": "'pressure=0.3 MPa:0.7 MPa:5'"}


def _percent(path: str, values: str, machine: Machine) -> Field:
    ends, count = split_range("over", values)
    found = [PERCENT.fullmatch(end) for end in ends]
    if None in found:
        raise DataError(f"--over: '{values}' mixes percent with other numbers; write e.g. '-10%:+10%:5'")
    shares = [float(match[1]) / 100 for match in found if match]
    shares = np.linspace(shares[0], shares[1], count).tolist() if count else shares
    number, unit = _own(path, machine)
    grid = checked(f"--over {path}", [number * (1 + share) for share in shares])
    field = Field(path, tuple(f"{v:.12g} {unit}" if unit else float(v) for v in grid), tuple(map(float, grid)), unit)
    _check(field, machine)
    return field


def _own(path: str, machine: Machine) -> tuple[float, str]:
    """Number and unit of a value of the machine; of several, all must be alike."""
    found = {split(path, value_at(machine.text, one)) for one in expanded(machine.text, path)}
    if len(found) != 1:
        raise DataError(f"--over: {path} has different values in this machine; give values with units, not percent")
    return found.pop()


def _check(field: Field, machine: Machine) -> None:
    """Raise for a path that leads nowhere, or an end that the machine does not take."""
    if "." not in field.path:
        names = [*POINTS, *(name for name in type(machine).model_fields if name not in POINTS)]
        raise DataError(f"--over: '{field.path}' is not a path to a value; {did_you_mean(field.path, names)}")
    for value in (field.values[0], field.values[-1]):
        machine.replace(field.path, value)

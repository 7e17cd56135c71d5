"""Values of a mapping's entry in SI units, from the column of a file that it names."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from identification.errors import ReadError
from identification.records.mapping import Entry
from identification.records.table import Column, Table
from identification.records.units import (
    FULL_SCALE,
    agree,
    amplitude_factor,
    factor,
    full_scale,
    is_unit,
    quantity,
    sensitivity,
)
from rotorsim.base.sentences import quote


def values(table: Table, entry: Entry, si: str) -> np.ndarray:
    """Values of a channel (n,) in SI units; raises ReadError that begins with the entry's path."""
    try:
        column = table.find(entry.column)
        scale = scale_of(table, entry, si)
        result = column.values if scale == 1 else column.values * scale
        return result + quantity(entry.offset, si) if entry.offset is not None else result
    except ReadError as error:
        raise ReadError(f"{entry.path}: {error}") from error


def unit_of(column: Column, entry: Entry) -> tuple[str, float]:
    """Unit of a column's numbers and the factor to it, which is 1 but for shares of a full scale.

    A unit that the mapping states replaces the file's (see `replaced`).

    Raises ReadError where neither the file nor the mapping states a unit, or where one is a share of a full scale.
    """
    if entry.full_scale is not None:
        if column.unit not in (FULL_SCALE, None):
            raise ReadError(
                f"full_scale: the column is in {quote(column.unit)}, not in shares of full scale; remove it"
            )
        number, stated = full_scale(entry.full_scale)
        return stated, number
    unit = entry.unit if entry.unit is not None else column.unit
    if unit == FULL_SCALE or column.unit == FULL_SCALE:
        raise ReadError("the column is in shares of full scale; write e.g. full_scale = '10 V' in place of the unit")
    if unit is None:
        raise ReadError("no unit, neither here nor in the file; write e.g. unit = 'um'")
    return unit, 1.0


def replaced(table: Table, entries: Iterable[Entry]) -> list[str]:
    """A sentence for each entry whose unit stands in place of another one that the file states."""
    found = []
    for entry in entries:
        unit = table.find(entry.column).unit if table.has(entry.column) else None
        if entry.unit and unit and not agree(entry.unit, unit):
            found.append(
                f"{entry.path}: read in {quote(entry.unit)}, which the mapping states; the file states {quote(unit)}"
            )
    return found


def _factor(column: Column, entry: Entry, si: str) -> float:
    unit, scale = unit_of(column, entry)
    try:
        if entry.sensitivity is not None:
            return scale * sensitivity(entry.sensitivity, unit, si)
        if entry.path.endswith("amplitude") or entry.path.startswith("amplitude_"):
            return scale * amplitude_factor(unit)
        return scale * factor(unit, si)
    except ReadError as error:
        if unit == column.unit and not is_unit(unit):  # the file's own word
            raise ReadError(f"{error}; or state the unit in a mapping, in place of the file's") from error
        raise


def scale_of(table: Table, entry: Entry, si: str) -> float:
    """Factor from an entry's column to SI units, without the offset."""
    return entry.factor * _factor(table.find(entry.column), entry, si)


def one_unit(table: Table, entries: Iterable[Entry]) -> None:
    """Raise ReadError where a file states several units of one quantity and the mapping none."""
    stated = {(entry.path, table.find(entry.column).unit) for entry in entries if entry.unit is None}
    units = {unit for _, unit in stated if unit}
    if any(not agree(a, b) for a in units for b in units):
        shown = ", ".join(f"{path} in {unit}" for path, unit in sorted(stated, key=str))
        raise ReadError(f"the file mixes units ({shown}); state the unit of each in the mapping")

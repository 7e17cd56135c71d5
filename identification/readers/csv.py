"""CSV and text tables with decimal point or comma; comma, semicolon, tab or spaces as delimiter.

The layout is found by `csv_layout`; every line below the heading must be a full row. An empty cell is a missing value.
A column with what is not a number has a fault that names line and column; it is never interpreted, and where no mapping
takes the column it does no harm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from identification.errors import ReadError
from identification.readers.csv_layout import LATIN, Layout, cells, find_layout, is_number, opened
from identification.records.table import MAX_VALUES, Column, Table, parse_header
from rotorsim.base.sentences import quote

SWAP = str.maketrans(",.", ".,")
MAX_LINE = 1_000_000
"""Longest line, in characters."""


def read_csv(path: Path, file: dict[str, str] | None = None) -> Table:
    """Table of a text file; `file` may state delimiter and decimal sign (see `identification.records.mapping`)."""
    try:
        layout = find_layout(path, file or {}, MAX_LINE)
        values, faults = _numbers(path, layout, "decimal" in (file or {}))
    except UnicodeDecodeError as error:
        name = (file or {}).get("encoding", "UTF-8")
        raise ReadError(
            f"byte {error.start + 1}: is no text in {name}; state another, e.g. [file] encoding = 'latin-1'"
        ) from error
    header = parse_header(layout.header) if layout.header else None
    if header and len(values) != header.samples:
        raise ReadError(f"{len(values)} rows, its header states {header.samples}; the file was cut off: copy it again")
    columns = enumerate(zip(layout.names, values.T, strict=True))
    notes = (f"read as {LATIN}, for it is not UTF-8; state another as [file] encoding",)
    guessed = layout.encoding == LATIN and "encoding" not in (file or {})
    found = tuple(Column(name, column, unit, fault=faults.get(i, "")) for i, ((name, unit), column) in columns if name)
    if all(column.fault for column in found):
        raise ReadError(found[0].fault if found else "no column with a name; name them in the heading")
    return Table("CSV", found, header=header, notes=notes if guessed else ())


def _numbers(path: Path, layout: Layout, stated: bool) -> tuple[np.ndarray, dict[int, str]]:
    """The numbers (rows, columns), the fast way if all are whole and good, and the columns with a fault."""
    guesses = [layout]
    if not stated and not layout.comma and layout.delimiter != ",":
        # the first row may be whole numbers, which do not show the decimal sign
        guesses.append(replace(layout, comma=True))
    for guess in guesses:
        try:
            return _fast(path, guess), {}
        except UnicodeDecodeError:
            raise
        except ValueError:
            continue
    found = _first_sign(path, layout) if len(guesses) > 1 else layout.comma
    return _careful(path, replace(layout, comma=found))


def _first_sign(path: Path, layout: Layout) -> bool:
    """Whether the first decimal sign among the numbers is a comma."""
    for line in _lines(path, layout):
        for sign in line:
            if sign in ",.":
                return sign == ","
    return False


def _lines(path: Path, layout: Layout) -> Iterator[str]:
    """The lines of numbers; where the comma is the decimal sign it becomes a point, and a point no number."""
    with opened(path, layout.encoding) as file:
        for _ in range(layout.first):
            file.readline()
        if not layout.comma:
            yield from file
        else:
            for line in file:
                yield line.translate(SWAP)


def _fast(path: Path, layout: Layout) -> np.ndarray:
    whole = layout.first and not layout.comma  # a first line of numbers may have a byte order mark before it
    values = np.loadtxt(
        path if whole else _lines(path, layout),
        delimiter=layout.delimiter,
        skiprows=layout.first if whole else 0,
        comments=None,
        ndmin=2,
        encoding=layout.encoding,
    )
    if values.shape[1] != len(layout.names):
        raise ValueError("ragged")
    return values


def _careful(path: Path, layout: Layout) -> tuple[np.ndarray, dict[int, str]]:
    """The same numbers with NaN for empty cells, and the first fault of a column that has one.

    Raises ReadError, with its line, for a row of another length.
    """
    rows, width, short = [], len(layout.names), ""
    faults: dict[int, str] = {}
    for number, line in enumerate(_lines(path, layout), layout.first + 1):
        if len(line) > MAX_LINE:
            raise ReadError(f"line {number}: is longer than {MAX_LINE} characters; is it a table?")
        if not line.strip():
            continue
        if short:
            raise ReadError(short)
        found = cells(line, layout.delimiter)
        if len(found) != width:
            # raised only once the next line shows whether it is the last one
            short = f"line {number}: {len(found)} cells, expected {width}; correct or remove the line"
            continue
        rows.append([_number(cell, number, i, layout, faults) for i, cell in enumerate(found)])
        if len(rows) * width > MAX_VALUES:
            raise ReadError(f"more than {MAX_VALUES} values; cut the file")
    if short:
        raise ReadError(short.replace("correct or remove the line", "the file may be cut off: copy it again"))
    return np.array(rows, float).reshape(-1, width), faults


def _number(cell: str, line: int, column: int, layout: Layout, faults: dict[int, str]) -> float:
    if not cell or column in faults:
        return np.nan
    if is_number(cell):
        return float(cell)
    name = layout.names[column][0] or str(column + 1)
    cell = cell.translate(SWAP) if layout.comma else cell
    faults[column] = f"line {line}, column {quote(name)}: {quote(cell)} is not a number; correct or remove the line"
    return np.nan

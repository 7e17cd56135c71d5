"""Tables of a result as a workbook (.xlsx): a sheet for all variables over the same axes, units in the heads.

Written with openpyxl (`pip install "rotorsim[xlsx]"`). Numbers are in SI units, as in the netCDF file.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.base.files import replacing

MOST_ROWS = 1_048_575
"""Rows of a sheet below its head."""
MOST_TEXT = 32_000
"""Characters that a cell holds."""
LONGEST_NAME = 31
"""Characters of the name of a sheet."""


def write_workbook(found: xr.Dataset, path: str | Path) -> dict[str, int]:
    """Write a result or record as .xlsx; returns the number of rows of each sheet.

    Raises
    ------
    DataError
        Without openpyxl, for another ending of the file, or for more rows than a sheet has.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> sheets = rs.report.write_workbook(found, "campbell.xlsx")  # doctest: +SKIP
    """
    try:
        from openpyxl import Workbook
    except ImportError as error:
        raise DataError("xlsx needs the package openpyxl; pip install 'rotorsim[xlsx]'") from error
    path = Path(path)
    if path.suffix != ".xlsx":
        raise DataError(f"{path}: does not end in .xlsx; give it that ending", argument="path", value=str(path))
    sheets = tables(found)
    for name, (_, size, _) in sheets.items():
        if size > MOST_ROWS:
            raise DataError(
                f"{path}: '{name}' has {size} rows, and a sheet {MOST_ROWS}; cut the record, or write .csv",
                argument="path",
                value=str(path),
            )
    book = Workbook(write_only=True)
    for name, (head, _, rows) in sheets.items():
        sheet = book.create_sheet(name)
        sheet.append(head)
        for row in rows:
            sheet.append(row)
    with replacing(path) as part:
        book.save(part)
    return {name: size for name, (_, size, _) in sheets.items()}


def tables(found: xr.Dataset) -> dict[str, tuple[list[str], int, Iterator[list[Any]]]]:
    """Head, number of rows and rows of each sheet: one a set of axes, one of the attributes."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, one in found.data_vars.items():
        groups.setdefault(tuple(map(str, one.dims)), []).append(str(name))
    sheets: dict[str, tuple[list[str], int, Iterator[list[Any]]]] = {}
    for dims, names in groups.items():
        title = _title(" x ".join(dims) or "values", sheets)
        size = int(np.prod([found.sizes[dim] for dim in dims], dtype=int))
        head = [_head(found, one) for one in (*dims, *names)]
        sheets[title] = head, size, _rows(found, dims, names)
    about = [[str(key), str(value)[:MOST_TEXT]] for key, value in found.attrs.items()]
    sheets[_title("about", sheets)] = ["attribute", "value"], len(about), iter(about)
    return sheets


def _title(text: str, taken: dict[str, Any]) -> str:
    """A name of a sheet that is short enough and not taken."""
    short = "".join(" " if sign in "[]:*?/\\" else sign for sign in text)[:LONGEST_NAME]
    number = 2
    while short in taken:
        end = f" {number}"
        short, number = short[: LONGEST_NAME - len(end)] + end, number + 1
    return short


def _head(found: xr.Dataset, name: str) -> str:
    unit = found[name].attrs.get("units", "") if name in found.variables else ""
    return f"{name} [{unit}]" if unit and unit != "1" else name


def _rows(found: xr.Dataset, dims: tuple[str, ...], names: list[str]) -> Iterator[list[Any]]:
    axes = [found[dim].values if dim in found.variables else np.arange(found.sizes[dim]) for dim in dims]
    values = [found[name].values for name in names]
    for place in product(*(range(len(axis)) for axis in axes)):
        yield [_cell(axis[k]) for axis, k in zip(axes, place, strict=True)] + [_cell(one[place]) for one in values]


def _cell(value: Any) -> Any:
    """A number or text of Python; None where a number is missing."""
    plain = value.item() if isinstance(value, (np.generic, np.ndarray)) else value
    if isinstance(plain, float):
        return plain if np.isfinite(plain) else None
    return plain if isinstance(plain, (bool, int)) else str(plain)[:MOST_TEXT]

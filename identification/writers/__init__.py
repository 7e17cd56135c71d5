"""Writers of records and run-up vectors; a file is replaced only once it is complete.

What is written here `identification.read` reads back as the same Dataset.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from identification.errors import SchemaError
from identification.records.schema import named_axes
from identification.records.validate import validate
from identification.writers.csv import write_csv
from identification.writers.mat import write_mat
from identification.writers.netcdf import write_netcdf

if TYPE_CHECKING:
    import xarray as xr


def save(record: xr.Dataset, path: str | Path) -> Path:
    """Write a record or run-up vectors as .csv, .mat (v5) or .nc (netCDF-4), by the suffix.

    Raises
    ------
    SchemaError
        If the record does not fit the schema, the suffix is another, or the format cannot hold part of it.
    WriteError
        If the file cannot be written; what was there stays.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.save(record, "copy.mat").name
    'copy.mat'
    """
    path = Path(path)
    writer = _writer(path)
    record = named_axes(validate(record))
    writer(record, path)
    return path


def _writer(path: Path) -> Callable[[xr.Dataset, Path], None]:
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return write_csv
    if suffix == ".mat":
        return write_mat
    if suffix == ".nc":
        return write_netcdf
    raise SchemaError(f"{path}: unknown suffix {suffix!r}; write .csv, .mat or .nc")

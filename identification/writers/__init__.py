"""Writers of records and run-up vectors; a file is replaced only once it is complete.

What is written here `identification.read` reads back as the same Dataset; .csv and .mat have no place for what is not
over time (snapshots of the film), which the notes of the written record name, and several bearings are columns alone.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from identification.errors import SchemaError
from identification.records.schema import named_axes
from identification.records.validate import validate
from identification.writers.csv import write_csv
from identification.writers.flat import over_time
from identification.writers.mat import write_mat
from identification.writers.netcdf import write_netcdf

if TYPE_CHECKING:
    import xarray as xr


def save(record: xr.Dataset, path: str | Path) -> Path:
    """Write a record or run-up vectors as .csv, .mat (v5) or .nc (netCDF-4), by the suffix.

    What is not over time is left out of .csv and .mat, see `held`.

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
    writer(held(named_axes(validate(record)), path), path)
    return path


def held(record: xr.Dataset, path: str | Path) -> xr.Dataset:
    """The part of a record that a file of this suffix holds; a note names what is left out of .csv and .mat.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.held(record, "run.csv").identical(record)
    True
    """
    return record if Path(path).suffix.lower() == ".nc" else over_time(record)


def _writer(path: Path) -> Callable[[xr.Dataset, Path], None]:
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return write_csv
    if suffix == ".mat":
        return write_mat
    if suffix == ".nc":
        return write_netcdf
    raise SchemaError(f"{path}: unknown suffix {suffix!r}; write .csv, .mat or .nc")

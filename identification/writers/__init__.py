"""Records and run-up vectors to files, each in one piece: the file is complete, or as it was before.

What is written here `identification.read` reads back as the same Dataset.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from identification.dataset import named_axes, validate
from identification.errors import SchemaError

if TYPE_CHECKING:
    import xarray as xr


def save(record: xr.Dataset, path: str | Path) -> Path:
    """Write a record or run-up vectors as .csv, .mat (v5) or .nc (netCDF-4), as the suffix says.

    Raises
    ------
    SchemaError
        If the record does not fit the schema, the suffix is another, or the format cannot hold part of it.
    OSError
        If the file cannot be written; what was there stays.
    """
    path = Path(path)
    writer = _writer(path)
    record = named_axes(validate(record))
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        writer(record, part)
        os.replace(part, path)
    except OSError as error:
        # h5py's own text is long and names the temporary file
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise OSError(error.errno, reason, str(path)) from error
    finally:
        part.unlink(missing_ok=True)
    return path


def _writer(path: Path) -> Callable[[xr.Dataset, Path], None]:
    suffix = path.suffix.lower()
    if suffix == ".csv":
        from identification.writers.csv import write_csv

        return write_csv
    if suffix == ".mat":
        from identification.writers.mat import write_mat

        return write_mat
    if suffix == ".nc":
        from identification.writers.netcdf import write_netcdf

        return write_netcdf
    raise SchemaError(f"{path}: unknown suffix {suffix!r}; write .csv, .mat or .nc")

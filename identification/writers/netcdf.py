"""netCDF-4 writer, the native format of records; keeps everything in a Dataset."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from identification.errors import SchemaError
from rotorsim.base import hdf5

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(record: xr.Dataset, path: Path) -> None:
    """Write a record or run-up vectors as netCDF-4."""
    try:
        hdf5.write_netcdf(path, record)
    except (TypeError, ValueError) as error:
        raise SchemaError(f"record: netCDF cannot hold part of it ({error}); drop or convert that") from error

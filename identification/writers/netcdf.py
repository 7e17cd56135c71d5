"""netCDF-4, the format in which rotorsim keeps records; it holds everything a Dataset holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from identification.errors import SchemaError

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(record: xr.Dataset, path: Path) -> None:
    """Write a record or run-up vectors as netCDF-4."""
    try:
        record.to_netcdf(path, engine="h5netcdf")
    except (TypeError, ValueError) as error:
        raise SchemaError(f"record: netCDF cannot hold part of it ({error}); drop or convert that") from error

"""netCDF-4 records written by rotorsim, which follow the schema."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from identification.errors import ReadError
from identification.readers.hdf5 import opened
from identification.records.schema import VARIABLES, named_axes
from rotorsim.base.file_kinds import NETCDF
from rotorsim.base.sentences import listing

if TYPE_CHECKING:
    import xarray as xr


def read_netcdf(path: Path) -> xr.Dataset:
    """Record from a netCDF file, in memory; raises ReadError if the file is damaged or another program's."""
    import xarray as xr

    with opened(path) as file:
        names = set(file)
        scales = {name for name in names if getattr(file[name], "is_scale", False)}
        kind = NETCDF.get(str(file.attrs.get("kind", "")), "")
    if kind:
        raise ReadError(f"is {kind}, not a record; give a record, e.g. runup.nc")
    if not scales & {"time", "speed"} or not (names - scales) & {*VARIABLES, "amplitude"}:
        raise ReadError(
            f"is HDF5 but no record of rotorsim, it holds {listing(sorted(names)) or 'nothing'}; export CSV"
        )
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="sort") as record:
            return named_axes(record.load())
    except Exception as error:  # h5py, h5netcdf and xarray answer damage with many kinds of exception
        raise ReadError("cannot be read as a record; it is damaged or another program wrote it") from error

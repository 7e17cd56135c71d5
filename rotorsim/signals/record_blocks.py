"""Opening of records of any length, and reading of their variables block by block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from identification.records.schema import named_axes
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import check_hdf5

BLOCK = 100_000
"""Samples read at a time."""
Values = dict[str, np.ndarray]


def open_record(path: str | Path) -> xr.Dataset:
    """Open a record without reading it, not even its time axis where xarray allows that; raises DataError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.open_record("run.nc")["disc"].sel(axis="x").sizes["time"] > 0
    True
    """
    try:
        if wrong := check_hdf5(Path(path)):
            raise DataError(f"{path}: {wrong}")
        return named_axes(_opened(path))
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as a record ({error}); give a file that a run wrote") from error


def _opened(path: str | Path) -> xr.Dataset:
    try:
        return xr.open_dataset(path, engine="h5netcdf", create_default_indexes=False)
    except TypeError:  # an xarray before that option
        return xr.open_dataset(path, engine="h5netcdf")


def displacement_name(record: xr.Dataset) -> str:
    """`disc` of a virtual record, `disc_measured` of a measured one; raises DataError without either."""
    for name in ("disc", "disc_measured"):
        if name in record:
            return name
    raise DataError("record: neither 'disc' nor 'disc_measured'; give the displacement of the disc")


def blocks(record: xr.Dataset, names: Sequence[str], size: int = BLOCK) -> Iterator[Values]:
    """Values of some variables, block after block of time."""
    missing = [name for name in names if name not in record.variables]
    if missing:
        raise DataError(f"record: no variable '{missing[0]}'; it is needed for this analysis")
    for start in range(0, record.sizes["time"], size):
        part = record.isel(time=slice(start, start + size))
        yield {name: np.asarray(part[name].values, float) for name in names}

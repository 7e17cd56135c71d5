"""Atomic writes of netCDF-4 files with disk errors kept away from libhdf5 (see `rotorsim.base.hdf5`)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rotorsim.base.files import replacing
from rotorsim.base.hdf5 import CommittedFile
from rotorsim.base.hdf5_check import trust_hdf5
from rotorsim.base.interrupt import Interrupt

if TYPE_CHECKING:
    import xarray as xr


@contextmanager
def replacing_hdf5(path: str | Path) -> Iterator[CommittedFile]:
    """File object for libhdf5 that becomes `path` at the end of the block; raises WriteError.

    Ctrl-C waits until then: in a callback from libhdf5 it would leave a file there that cannot be closed.
    """
    with Interrupt() as interrupt, replacing(path) as part, CommittedFile(part) as file:
        yield file
        file.finish()
    trust_hdf5(Path(path))
    if interrupt.asked:
        raise KeyboardInterrupt


def write_netcdf(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset as netCDF-4 in one step.

    Raises
    ------
    WriteError
        If the file cannot be written; what was at `path` stays.
    TypeError, ValueError
        If netCDF cannot hold part of the dataset.
    """
    with replacing_hdf5(path) as file:
        dataset.to_netcdf(file, engine="h5netcdf")

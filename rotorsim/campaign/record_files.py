"""Record files of a store: a fast netCDF-4 writer through h5py alone, and lazy arrays over many records.

netCDF-4 is HDF5 with dimension scales (netCDF file format specification, netCDF-4/HDF5). Dimensions are of fixed size
and variables contiguous, so a slice of time is one read; the bytes depend on the content alone. Writing takes a fifth
of a general writer's time per file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.hdf5 import DiskFile
from rotorsim.campaign.errors import StoreError
from rotorsim.signals.record_blocks import blocks

if TYPE_CHECKING:
    import h5py
    import xarray as xr

NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
PROPERTIES = "version=2,rotorsim=1"
WIDTH = 10
SNAPSHOTS = ("film_pressure", "snapshot_time", "snapshot_speed")


def write_record(path: Path, data: xr.Dataset, attrs: Mapping[str, Any], keep: tuple[str, ...] | None) -> None:
    """Write a record with the selected variables.

    Raises OSError if the disk takes no more; what is then in the file is of no use.

    Parameters
    ----------
    path : Path
        File to write; replaced if it is there.
    data : Dataset
        The record, in memory or in a file.
    attrs : mapping
        Attributes of the file.
    keep : tuple of str, optional
        Variables to keep; all if not given. Snapshots of the film go by the name of `film_pressure`.
    """
    import h5py

    path.unlink(missing_ok=True)
    with DiskFile(path) as disk:
        with h5py.File(disk, "w", track_order=True, libver="v110") as file:
            _write(file, data, attrs, keep)
        disk.finish()


def _write(file: h5py.File, data: xr.Dataset, attrs: Mapping[str, Any], keep: tuple[str, ...] | None) -> None:
    names = sorted(str(name) for name in data.data_vars if _kept(str(name), keep))
    file.attrs["_NCProperties"] = np.bytes_(PROPERTIES)
    for name, value in sorted(attrs.items()):
        file.attrs[name] = value
    scales = _dimensions(file, data, names)
    extra = sorted(str(name) for name in data.coords if name not in scales and set(data[name].dims) <= set(scales))
    for name in (*names, *extra):
        _variable(file, data, name, scales)
        own = [c for c in extra if name not in extra and set(data[c].dims) <= set(data[name].dims)]
        if own:
            file[name].attrs["coordinates"] = " ".join(own)
    _fill(file, data, [name for name in names if data[name].dims[0] == "time"])


def _kept(name: str, keep: tuple[str, ...] | None) -> bool:
    return keep is None or ("film_pressure" if name in SNAPSHOTS else name) in keep


def _dimensions(file: h5py.File, data: xr.Dataset, names: Iterable[str]) -> dict[str, h5py.Dataset]:
    """Scales of all dimensions, filled but for the time."""
    used = dict.fromkeys(["time", *(str(dim) for name in names for dim in data[name].dims)])
    scales = {}
    for number, name in enumerate(used):
        size = data.sizes[name]
        if name in data.coords:
            values = None if name == "time" else _plain(data[name].values)
            scale = file.create_dataset(name, (size,), "f8" if values is None else values.dtype, values)
            scale.make_scale(name)
            _label(scale, data[name].attrs)
        else:
            scale = file.create_dataset(name, (size,), ">f4")
            scale.make_scale(f"{NO_VARIABLE}{size:{WIDTH}}")
        scale.attrs["_Netcdf4Dimid"] = np.int32(number)
        scales[name] = scale
    return scales


def _variable(file: h5py.File, data: xr.Dataset, name: str, scales: Mapping[str, h5py.Dataset]) -> None:
    timed = data[name].dims[0] == "time"
    values = None if timed else _plain(data[name].values)
    variable = file.create_dataset(name, data[name].shape, data[name].dtype if timed else None, values)
    for place, dim in enumerate(data[name].dims):
        variable.dims[place].attach_scale(scales[str(dim)])
    _label(variable, data[name].attrs)


def _label(variable: h5py.Dataset, attrs: Mapping[Any, Any]) -> None:
    for name in ("units", "long_name"):
        if name in attrs:
            variable.attrs[name] = attrs[name]


def _fill(file: h5py.File, data: xr.Dataset, names: list[str]) -> None:
    first = 0
    for block in blocks(data, ["time", *names]):
        last = first + len(block["time"])
        for name, values in block.items():
            file[name][first:last] = values
        first = last


def _plain(values: np.ndarray) -> np.ndarray:
    """Values as the file holds them: text as netCDF's strings."""
    import h5py

    return values.astype(h5py.string_dtype()) if values.dtype.kind in "UO" else values


CHUNK = 64_000_000
"""Approximate size [byte] of a chunk of a lazy array."""


@dataclass(frozen=True)
class StackedVariable:
    """Array (case, *shape) read from its files on indexing; shorter records are padded with NaN."""

    paths: tuple[Path, ...]
    name: str
    record: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def shape(self) -> tuple[int, ...]:
        """Cases first."""
        return (len(self.paths), *self.record)

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.shape)

    def __getitem__(self, where: tuple[Any, ...]) -> np.ndarray:
        """Values at one index per dimension: a number, a slice or a list of numbers, each dimension by itself."""
        cases, *rest = (_places(one, size) for one, size in zip(where, self.shape, strict=True))
        spans = tuple(slice(min(numbers, default=0), max(numbers, default=-1) + 1) for numbers in rest)
        block = np.full((len(cases), *(span.stop - span.start for span in spans)), self._missing, self.dtype)
        for row, case in zip(block, cases, strict=True):
            found = _read(self.paths[case], self.name, spans)
            row[tuple(slice(n) for n in found.shape)] = found
        for axis, (numbers, span) in enumerate(zip(rest, spans, strict=True), start=1):
            if numbers != range(span.start, span.stop):  # backwards, with steps, or picked
                block = block.take([number - span.start for number in numbers], axis)
        return block[tuple(0 if isinstance(one, (int, np.integer)) else slice(None) for one in where)]

    @property
    def _missing(self) -> Any:
        return np.nan if self.dtype.kind == "f" else 0


def _places(where: Any, size: int) -> Sequence[int]:
    """The numbers that an index stands for."""
    if isinstance(where, slice):
        return range(size)[where]
    return [range(size)[number] for number in np.ravel(where)]


def _read(path: Path, name: str, where: tuple[slice, ...]) -> np.ndarray:
    with opened(path) as file:
        return np.asarray(file[name][where])


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open record file; raises StoreError if it cannot be read.

    It is not read in a child process first as files of others are: its size is that of the file that was written.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except (OSError, KeyError, RuntimeError, ValueError) as error:
        raise StoreError(f"{path}: cannot be read ({error}); remove it and run the campaign again") from error


def stacked(variable: StackedVariable) -> Any:
    """Dask array of a variable over all cases."""
    import dask.array as da

    size = int(np.prod(variable.record)) * variable.dtype.itemsize
    together = int(np.clip(CHUNK // max(size, 1), 1, len(variable.paths)))
    first = variable.record[0] if size <= CHUNK else max(1, variable.record[0] * CHUNK // size)
    return da.from_array(
        variable, chunks=(together, first, *variable.record[1:]), name=False, meta=np.empty(0, variable.dtype)
    )

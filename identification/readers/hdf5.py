"""HDF5 files: safe opening, netCDF records of rotorsim, and vectors of other programs.

A child process reads a file first, because a damaged one can crash libhdf5 or keep it busy for ever. Links to other
files, external and virtual datasets are refused, because a file must not make the reader open others, and so is more
data than the file can hold.

Other programs' files have vectors and matrices of numbers at the top or one group below it. A data set gives a column,
a matrix one for each of its shorter dimension (MATLAB writes matrices turned round). Units are taken from the attribute
`units` or `unit`, clocks from `dt` or a sample rate and `t0`, scales and missing values by the conventions of netCDF
(`scale_factor`, `add_offset`, `_FillValue`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.readers import reader
from identification.records.columns import MAX_VALUES, Column, DataTable, not_read
from identification.records.schema import VARIABLES, named_axes
from rotorsim.base.display import listing, quote
from rotorsim.base.errors import ReadError
from rotorsim.base.hdf5 import check_hdf5
from rotorsim.base.input_files import NETCDF

if TYPE_CHECKING:
    import xarray as xr


HDF5 = rb"\x89HDF|(?!MATLAB).{512}\x89HDF"
"""First bytes of HDF5, behind a block of 512 bytes where a program put one; MATLAB's is another format."""
MAX_OBJECTS = 10_000
"""Most groups and data sets of a record."""


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """The file's root group, checked; raises ReadError if it is unsafe to read or refers to anything outside."""
    import h5py

    if wrong := check_hdf5(path):
        raise ReadError(wrong)
    with h5py.File(path, "r") as file:
        check(file)
        yield file


def check(root: Any) -> None:
    """Raise ReadError for links and datasets that lead out of the file, and for more data than can be read."""
    import h5py

    queue, seen = [root], 0
    while queue:
        group = queue.pop()
        for name in group:
            seen += 1
            if seen > MAX_OBJECTS:
                raise ReadError(f"holds more than {MAX_OBJECTS} objects; it is not a record")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ReadError(f"{quote(name)} is a link; store the data itself in the file")
            item = group[name]
            if isinstance(item, h5py.Dataset):
                check_dataset(name, item)
            elif isinstance(item, h5py.Group) and group is root:
                queue.append(item)


def check_dataset(name: str, dataset: Any) -> None:
    """Raise ReadError if a dataset lies outside the file or is too large."""
    if dataset.external or dataset.is_virtual:
        raise ReadError(f"{quote(name)} keeps its data in another file; store them in this one")
    if prod(dataset.shape or (0,)) > MAX_VALUES:
        raise ReadError(f"{quote(name)} declares {prod(dataset.shape)} values, above the limit of {MAX_VALUES}; cut it")


@reader(".nc", magic=HDF5, describes_itself=True)
def read_netcdf(path: Path) -> xr.Dataset:
    """Record from a netCDF file, in memory; raises ReadError if the file is another program's."""
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
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="sort") as record:
        return named_axes(record.load())


WIDEST = 64
UNIT, STEP, RATE = ("units", "unit"), ("dt", "wf_increment", "sample_interval"), ("fs", "sample_rate", "sampling_rate")
START = ("t0", "wf_start_offset", "start_time")
"""Attributes, in small letters, of a data set's unit, step [s], rate [Hz] and first time [s]."""
SCALE = ("scale_factor", "add_offset", "_fillvalue", "missing_value")
_ITS_OWN = ("dimension_list", "class", "name", "reference_list", "_netcdf4", "dimension_labels", "matlab_", "long_name")
"""Beginnings of attributes that HDF5, netCDF and MATLAB keep for themselves."""


@reader(".h5", ".hdf5", magic=HDF5)
def read_plain_hdf5(path: Path) -> DataTable:
    """Table of a file's numeric data sets; raises ReadError if there is none."""
    import h5py

    columns: list[Column] = []
    others: dict[str, str] = {}
    with opened(path) as file:
        for name, item in _items(file):
            if not isinstance(item, h5py.Dataset):
                continue
            check_dataset(name, item)
            if item.dtype.kind not in "fiub" or item.ndim not in (1, 2) or 0 in item.shape:
                others[name] = f"has shape {item.shape} of {item.dtype}; save vectors of numbers"
            elif item.ndim == 2 and min(item.shape) > WIDEST:
                others[name] = f"has shape {item.shape}, more than {WIDEST} columns; save vectors"
            else:
                columns += _columns(name, item)
        unread = [str(key) for key in file.attrs if not key.lower().startswith(_ITS_OWN)]
        groups = ((name, item) for name, item in file.items() if not isinstance(item, h5py.Dataset))
        unread += [f"{name}/{key}" for name, item in groups for key in item.attrs]
    if not columns:
        raise ReadError("holds no vector of numbers; save some")
    return DataTable("HDF5", tuple(columns), others, notes=not_read(unread))


def _items(file: Any) -> Iterator[tuple[str, Any]]:
    """Objects at the top, and in groups there as `group/name`."""
    for name, item in file.items():
        if hasattr(item, "items") and not name.startswith("#"):
            yield from ((f"{name}/{inner}", part) for inner, part in item.items())
        else:
            yield name, item


def _columns(name: str, item: Any) -> list[Column]:
    stated = {key.lower(): item.attrs[key] for key in item.attrs}
    taken = (*UNIT, *STEP, *RATE, *START, *SCALE)
    unread = tuple(key for key in item.attrs if key.lower() not in taken and not key.lower().startswith(_ITS_OWN))
    values = _scaled(np.asarray(item[()], float), stated)
    long = values.reshape(-1, 1) if values.ndim == 1 or 1 in values.shape else values
    long = long if long.shape[0] >= long.shape[1] else long.T
    time = _time(stated, len(long))
    made = partial(Column, unit=_unit(stated), time=time, unread=unread)
    if long.shape[1] == 1:
        return [made(name, long.ravel(), aliases=(name.rpartition("/")[2],))]
    return [made(f"{name}_{i + 1}", column) for i, column in enumerate(long.T)]


def _scaled(values: np.ndarray, stated: dict[str, Any]) -> np.ndarray:
    """Numbers as they are meant: missing ones NaN, then times `scale_factor` plus `add_offset`."""
    for key in ("_fillvalue", "missing_value"):
        if (missing := _number(stated, (key,))) is not None:
            values = np.where(values == missing, np.nan, values)
    scale, offset = _number(stated, ("scale_factor",)), _number(stated, ("add_offset",))
    values = values if scale is None else values * scale
    return values if offset is None else values + offset


def _time(stated: dict[str, Any], n: int) -> np.ndarray | None:
    """Times of a data set's samples [s], None where it states no step and no rate."""
    step, rate = _number(stated, STEP), _number(stated, RATE)
    step = 1 / rate if step is None and rate else step
    if not step or not 0 < step < np.inf:
        return None
    return (_number(stated, START) or 0.0) + np.arange(n) * step


def _number(stated: dict[str, Any], keys: tuple[str, ...]) -> float | None:
    """The first attribute that is one number."""
    for key in keys:
        value = np.ravel(np.asarray(stated.get(key)))
        if value.size == 1 and value.dtype.kind in "fiu":
            return float(value[0])
    return None


def _unit(stated: dict[str, Any]) -> str | None:
    for key in UNIT:
        found = stated.get(key)
        text = found.decode("utf-8", "replace") if isinstance(found, bytes) else found
        if isinstance(text, str) and text.strip():
            return text.strip()
    return None

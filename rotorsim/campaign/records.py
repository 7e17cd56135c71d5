"""Records of a store: their netCDF-4 files, lazy arrays over many of them, and the table of their summaries.

netCDF-4 is HDF5 with dimension scales (netCDF file format specification, netCDF-4/HDF5). Dimensions are of fixed size
and variables contiguous, so a slice of time is one read; the bytes depend on the content alone. Files are written
through h5py, in a fifth of a general writer's time.

Collected records are read when their numbers are asked for, some at a time, so a campaign may be larger than memory.
Cases are the first dimension; the axes of the plan are coordinates along it.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from rotorsim.base.files import replacing
from rotorsim.base.hdf5 import DiskFile
from rotorsim.campaign.plan import Plan
from rotorsim.campaign.store import DONE, IndexRow, StoreError, open_store, record_path
from rotorsim.signals.record_blocks import blocks, open_record

FIRST = ("number", "experiment", "repeat", "seed")
LAST = ("status", "error", "duration", "cpu", "bytes", "host", "versions", "finished", "attempts", "key")
NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
PROPERTIES = "version=2,rotorsim=1"
WIDTH = 10
SNAPSHOTS = ("film_pressure", "snapshot_time", "snapshot_speed")
CHUNK = 64_000_000
"""Approximate size [byte] of a chunk of a lazy array."""


@dataclass(frozen=True)
class FinishedCases:
    """Finished cases of one experiment in a store."""

    folder: Path
    plan: Plan
    experiment: str
    rows: tuple[IndexRow, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        """Records in the order of the rows."""
        return tuple(record_path(self.folder, row.key) for row in self.rows)


def collect(folder: str | Path, experiment: str | None = None, variables: Sequence[str] | None = None) -> xr.Dataset:
    """Records and summaries of all finished cases.

    Parameters
    ----------
    folder : Path
        The store; a campaign may be running in it.
    experiment : str, optional
        Name of the experiment in the plan; may be left out if there is only one.
    variables : sequence of str, optional
        Variables of the records; all that were kept if not given, none for an empty sequence.

    Returns
    -------
    Dataset
        Dimension `case` first, then those of a record, with dask arrays. Shorter records end in NaN. Coordinates along
        `case`: `number`, `key`, `seed`, `repeat` and the plan's axes [SI]. Summaries are variables with dotted names.

    Raises
    ------
    StoreError
        If there is no store, no such experiment, no such variable, or nothing is done yet.

    Examples
    --------
    >>> import rotorsim as rs
    >>> records = rs.campaign.collect("mine", "steady")
    """
    found = _finished(Path(folder), experiment)
    columns = {name: ("case", values) for name, values in _columns(found.rows).items()}
    data = xr.Dataset(columns, _coordinates(found), {"kind": "collected", "campaign": found.plan.name,
                                                           "experiment": found.experiment})  # fmt: skip
    if found.plan.keep == () or (variables is not None and not variables):
        return data
    records = _records(found, variables)
    return data.assign(records.data_vars).assign_coords(records.coords)


def _finished(folder: Path, experiment: str | None) -> FinishedCases:
    store = open_store(folder)
    names = [entry.name for entry in store.plan.entries]
    if experiment is None and len(names) > 1:
        raise StoreError(f"{folder}: has the experiments {', '.join(names)}; choose one of them as experiment")
    name = experiment or names[0]
    if name not in names:
        raise StoreError(
            f"{folder}: has no experiment '{name}'; choose one of {', '.join(names)}", argument="experiment", value=name
        )
    with closing(store.index()) as index:
        rows = tuple(index.rows(DONE, name))
    if not rows:
        raise StoreError(f"{folder}: no case of {name} is done yet; run the campaign first")
    return FinishedCases(folder, store.plan, name, rows)


def _coordinates(found: FinishedCases) -> dict[str, Any]:
    rows = found.rows
    coordinates: dict[str, Any] = {
        "number": ("case", np.array([row.number for row in rows])),
        "key": ("case", np.array([row.key for row in rows])),
        "seed": ("case", np.array([row.seed for row in rows])),
        "repeat": ("case", np.array([row.repeat for row in rows])),
    }
    entry = next(entry for entry in found.plan.entries if entry.name == found.experiment)
    for axis in found.plan.axes_of(entry):
        if axis.name != "seed":
            values = np.array([row.parameters[axis.name] for row in rows])
            attrs = {} if axis.target.unit is None else {"units": axis.target.unit}
            coordinates[f"set_{axis.name}"] = ("case", values, attrs)
    return coordinates


def _columns(rows: Iterable[IndexRow]) -> dict[str, Any]:
    """Summaries by name; numbers where all are, with NaN for what is missing."""
    rows = list(rows)
    names = list(dict.fromkeys(name for row in rows for name in row.summary))
    columns = {}
    for name in names:
        values = [row.summary.get(name) for row in rows]
        words = any(isinstance(value, str) for value in values)
        columns[name] = np.array([str(v) for v in values] if words else [np.nan if v is None else v for v in values])
    return columns


def _records(found: FinishedCases, variables: Sequence[str] | None) -> xr.Dataset:
    _check_sizes(found)
    lengths = _lengths(found)
    longest = int(lengths.argmax())
    with open_record(found.paths[longest]) as sample:
        names = [str(name) for name in sample.data_vars] if variables is None else list(variables)
        for name in names:
            if name not in sample.data_vars:
                known = ", ".join(map(str, sample.data_vars))
                raise StoreError(f"{found.folder}: no variable '{name}' in its records; choose of {known}")
        arrays = {
            name: (
                ("case", *sample[name].dims),
                stacked(StackedVariable(found.paths, name, sample[name].shape, sample[name].dtype)),
                dict(sample[name].attrs),
            )
            for name in names
        }
        coordinates = {name: sample[name].load() for name in sample.coords}
    return xr.Dataset(arrays, coordinates).assign_coords(samples=("case", lengths))


def _check_sizes(found: FinishedCases) -> None:
    """Raise StoreError for records that are not as long as they were written."""
    lost = [path for path, row in zip(found.paths, found.rows, strict=True) if _size(path) != row.bytes]
    if lost:
        raise StoreError(
            f"{lost[0]}: is gone or cut, as {len(lost)} of {len(found.rows)} records are; "
            "run the campaign again, which makes them anew",
            argument="records",
            value=lost,
        )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return -1


def _lengths(found: FinishedCases) -> np.ndarray:
    """Samples of every record, from the summary or, without one, from the file."""
    samples = [row.summary.get("numbers.samples") for row in found.rows]
    if all(n is not None for n in samples):
        return np.array(samples, int)
    lengths = []
    for path in found.paths:
        with opened(path) as file:
            lengths.append(file["time"].shape[0])
    return np.array(lengths, int)


def write_table(folder: str | Path, path: str | Path) -> int:
    """Write parameters, status and summary of every case into a CSV file; returns the number of cases.

    Examples
    --------
    >>> import rotorsim as rs
    >>> cases = rs.campaign.write_table("mine", "cases.csv")
    """
    store = open_store(folder)
    with closing(store.index()) as index:
        names = header(store.plan, index.rows())
        with replacing(Path(path)) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer, count = csv.writer(file), 0
            writer.writerow(names)
            for row in index.rows():
                writer.writerow(line(row, names))
                count += 1
    return count


def header(plan: Plan, rows: Iterable[IndexRow]) -> tuple[str, ...]:
    """Column names of the table: axis values, results, status; values in SI."""
    axes = [f"set.{axis.name}" for axis in plan.axes if axis.name != "seed"]
    found = dict.fromkeys(name for row in rows for name in row.summary)
    return (*FIRST, *axes, *found, *LAST)


def line(row: IndexRow, names: Iterable[str]) -> list[Any]:
    """Values of a row; empty where there is none."""
    own = set(FIRST + LAST)
    values = {f"set.{name}": value for name, value in row.parameters.items()} | row.summary
    return [getattr(row, name) if name in own else values.get(name) for name in names]


def write_record(path: Path, data: xr.Dataset, attrs: Mapping[str, Any], keep: tuple[str, ...] | None) -> None:
    """Write a record with the variables to keep, all if None; snapshots of the film go by the name of `film_pressure`.

    Raises OSError if the disk takes no more; what is then in the file is of no use.
    """
    path.unlink(missing_ok=True)
    with DiskFile(path) as disk:
        with h5py.File(disk, "w", track_order=True, libver="v110") as file:
            _write(file, data, attrs, keep)
        disk.finish()


def _write(file: h5py.File, data: xr.Dataset, attrs: Mapping[str, Any], keep: tuple[str, ...] | None) -> None:
    known = {str(name): "film_pressure" if name in SNAPSHOTS else str(name) for name in data.data_vars}
    names = sorted(name for name, kept_as in known.items() if keep is None or kept_as in keep)
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
    return values.astype(h5py.string_dtype()) if values.dtype.kind in "UO" else values


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

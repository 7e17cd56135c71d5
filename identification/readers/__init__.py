"""Readers of measured data, one per file format; importing this package registers them all.

Nothing in a file is ever evaluated or unpickled. A reader gives a `DataTable` of columns; mapping and units come after.
A new format is one file of this folder with a function under `registry.reader`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping as Tables
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ReadError, SchemaError
from identification.readers.registry import Reader, reader_of
from identification.records.assemble import CLIPPED, assemble, left_out, provenance, used
from identification.records.clocks import on_one_clock
from identification.records.column_names import recognise
from identification.records.mapping import load_mapping
from identification.records.runout import without_slow_roll
from identification.records.schema import validate, with_notes

if TYPE_CHECKING:
    import xarray as xr

    from identification.records.mapping import Mapping
    from identification.records.table import DataTable

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)


def read(path: str | Path, mapping: str | Path | Tables[str, Any] | Mapping | None = None) -> xr.Dataset:
    """Record, or run-up vectors, of the schema from a file.

    Parameters
    ----------
    path : CSV, MATLAB .mat (v5, v7.3), UFF dataset 58, TDMS, WAV, HDF5, a netCDF record of rotorsim, or the folder that
        a run wrote with one in it
    mapping : which column is which channel (see `identification.records.mapping`): TOML file or its tables; without
        one, columns that are named like the schema's variables are taken

    Raises
    ------
    ReadError
        If the file or the mapping cannot be read.
    SchemaError
        If what was read has gaps, NaN, falling time or another fault; both begin with the file's name.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.read("run.csv")["disc"].dims
    ('time', 'axis')
    """
    try:
        return checked(load(path, mapping))
    except SchemaError as error:
        raise SchemaError(_named(path, error)) from error


def checked(record: xr.Dataset) -> xr.Dataset:
    """The record of `load` if it fits the schema and no sensor is clipped; raises SchemaError otherwise.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.checked(record).sizes["axis"]
    2
    """
    if limits := record.attrs.get(CLIPPED):
        first = limits if isinstance(limits, str) else limits[0]
        raise SchemaError(f"clipped signal: {first}; widen the sensor's range and record again")
    return validate(record)


@np.errstate(over="ignore", invalid="ignore")  # what is too large becomes infinite and is refused as that
def load(path: str | Path, mapping: str | Path | Tables[str, Any] | Mapping | None = None) -> xr.Dataset:
    """As `read`, but time series come as they are, with their gaps and NaN.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.load("run.csv").sizes["axis"]
    2
    """
    path = _regular(path)
    mapped = load_mapping(mapping) if mapping is not None else None
    try:
        chosen = reader_of(path)
        record = _itself(chosen, path, mapped) if chosen.describes_itself else _from_columns(path, mapped)
        if mapped is None or mapped.slow_roll is None:
            return record
        how = mapped.slow_roll
        slow = read(how.file, replace(mapped, slow_roll=None, conditions={})) if how.file else None
        return without_slow_roll(record, how, slow)
    except (ReadError, SchemaError) as error:
        raise type(error)(_named(path, error)) from error


def _from_columns(path: Path, mapped: Mapping | None) -> xr.Dataset:
    table = columns(path, mapped)
    if mapped is None or not mapped.maps_columns:
        mapped = replace(recognise(table), conditions=mapped.conditions if mapped else {})
    table, notes = on_one_clock(table, mapped, used(mapped))
    record = with_notes(assemble(table, mapped), [*notes, *left_out(table, mapped)])
    return record.assign_attrs(provenance(table, mapped, path.name, _digest(path)))


def columns(path: str | Path, mapping: Mapping | None = None) -> DataTable:
    """The columns of a file as they are; raises ReadError if it is none of the formats.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.identification.columns("run.csv").columns) > 0
    True
    """
    path = _regular(path)
    chosen = reader_of(path)
    try:
        return chosen.table(path, mapping.file if mapping else {})
    except ReadError as error:
        raise ReadError(_named(path, error)) from error
    except MemoryError as error:
        raise ReadError(f"{path}: is too large for this machine's memory; cut it") from error


def _itself(chosen: Reader, path: Path, mapping: Mapping | None) -> xr.Dataset:
    if mapping is not None and mapping.maps_columns:
        raise ReadError("a netCDF record describes itself; leave the mapping out, or all of it but [conditions]")
    return chosen.record(path).assign_attrs(mapping.conditions if mapping else {})


def in_folder(path: Path) -> Path:
    """The netCDF file in the folder that a run wrote; any other path as it is.

    Raises ReadError for a folder with several.
    """
    inside = sorted(path.glob("*.nc")) if path.is_dir() else []
    if len(inside) > 1:
        raise ReadError(f"{path}: holds {', '.join(one.name for one in inside[:3])}; give the path of one of them")
    return inside[0] if inside else path


def _regular(path: str | Path) -> Path:
    path = in_folder(Path(path))
    if path.is_symlink() and not path.exists():
        raise ReadError(f"{path}: is a link to a file that is not there; give the path of a record")
    if not path.exists():
        raise ReadError(f"{path}: is not there; give the path of a record")
    if not path.is_file():
        raise ReadError(f"{path}: is not a file; give the path of a record")
    if path.stat().st_size == 0:
        raise ReadError(f"{path}: is empty; record or export it again")
    return path


def _named(path: str | Path, error: Exception) -> str:
    text = str(error)
    return text if text.startswith(f"{path}: ") else f"{path}: {text}"


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

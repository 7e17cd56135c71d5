"""Readers of measured data, one per file format, chosen by the file's first bytes and its suffix.

Nothing in a file is ever evaluated or unpickled. A reader gives a `Table` of columns; mapping and units come after.
"""

from __future__ import annotations

import hashlib
from codecs import BOM_UTF8
from collections.abc import Mapping as Tables
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ReadError, SchemaError
from identification.readers.csv import read_csv
from identification.readers.mat import read_mat
from identification.readers.mat73 import read_mat73
from identification.readers.netcdf import read_netcdf
from identification.readers.plain_hdf5 import read_plain_hdf5
from identification.readers.tdms import read_tdms
from identification.readers.uff import read_uff
from identification.readers.wav import read_wav
from identification.records.assemble import CLIPPED, assemble, left_out, provenance, used
from identification.records.clocks import on_one_clock
from identification.records.column_names import recognise
from identification.records.lab.slow_roll import without_slow_roll
from identification.records.mapping import load_mapping
from identification.records.notes import with_notes
from identification.records.validate import validate
from rotorsim.base.file_kinds import instead

if TYPE_CHECKING:
    import xarray as xr

    from identification.records.mapping import Mapping
    from identification.records.table import Table

HDF5 = (".h5", ".hdf5")
TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc")
_REFUSED = {
    b"PK\x03\x04": "is a spreadsheet or another zip archive; export it as CSV",
    b"CDF": "is classic netCDF; convert it with 'nccopy -k nc4'",
    b"\x93NUMPY": "is a NumPy array without names and units; use identification.from_arrays and save",
    b"\x80": "looks like a Python pickle, which is never opened; export it as CSV",
    b"\x1f\x8b": "is compressed; unpack it first",
}


def read(path: str | Path, mapping: str | Path | Tables[str, Any] | Mapping | None = None) -> xr.Dataset:
    """Record, or run-up vectors, of the schema from a file.

    Parameters
    ----------
    path : CSV, MATLAB .mat (v5, v7.3), UFF dataset 58, TDMS, WAV, HDF5, or a netCDF record of rotorsim
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
        record = _record(path, mapped) if format_of(path) == "netcdf" else _from_columns(path, mapped)
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


def columns(path: str | Path, mapping: Mapping | None = None) -> Table:
    """The columns of a file as they are; raises ReadError if it is none of the formats.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.identification.columns("run.csv").columns) > 0
    True
    """
    path = _regular(path)
    kind = format_of(path)
    try:
        if kind == "csv":
            return read_csv(path, mapping.file if mapping else {})
        if kind == "mat":
            return read_mat(path)
        if kind == "mat73":
            return read_mat73(path)
        if kind == "uff":
            return read_uff(path)
        if kind == "tdms":
            return read_tdms(path)
        if kind == "wav":
            return read_wav(path)
        if kind == "hdf5":
            return read_plain_hdf5(path)
        raise ReadError("is netCDF; a record of rotorsim needs no mapping, another file must come as CSV or .mat")
    except ReadError as error:
        raise ReadError(_named(path, error)) from error
    except MemoryError as error:
        raise ReadError(f"{path}: is too large for this machine's memory; cut it") from error


def format_of(path: Path) -> str:
    """csv, mat, mat73, uff, tdms, wav, hdf5 or netcdf; raises ReadError for anything else."""
    with path.open("rb") as file:
        start = file.read(1024).removeprefix(BOM_UTF8)
    if start.startswith(b"\x89HDF") or start[512:].startswith(b"\x89HDF"):
        if start.startswith(b"MATLAB") or path.suffix.lower() == ".mat":
            return "mat73"
        return "hdf5" if path.suffix.lower() in HDF5 else "netcdf"
    if start[:4] in (b"RIFF", b"RIFX", b"RF64") and start[8:12] == b"WAVE":
        return "wav"
    if start.startswith(b"TDSm"):
        return "tdms"
    for magic, reason in _REFUSED.items():
        if start.startswith(b"PK") and (ours := instead(path, "a record", "")):
            raise ReadError(f"{path}: {ours}; give .csv, .mat, .uff, .tdms or .nc")
        if start.startswith(magic):
            raise ReadError(f"{path}: {reason}")
    if start.split(b"\n", 1)[0].strip() == b"-1":
        return "uff"
    if start[126:128] in (b"IM", b"MI") or path.suffix.lower() == ".mat":
        return "mat"
    if path.suffix.lower() in TEXT:
        return "csv"
    if path.suffix.lower() in (".nc", ".h5", ".hdf5", ".tdms", ".uff", ".unv", ".wav"):
        raise ReadError(f"{path}: does not begin like a {path.suffix} file; it is damaged or of another kind")
    reason = instead(path, "a record", "") or "unknown kind of file"
    raise ReadError(f"{path}: {reason}; give .csv, .mat, .uff, .tdms or a record .nc")


def _record(path: Path, mapping: Mapping | None) -> xr.Dataset:
    if mapping is not None and mapping.maps_columns:
        raise ReadError("a netCDF record describes itself; leave the mapping out, or all of it but [conditions]")
    return read_netcdf(path).assign_attrs(mapping.conditions if mapping else {})


def _regular(path: str | Path) -> Path:
    path = Path(path)
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

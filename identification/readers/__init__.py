r"""Readers of measured data, one per file format, and their registry.

Nothing in a file is ever evaluated or unpickled. A reader gives a `DataTable` of columns; mapping and units come after.
A new format is one file of this folder, with a function under its suffixes and first bytes; what it raises on a damaged
file becomes one sentence here::

    @reader(".wav", magic=rb"RIFF.{4}WAVE")
    def read_wav(path: Path) -> DataTable: ...

A file belongs to the reader whose `magic` its beginning matches, whatever it is called; where several match, to the one
of its suffix, else to the first of them. A reader without `magic` takes the files of its suffixes that no other
reader takes.
"""

from __future__ import annotations

import hashlib
import re
from codecs import BOM_UTF8
from collections.abc import Callable, Iterator, Mapping as Tables
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.columns import CLIPPED
from identification.records.schema import validate, with_notes
from identification.records.sensors import without_slow_roll
from rotorsim.base.errors import ReadError, RotorsimError, SchemaError
from rotorsim.base.input_files import instead

if TYPE_CHECKING:
    import xarray as xr

    from identification.records.columns import DataTable
    from identification.records.mapping import Mapping


START = 1024
"""Bytes of a file's beginning that are matched."""
REFUSED = {
    b"PK\x03\x04": "is a spreadsheet or another zip archive; export it as CSV",
    b"CDF": "is classic netCDF; convert it with 'nccopy -k nc4'",
    b"\x93NUMPY": "is a NumPy array without names and units; use identification.from_arrays and save",
    b"\x80": "looks like a Python pickle, which is never opened; export it as CSV",
    b"\x1f\x8b": "is compressed; unpack it first",
}
"""First bytes of files that are not read, and why."""


@dataclass(frozen=True)
class Reader:
    """Function that reads files of some suffixes, or files that begin like `magic`.

    `takes_layout`: the function also takes the section [file] of a mapping. `describes_itself`: it makes a whole record
    and no table, so that no mapping applies.
    """

    function: Callable[..., Any]
    suffixes: tuple[str, ...]
    magic: re.Pattern[bytes] | None
    takes_layout: bool
    describes_itself: bool

    def __call__(self, path: Path, layout: dict[str, str]) -> Any:
        """Table or record of a file; whatever else than an error of ours the function raises means a damaged file."""
        try:
            return self.function(path, layout) if self.takes_layout else self.function(path)
        except (RotorsimError, MemoryError):
            raise
        except Exception as error:  # libraries answer damage with anything from KeyError to struct.error
            kind = path.suffix.lower() or "data"
            raise ReadError(
                f"is a damaged or cut off {kind} file, or of a coding that is not read; copy or save it again"
            ) from error


READERS: list[Reader] = []
"""Readers in the order in which they were registered; `readers` has those of all formats."""


def reader(
    *suffixes: str, magic: bytes | None = None, takes_layout: bool = False, describes_itself: bool = False
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator that registers a function of a path as the reader of a format.

    Parameters
    ----------
    suffixes : str
        Suffixes of the format's files, in small letters with their dot.
    magic : bytes or None
        Regular expression of a file's first bytes.
    takes_layout, describes_itself : bool
        See `Reader`.
    """

    def registered(function: Callable[..., Any]) -> Callable[..., Any]:
        pattern = None if magic is None else re.compile(magic, re.DOTALL)
        READERS.append(Reader(function, suffixes, pattern, takes_layout, describes_itself))
        return function

    return registered


def readers() -> Iterator[Reader]:
    """Readers of all formats, that of records first; a module is imported when those before it are not enough."""
    names = sorted((one.name for one in iter_modules(__path__)), key=lambda name: (name != "hdf5", name))
    modules, passed = iter(names), 0
    while True:
        yield from READERS[passed:]
        passed = len(READERS)
        if (module := next(modules, None)) is None:
            return
        import_module(f"{__name__}.{module}")


def reader_of(path: Path) -> Reader:
    """Reader of a file; raises ReadError for a file of another kind."""
    with path.open("rb") as file:
        start = file.read(START).removeprefix(BOM_UTF8)
    suffix = path.suffix.lower()
    for magic, reason in REFUSED.items():
        if start.startswith(b"PK") and (ours := instead(path, "a record", "")):
            raise ReadError(f"{path}: {ours}; give {_listed()}")
        if start.startswith(magic):
            raise ReadError(f"{path}: {reason}")
    alike, named = list[Reader](), list[Reader]()
    for one in readers():
        alike += [one] if one.magic and one.magic.match(start) else []
        named += [one] if suffix in one.suffixes else []
        if alike and alike[-1] in named:
            return one
    plain = [one for one in named if one.magic is None]
    if found := alike or plain:
        return found[0]
    if named:
        raise ReadError(f"{path}: does not begin like a {path.suffix} file; it is damaged or of another kind")
    reason = instead(path, "a record", "") or "unknown kind of file"
    raise ReadError(f"{path}: {reason}; give {_listed()}")


def endings() -> tuple[str, ...]:
    """Endings of files that a registered reader takes."""
    return tuple(dict.fromkeys(suffix for one in readers() for suffix in one.suffixes))


def _listed() -> str:
    *first, last = endings()
    return f"{', '.join(first)} or {last}"


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
    """Record, or run-up vectors, of `read`; time series come as they are, with their gaps and NaN.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.load("run.csv").sizes["axis"]
    2
    """
    path = _regular(path)
    mapped = None
    if mapping is not None:
        from identification.records.mapping import load_mapping

        mapped = load_mapping(mapping)
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
    from identification.records.assemble import assemble, left_out, on_one_clock, provenance, used

    table = columns(path, mapped)
    if mapped is None or not mapped.maps_columns:
        from identification.records.proposal import recognise  # for columns that nobody has named

        mapped = replace(recognise(table), conditions=mapped.conditions if mapped else {})
    table, notes = on_one_clock(table, mapped, used(mapped))
    record = with_notes(assemble(table, mapped), [*notes, *left_out(table, mapped)])
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return record.assign_attrs(provenance(table, mapped, path.name, digest))


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
    if chosen.describes_itself:
        raise ReadError(
            f"{path}: is netCDF; a record of rotorsim needs no mapping, another file must come as CSV or .mat"
        )
    try:
        found: DataTable = chosen(path, mapping.file if mapping else {})
        return found
    except ReadError as error:
        raise ReadError(_named(path, error)) from error
    except MemoryError as error:
        raise ReadError(f"{path}: is too large for this machine's memory; cut it") from error


def _itself(chosen: Reader, path: Path, mapping: Mapping | None) -> xr.Dataset:
    if mapping is not None and mapping.maps_columns:
        raise ReadError("a netCDF record describes itself; leave the mapping out, or all of it but [conditions]")
    record: xr.Dataset = chosen(path, {})
    return record.assign_attrs(mapping.conditions if mapping else {})


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

r"""Registry of the readers of files: each stands where its format is read, under its suffixes and first bytes.

::

    @reader(".wav", magic=rb"RIFF.{4}WAVE")
    def read_wav(path: Path) -> Table: ...

A file belongs to the reader whose `magic` its beginning matches, whatever it is called; where several match, to the one
of its suffix, else to the first of them. A reader without `magic` takes the files of its suffixes that no other
reader takes.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification.errors import ReadError
from rotorsim.base.input_files import instead

if TYPE_CHECKING:
    import xarray as xr

    from identification.records.table import DataTable

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

    def table(self, path: Path, layout: dict[str, str]) -> DataTable:
        """Columns of a file; raises ReadError for a file that has none, or that describes itself."""
        if self.describes_itself:
            raise ReadError("is netCDF; a record of rotorsim needs no mapping, another file must come as CSV or .mat")
        found: DataTable = self.function(path, layout) if self.takes_layout else self.function(path)
        return found

    def record(self, path: Path) -> xr.Dataset:
        """Record of a file that describes itself."""
        found: xr.Dataset = self.function(path)
        return found


READERS: list[Reader] = []
"""Readers in the order in which they were registered."""


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


def reader_of(path: Path) -> Reader:
    """Reader of a file; raises ReadError for a file of another kind."""
    with path.open("rb") as file:
        start = file.read(START).removeprefix(BOM_UTF8)
    suffix = path.suffix.lower()
    for magic, reason in REFUSED.items():
        if start.startswith(b"PK") and (ours := instead(path, "a record", "")):
            raise ReadError(f"{path}: {ours}; give .csv, .mat, .uff, .tdms or .nc")
        if start.startswith(magic):
            raise ReadError(f"{path}: {reason}")
    alike = [one for one in READERS if one.magic and one.magic.match(start)]
    named = [one for one in READERS if suffix in one.suffixes]
    plain = [one for one in named if one.magic is None]
    if found := [one for one in alike if one in named] or alike or plain:
        return found[0]
    if named:
        raise ReadError(f"{path}: does not begin like a {path.suffix} file; it is damaged or of another kind")
    reason = instead(path, "a record", "") or "unknown kind of file"
    raise ReadError(f"{path}: {reason}; give .csv, .mat, .uff, .tdms or a record .nc")

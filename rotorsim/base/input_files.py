"""Files from outside, read within limits: JSON and TOML texts, zip archives; the kinds of rotorsim's own files.

Code that reads values further calls itself for each level of nesting, so the levels have a bound. Archives are read
into memory and unpacked under names that stay in their folder. The kind of a file of rotorsim, in words, is for the
message of a reader that was given the wrong one.
"""

from __future__ import annotations

import json
import stat
import struct
import tomllib
import zlib
from collections.abc import Callable, Iterable, Mapping
from io import BytesIO
from json import JSONDecodeError
from pathlib import Path, PurePosixPath
from tomllib import TOMLDecodeError
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import zipfile

DEEPEST = 100
"""Largest number of levels of lists and tables in each other; files of rotorsim have ten."""


def parse_json(text: str | bytes) -> Any:
    """Value of a JSON text; raises JSONDecodeError, and UnicodeDecodeError for bytes that are no text."""
    return _bounded(json.loads, text, lambda fault: JSONDecodeError(fault, "", 0))


def parse_toml(text: str) -> dict[str, Any]:
    """Tables of a TOML text; raises TOMLDecodeError."""
    tables: dict[str, Any] = _bounded(tomllib.loads, text, TOMLDecodeError)
    return tables


def _bounded(parse: Callable[[Any], Any], text: str | bytes, error: Callable[[str], ValueError]) -> Any:
    """The value that `parse` makes of a text; raises `error` if it is nested deeper than `DEEPEST` levels."""
    fault = f"brackets are nested deeper than {DEEPEST} levels"
    try:
        value = parse(text)
    except RecursionError as recursion:
        raise error(fault) from recursion
    level: list[Any] = [value]
    for _ in range(DEEPEST + 1):
        level = [below for one in level for below in _inside(one)]
        if not level:
            return value
    raise error(fault)


def _inside(value: Any) -> Iterable[Any]:
    """Lists and tables directly in a value."""
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [one for one in parts if isinstance(one, (dict, list))]


LARGEST = 250_000_000
"""Bytes that an archive may take, packed or unpacked."""
MOST = 5000
"""Largest number of files in an archive."""
LONGEST_ENTRY = 1000
"""Largest mean size [byte] of an entry in the table of contents."""
DENSEST = 250
"""Largest ratio of unpacked to packed bytes; equations and tables pack by 1 : 30."""
SMALL = 20_000_000
"""Unpacked size [byte] that any archive may have, however densely it is packed."""
METHODS = (0, 8)
"""Methods of packing that are read: stored and deflate."""
ENCRYPTED = 0x1
END, END_SIZE, LOCATOR_64, LOCATOR_SIZE, COMMENT = b"PK\x05\x06", 22, b"PK\x06\x07", 20, 65535
"""End of the table of contents, as the format has it, and the mark of the larger form of 64 bits."""


class ArchiveError(ValueError):
    """Raised for an archive that is damaged, or that asks for more than it may; the text is a predicate."""


def read_archive(source: Path | bytes, largest: int = LARGEST, densest: float = DENSEST) -> dict[str, bytes]:
    """All files of an archive by their names, which are relative, go nowhere up and differ even without their case.

    Raises ArchiveError if it is damaged, encrypted, packed by anything but deflate, holds links, too many files or too
    many bytes; OSError if there is no such file.
    """
    import zipfile

    size = len(source) if isinstance(source, bytes) else source.stat().st_size
    if size > largest:
        raise ArchiveError(f"has {size / 1e6:.0f} MB; at most {largest / 1e6:.0f} MB are read")
    data = source if isinstance(source, bytes) else source.read_bytes()
    _check_contents(data)
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            _check(entries, min(largest, max(SMALL, densest * size)))
            return {entry.filename: archive.read(entry) for entry in entries}
    except ArchiveError:
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, NotImplementedError, RuntimeError, OSError) as error:
        raise ArchiveError(f"is damaged ({str(error)[:100]})") from error


def _check_contents(data: bytes) -> None:
    """Refuse a long table of contents before anything of it is read."""
    end = len(data) - END_SIZE if data[-END_SIZE:].startswith(END) else data.rfind(END, -END_SIZE - COMMENT)
    if end < 0 or end + END_SIZE > len(data):
        raise ArchiveError("is no archive, or its end is missing")
    count, size = struct.unpack_from("<HL", data, end + 10)
    if count > MOST or size > MOST * LONGEST_ENTRY or data[max(end - LOCATOR_SIZE, 0) : end].startswith(LOCATOR_64):
        raise ArchiveError(f"holds more than {MOST} files, which are not read")


def _check(entries: list[zipfile.ZipInfo], most: float) -> None:
    for entry in entries:
        _check_name(entry.filename)
        kind = stat.S_IFMT(entry.external_attr >> 16)
        if kind not in (0, stat.S_IFREG):
            raise ArchiveError(f"holds {entry.filename!r}, which is a link or no file")
        if entry.flag_bits & ENCRYPTED:
            raise ArchiveError(f"holds {entry.filename!r} encrypted; pack it without a password")
        if entry.compress_type not in METHODS:
            raise ArchiveError(f"holds {entry.filename!r} packed by method {entry.compress_type}; pack it by deflate")
    names = [entry.filename.casefold() for entry in entries]
    if len(set(names)) < len(names):
        raise ArchiveError("holds two files of one name")
    total = sum(entry.file_size for entry in entries)
    if total > most:
        raise ArchiveError(f"unpacks to {total / 1e6:.0f} MB, more than {most / 1e6:.0f} MB; it is not read")


def _check_name(name: str) -> None:
    parts = PurePosixPath(name).parts
    plain = name.isprintable() and not any(character in name for character in '\\:*?"<>|')
    if not plain or not parts or parts[0] == "/" or ".." in parts or len(name) > 400:
        raise ArchiveError(f"holds {name[:100]!r}, a name that no file of an archive may have")


def unpack(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files of `read_archive` below a new folder; raises ArchiveError where one is the folder of another."""
    for name, content in files.items():
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except (FileExistsError, NotADirectoryError, IsADirectoryError) as error:
            raise ArchiveError(f"holds {name!r} both as a file and as a folder") from error


LARGEST_TEXT = 5_000_000
"""Largest size [byte] of a text whose kind is recognised."""
NETCDF = {
    "map": "an operating map of 'rotorsim map'",
    "modes": "a file of mode shapes of 'rotorsim modes'",
    "gap": "the gap of 'rotorsim diagnose'",
    "collected": "the collected records of a campaign",
}
"""Kinds of netCDF files in words, by the attribute `kind`, which records do not have."""
JSON = {
    "law": "a control law of 'rotorsim design'",
    "lpv": "a model of 'rotorsim identify'",
    "linear": "a model of 'rotorsim identify'",
    "rotorsim scene": "a scene of 'rotorsim live'",
}
"""Kinds of JSON files in words, by the key `kind`."""
RESULTS = (
    ({"status", "verdict"}, "the verdict of 'rotorsim diagnose'"),
    ({"fit_parameters", "forms"}, "the sealed truth of 'rotorsim hide'"),
    ({"law", "rows", "passed"}, "the table of 'rotorsim verify'"),
    ({"claims"}, "the numbers of a study"),
)
TABLES = (
    ({"shaft", "bearings"}, "a machine file"),
    ({"experiments"}, "a plan of a campaign"),
    ({"targets", "operating_points"}, "a file of targets"),
    ({"channels"}, "a mapping of measured data"),
    ({"vectors"}, "a mapping of measured data"),
)
"""Kinds in words of JSON files without the key `kind` and of TOML files, by keys that they have."""

READ_BY = {
    "a netCDF file": "data check",
    "a plan of a campaign": "campaign check",
    "a file of targets": "machine calibrate --targets",
    "a mapping of measured data": "data check --mapping",
    "a machine file": "machine check",
    "a control law of 'rotorsim design'": "verify",
    "a model of 'rotorsim identify'": "design",
    "a scene of 'rotorsim live'": "live",
}
"""Command that reads a kind of file; the one of netCDF files reads records."""


def kind_in_words(path: str | Path) -> str:
    """Kind of rotorsim file in words; empty for a record, a foreign file or an unreadable one."""
    try:
        with Path(path).open("rb") as file:
            start = file.read(LARGEST_TEXT)
    except OSError:
        return ""
    suffix = Path(path).suffix.lower()
    if start.startswith(b"\x89HDF"):
        return "a netCDF file"
    if start.startswith(b"PK"):
        return {".fmu": "a functional mock-up unit", ".ssp": "a system of units"}.get(suffix, "")
    if b"<html" in start[:1000].lower():
        return "a report"
    try:
        text = start.decode("utf-8-sig")
        content = parse_json(text) if text.lstrip().startswith("{") else parse_toml(text)
    except ValueError:
        return ""
    return _by_keys(content) if isinstance(content, Mapping) else ""


def _by_keys(content: Mapping[str, Any]) -> str:
    kind = content.get("kind")
    if isinstance(kind, str) and kind in JSON:
        return JSON[kind]
    return next((name for keys, name in (*RESULTS, *TABLES) if keys <= content.keys()), "")


def instead(path: str | Path, wanted: str, ours: str) -> str:
    """'is a plan ..., not a record (... reads it)' for a file of rotorsim of another kind than `ours`, else empty."""
    found = kind_in_words(path)
    if not found or found == ours:
        return ""
    which = "a record" if found == "a netCDF file" else "it"
    reader = f" ('rotorsim {READ_BY[found]}' reads {which})" if found in READ_BY else ""
    return f"is {found}, not {wanted}{reader}"

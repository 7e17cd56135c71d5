"""Zip archives of other people: read into memory within limits, unpacked under names that stay in their folder."""

from __future__ import annotations

import stat
import struct
import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path, PurePosixPath

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
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
ENCRYPTED = 0x1
END, END_SIZE, LOCATOR_64, LOCATOR_SIZE, COMMENT = b"PK\x05\x06", 22, b"PK\x06\x07", 20, 65535
"""End of the table of contents, as the format has it, and the mark of the larger form of 64 bits."""


class ArchiveError(ValueError):
    """Raised for an archive that is damaged, or that asks for more than it may; the text is a predicate."""


def read_archive(source: Path | bytes, largest: int = LARGEST, densest: float = DENSEST) -> dict[str, bytes]:
    """All files of an archive by their names, which are relative, go nowhere up and differ even without their case.

    Raises
    ------
    ArchiveError
        If it is damaged, encrypted, packed by anything but deflate, holds links, too many files or too many bytes.
    OSError
        If there is no such file.
    """
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

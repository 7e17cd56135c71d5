"""Reproducible zip archives, their paths checked before minutes of compilation, and temporary folders."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from rotorsim.base.errors import DataError
from rotorsim.base.files import WriteError, write_bytes
from rotorsim.base.interrupt import undoing

DATE = (1980, 1, 1, 0, 0, 0)


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write all files in the order of their names; the archive is complete or untouched."""
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as z:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            z.writestr(entry, files[name])
    write_bytes(path, content.getvalue())


def check_place(path: Path) -> None:
    """Refuse at the start what could not be written at the end; raises DataError."""
    if path.is_dir():
        raise DataError(f"{path}: is a folder; give a file name, e.g. {path / ('rotor' + (path.suffix or '.fmu'))}")
    if not path.parent.is_dir():
        raise DataError(f"{path}: the folder is not there; make it, or choose another --out")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise DataError(f"{path}: the folder is not writable; choose another --out") from error


@contextmanager
def workspace() -> Iterator[Path]:
    """Temporary folder, removed at the end; raises DataError where the disk for temporary files takes no more."""
    try:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, undoing():
            yield Path(folder)
    except OSError as error:
        if isinstance(error, WriteError):
            raise  # of a file elsewhere, with its own sentence
        raise temporary_error(error) from error


def temporary_error(error: OSError) -> DataError:
    """A sentence about temporary files that cannot be written."""
    reason = os.strerror(error.errno).lower() if error.errno else str(error)
    where = f"{tempfile.gettempdir()}: temporary files cannot be written: {reason}"
    return DataError(f"{where}; free some space or set TMPDIR to another folder")

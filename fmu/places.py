"""Output paths, checked before minutes of compilation, and temporary folders."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rotorsim.base.errors import DataError
from rotorsim.base.files import WriteError
from rotorsim.base.interrupt import undoing


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

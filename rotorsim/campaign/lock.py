"""A lock on a file for as long as a process lives; the system takes it back when the process is killed.

An advisory lock of the whole file, also across hosts on NFS and on parallel file systems that are mounted with locks.
"""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType

BUSY = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)


class BusyError(OSError):
    """Another process holds the lock; the text is what it wrote about itself."""


class Lock:
    """Held while active; `wait` or raise BusyError. `about` is told to whoever finds it held."""

    def __init__(self, path: Path, about: str = "", wait: bool = False) -> None:
        self.path, self.about, self.wait = path, about, wait
        self._file = -1

    def __enter__(self) -> Lock:
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            _acquire(self._file, self.wait)
        except OSError as error:
            told = _read(self._file) if error.errno in BUSY else ""
            self._close()
            if error.errno in BUSY:
                raise BusyError(error.errno, told or "another process", str(self.path)) from error
            raise
        if self.about:
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, self.about.encode(), 0) if hasattr(os, "pwrite") else None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    def _close(self) -> None:
        with suppress(OSError):
            os.close(self._file)
        self._file = -1


def _read(file: int) -> str:
    with suppress(OSError):
        os.lseek(file, 0, os.SEEK_SET)
        return os.read(file, 300).decode(errors="replace").strip()
    return ""


if sys.platform == "win32":
    import msvcrt

    FAR = 1 << 30  # locked bytes cannot be read by others there: lock one behind the text

    def _acquire(file: int, wait: bool) -> None:
        os.lseek(file, FAR, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _acquire(file: int, wait: bool) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))

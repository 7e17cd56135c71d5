"""Files that are complete under their names or unchanged, and locks between processes.

The content goes into a temporary file in the same folder, is flushed to the disk and moved to its name. Whatever
interrupts the writing removes the temporary file; a kill leaves it, and `sweep` removes it in a later run.

A set of files is written into a temporary folder. Once it is complete it is renamed, and its content moves to the final
names. A process that is killed before leaves the older files; one that is killed during the move leaves the rest in the
complete folder, and `finish_sets` moves it in a later run.

A `Lock` is an advisory one of a whole file for the life of a process, also across hosts on NFS and on parallel file
systems that are mounted with locks. Not filelock: with files that are removed, 20 processes x 200 acquisitions
overlapped in 1115 of 4000 cases with its release 3.16, which also empties the file that names the holder, and in none
with 4.2 or here; 4.1 s against 2.5 s. Release 4.3 has 15 700 lines and takes 50 ms to import, before every command. A
killed holder's lock is free at once in both.
"""

from __future__ import annotations

import csv
import errno
import io
import json
import os
import platform
import re
import shutil
import socket
import stat
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from rotorsim.base.input_files import parse_json
from rotorsim.base.interrupt import Interrupt, undoing

FULL = (errno.ENOSPC, errno.EDQUOT)
ELSEWHERE = "choose another place"
REASONS = {
    **dict.fromkeys(FULL, ("the disk is full", "free some space or choose another place")),
    errno.EFBIG: ("it is larger than a file may be there", "raise the limit (ulimit -f) or choose another place"),
    errno.EROFS: ("the disk is read-only", ELSEWHERE),
    errno.EACCES: ("no permission to write there", ELSEWHERE),
    errno.EPERM: ("no permission to write there", ELSEWHERE),
    errno.ENOENT: ("its folder is not there", "make the folder or choose another place"),
    errno.ENOTDIR: ("part of the path is a file, not a folder", ELSEWHERE),
    errno.EEXIST: ("part of the path is a file, not a folder", ELSEWHERE),
    errno.EISDIR: ("it is a folder", "choose the name of a file"),
    errno.EINVAL: ("it is not a file", "choose the name of a file"),
    errno.ENAMETOOLONG: ("the name is too long", "choose a shorter name"),
}
"""Reason and way out by error number."""
LONGEST = 100
"""Longest part [characters] of a file's name in its temporary one, which must not become too long itself."""
GROWING = ".growing"
"""Mark of the temporary file of a record before its end."""
COMPLETE = ".complete"
"""Mark of the temporary folder of a complete set of files before its move."""
ORDER = ".order"
"""File in the temporary folder that lists the names to move and those to remove."""
_numbers = count()


class WriteError(OSError):
    """Raised for a file that cannot be written; its text is one sentence: file, reason, way out.

    `errno` and `filename` are those of any OSError.
    """

    @property
    def reason(self) -> str:
        """The middle of the sentence, e.g. "the disk is full (0 MB free)"."""
        return str(self.strerror).partition(": ")[2].partition("; ")[0]

    @property
    def way_out(self) -> str:
        """The end of the sentence, e.g. "free some space or choose another place"."""
        return str(self.strerror).rpartition("; ")[2]

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}"


def write_error(path: Path, cause: OSError, space: bool = True) -> WriteError:
    """WriteError for a file, with the cause and, for a full disk and `space`, the free space."""
    number = cause.errno or errno.EIO
    reason, way_out = REASONS.get(number, (os.strerror(number).lower(), ELSEWHERE))
    if number in FULL and space:
        reason += _free(path)
    return WriteError(number, f"cannot be written: {reason}; {way_out}", str(path))


def _free(path: Path) -> str:
    try:
        return f" ({shutil.disk_usage(path.parent).free / 1e6:.3g} MB free)"
    except OSError:
        return ""


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Temporary file that becomes `path` at the end of the block; removed if the block raises.

    A link is followed, so that it stays a link. Raises WriteError if the file cannot be written; what was there stays.
    """
    path = Path(path)
    target = followed(path)
    part = temporary(target)
    try:
        check_target(target)
        with suppress(FileNotFoundError):  # a link of another user would lead the writing elsewhere
            os.unlink(str(part))
        with undoing():
            yield part
        with part.open("rb+") as file:
            to_disk(file)
        os.replace(part, target)
    except OSError as error:
        if isinstance(error, WriteError) or error.filename not in (None, str(part), str(target)):
            raise  # of another file
        raise write_error(path, error) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def followed(path: Path) -> Path:
    """Target of a symbolic link, so that the link is kept; any other path unchanged, and the link of another user."""
    return Path(os.path.realpath(path)) if os.path.islink(path) and is_ours(path) else path


def is_ours(path: Path) -> bool:
    """Whether a file, folder or link itself belongs to this user or to the system's administrator."""
    return not hasattr(os, "geteuid") or os.lstat(path).st_uid in (os.geteuid(), 0)


def check_target(target: Path) -> None:
    """Raise OSError for a folder or a device, which must not be replaced."""
    with suppress(FileNotFoundError):
        kind = target.stat().st_mode
        if not stat.S_ISREG(kind):
            raise OSError(errno.EISDIR if stat.S_ISDIR(kind) else errno.EINVAL, "", str(target))


def to_disk(file: IO[Any]) -> None:
    """Flush a file to the disk: network disks and quotas report a full disk only here."""
    try:
        os.fsync(file.fileno())
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.ENOSYS):  # disks that do not report it
            raise


def write_bytes(path: str | Path, content: bytes | memoryview) -> None:
    """Write a file in one step; raises WriteError."""
    with replacing(path) as part:
        part.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write a UTF-8 file with \\n line ends in one step; raises WriteError."""
    write_bytes(path, text.encode())


def write_json(path: str | Path, value: Any, indent: int | None = 1, default: Any = None) -> None:
    """Write a JSON file in one step; raises WriteError."""
    write_text(path, json.dumps(value, indent=indent, default=default) + "\n")


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV with \\n line ends; a cell of None is empty."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_csv(path: str | Path, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table below its heads as a CSV file in one step; raises WriteError."""
    write_text(path, csv_text([heads, *rows]))


def make_folder(path: str | Path) -> Path:
    """Make a folder and its parents where they are missing; raises WriteError."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(path, error) from error
    return path


def temporary(path: Path, kind: str = "") -> Path:
    """Temporary file name in the folder of `path`, with computer name and process number."""
    return path.with_name(f".{path.name[:LONGEST]}.{_node()}-{os.getpid()}-{next(_numbers)}{kind}.part")


def _node() -> str:
    return re.sub(r"[^A-Za-z0-9]", "", platform.node())[:32] or "host"


def sweep(folder: Path) -> list[Path]:
    """Remove the temporary files that killed processes of this computer left in a folder; returns their paths."""
    removed = []
    for path in left_behind(folder):
        with suppress(OSError):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            removed.append(path)
    return removed


def is_temporary(path: Path) -> bool:
    """True for a temporary file of any computer."""
    return re.fullmatch(r"\..+\.[A-Za-z0-9]+-\d+-\d+(\.growing|\.complete)?\.part", path.name) is not None


def target_of(part: Path) -> str:
    """Final name of a temporary file, cut to `LONGEST` characters."""
    return part.name[1:].rsplit(f".{_node()}-", 1)[0]


def left_behind(folder: Path, kind: str = "") -> list[Path]:
    """Temporary files of one kind in a folder whose process on this computer has ended."""
    pattern = re.compile(rf"\..+\.{_node()}-(\d+)-\d+{kind}\.part")
    try:
        names = sorted(os.listdir(folder))
    except OSError:
        return []
    found = [(name, pattern.fullmatch(name)) for name in names]
    return [folder / name for name, match in found if match and not _alive(int(match[1]))]


def _alive(pid: int) -> bool:
    if os.name != "posix":  # no signal 0 there, and a file in use cannot be removed anyway
        return pid == os.getpid()
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return not _ended(pid)


def _ended(pid: int) -> bool:
    """Whether a process has ended and its parent has not yet asked how; only Linux states it."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    return state.rpartition(")")[2].split()[:1] in (["Z"], ["X"])


@contextmanager
def replacing_all(folder: str | Path, names: Sequence[str] = ()) -> Iterator[Path]:
    """Temporary folder whose files replace those in `folder` at the end of the block; none if the block raises.

    Those of all `names` that are not written are removed. The last name, by which others know that the set is complete,
    is taken away first and moves last. Raises WriteError, which names the file as it would have been called.
    """
    folder = Path(folder)
    part, ready = temporary(folder / "results"), temporary(folder / "results", COMPLETE)
    own = not folder.exists()
    try:
        make_folder(part)
        with undoing():
            yield part
        _note_order(part, names)
        with Interrupt():  # Ctrl-C comes too late from here on
            os.rename(part, ready)
            _move(ready)
    except OSError as error:
        shutil.rmtree(part, ignore_errors=True)
        if own:
            with suppress(OSError):
                folder.rmdir()
        if not Path(str(error.filename)).is_relative_to(part):
            raise
        raise write_error(folder / Path(str(error.filename)).relative_to(part), error) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _note_order(part: Path, names: Sequence[str]) -> None:
    written = sorted(os.listdir(part), key=lambda name: names.index(name) if name in names else -1)
    write_json(part / ORDER, {"moved": written, "removed": [name for name in names if name not in written]})


def _move(ready: Path) -> None:
    """Move what is left of a complete set, and remove its folder."""
    folder, order = ready.parent, parse_json((ready / ORDER).read_text(encoding="utf-8"))
    if any(Path(name).name != name for name in (*order["moved"], *order["removed"])):
        raise ValueError(f"{ready}: names files elsewhere")
    last = order["moved"][-1:]
    for name in [*(name for name in last if (ready / name).is_file()), *order["removed"]]:
        (folder / name).unlink(missing_ok=True)
    for name in order["moved"]:
        if (ready / name).exists():
            os.replace(ready / name, folder / name)
    shutil.rmtree(ready, ignore_errors=True)


def finish_sets(folder: Path) -> None:
    """Complete the replacement of file sets whose process on this computer was killed."""
    for ready in left_behind(folder, COMPLETE):
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
            if is_ours(ready):  # anybody can make a folder like it where all may write
                _move(ready)


BUSY = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
"""Error numbers of a lock that another process holds."""
HOLDER = re.compile(rb"process \d+ on .* since \d{4}-\d\d-\d\d \d\d:\d\d UTC")
"""Text of a lock file, as `about_us` writes it."""


class BusyError(OSError):
    """Another process holds the lock; the text is what it wrote about itself."""


def about_us() -> str:
    """Description of this process for others: number, computer and time."""
    return f"process {os.getpid()} on {socket.gethostname()} since {datetime.now(UTC):%Y-%m-%d %H:%M} UTC"


class Lock:
    """File lock as a context manager; waits for it (`wait`, in s if a number) or raises BusyError.

    `remove` takes its file away.
    """

    def __init__(self, path: Path, about: str = "", wait: bool | float = False, remove: bool = False) -> None:
        self.path, self.about, self.wait, self.remove = path, about, wait, remove
        self._file = -1

    def __enter__(self) -> Lock:
        self._open()
        while self.remove and not self._is_ours():  # the holder before has just removed the file
            self._close()
            self._open()
        with suppress(OSError):  # of a full disk: the lock holds without it
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, self.about.encode(), 0) if hasattr(os, "pwrite") else None
        return self

    def _open(self) -> None:
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
        try:
            _acquire_within(self._file, self.wait)
        except OSError as error:
            holder = _read(self._file) if error.errno in BUSY else ""
            self._close()
            if error.errno in BUSY:
                raise BusyError(error.errno, holder or "another process", str(self.path)) from error
            raise

    def _is_ours(self) -> bool:
        """Whether the file that we hold is the one that others would open."""
        try:
            return os.path.samestat(os.fstat(self._file), os.stat(self.path))
        except FileNotFoundError:
            return False

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.remove:
            with suppress(OSError):
                self.path.unlink()
        self._close()

    def _close(self) -> None:
        with suppress(OSError):
            os.close(self._file)
        self._file = -1


def _acquire_within(file: int, wait: bool | float) -> None:
    end = time.monotonic() + wait
    while True:
        try:
            return _acquire(file, wait is True)
        except OSError as error:
            if error.errno not in BUSY or time.monotonic() > end:
                raise
        time.sleep(0.01)


def sweep_locks(folder: Path) -> None:
    """Remove lock files `.NAME.lock` that no process holds."""
    for path in folder.glob(".*.lock"):
        if _names_holder(path):  # other programs have such files too
            with suppress(OSError), Lock(path, remove=True):
                pass


def _names_holder(path: Path) -> bool:
    """Whether a file holds what `about_us` writes."""
    try:
        with path.open("rb") as file:
            return HOLDER.fullmatch(file.read(300)) is not None
    except OSError:
        return False


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

"""HDF5 and netCDF-4 files: written without a crash of libhdf5 on a full disk, checked before they are read.

libhdf5 keeps a file open that it could not flush, tries again when the process ends, and may end it by a signal. Hence
it writes through a `DiskFile`, which takes everything and keeps the disk's first error. A whole file is written under a
temporary name and renamed. One that grows reserves its space in advance, so that a full disk is met before libhdf5 has
changed anything, and the file stays a valid one of all that was flushed.

A file from outside is read as a whole in a child process first, which contains the crashes and hangs of libhdf5.

A kill costs what a growing file has not flushed: `rotorsim.experiments.recording` flushes it every second. A kill in
the few milliseconds of a flush can cost the file, and an error of the disk other than want of space does.
"""

from __future__ import annotations

import errno
import io
import math
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.base.files import replacing, to_disk
from rotorsim.base.interrupt import Interrupt, at_end

try:
    import resource
except ImportError:  # Windows: the parent's time limit alone
    resource = None  # type: ignore[assignment]

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.base.processes import Child

SECONDS = 10.0
"""Computing time [s] that the check of any file may take, hundreds of times that of an undamaged one."""
PER_BYTE = 1e-7
"""Further computing time [s] per byte of a file."""
LARGEST = 2e9
"""Size [byte] of the data that any file may declare."""
DENSEST = 2000.0
"""Largest ratio of declared data to the size of a larger file; gzip packs zeros by 1 : 1032."""
SLAB = 1 << 23
"""Bytes read at a time."""
MEMORY = 2 << 30
"""Address space [byte] beyond what the child has at its start."""
NO_RESERVATION = (errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL)
"""Error numbers of disks that reserve no space, where zeros are written in its place."""
TIMED_OUT = (-signal.SIGXCPU, -signal.SIGKILL) if os.name == "posix" else ()
"""Exit codes of a check that took too long."""


class DiskFile(io.RawIOBase):
    """File object for libhdf5 that never fails: after the disk's first `error` its writes stay in memory.

    The mode "x" makes the file, "r+" changes one.
    """

    def __init__(self, path: Path, mode: str = "x") -> None:
        self._disk: Any = open(path, f"{mode}b+" if mode == "x" else f"{mode}b", buffering=0)  # noqa: SIM115
        self.error: OSError | None = None
        self._position = 0
        self._size = self._reserved = os.fstat(self._disk.fileno()).st_size
        self._unwritten: list[tuple[int, bytes]] = []

    @property
    def is_removed(self) -> bool:
        """Whether the file is no longer in any folder."""
        return os.fstat(self._disk.fileno()).st_nlink == 0

    def reserve(self, more: int) -> None:
        """Take the space for as many more bytes from the disk; raises OSError if there is none."""
        end = self._size + more
        if end <= self._reserved:
            return
        try:
            os.posix_fallocate(self._disk.fileno(), self._reserved, end - self._reserved)
        except (AttributeError, OSError) as error:
            if isinstance(error, OSError) and error.errno not in NO_RESERVATION:
                raise
            self._disk.seek(self._reserved)
            _write(self._disk, bytes(end - self._reserved))
        self._reserved = end

    def to_disk(self) -> None:
        """Flush what was written to the disk; raises OSError, also that of an earlier write."""
        if self.error is not None:
            raise self.error
        to_disk(self._disk)

    def finish(self) -> None:
        """Give back the space that was reserved and flush; raises OSError if the file is not what was written."""
        if self.error is None:
            self._disk.truncate(self._size)
        self.to_disk()

    def copy_to(self, path: Path) -> None:
        """Write the content to another file; raises OSError."""
        self.seek(0)
        with path.open("wb") as other:
            while block := self.read(min(self._size - self._position, 1 << 20)):
                other.write(block)

    def write(self, data: Any) -> int:
        """Write all of the data at the position."""
        view = memoryview(data).cast("B")
        try:
            if self.error is None:
                self._disk.seek(self._position)
                _write(self._disk, view)
        except OSError as error:
            self.error = error
        if self.error is not None:
            self._unwritten.append((self._position, bytes(view)))
        self._position += len(view)
        self._size = max(self._size, self._position)
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """Read at the position; zeros beyond the end."""
        view = memoryview(buffer).cast("B")
        first, left = self._position, view
        self._disk.seek(first)
        while len(left) and (n := self._disk.readinto(left)):
            left = left[n:]
        left[:] = bytes(len(left))
        for start, data in self._unwritten:
            low, high = max(first, start), min(first + len(view), start + len(data))
            if low < high:
                view[low - first : high - first] = data[low - start : high - start]
        self._position += len(view)
        return len(view)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move the position."""
        self._position = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size}[whence] + offset
        return self._position

    def tell(self) -> int:
        """The position."""
        return self._position

    def truncate(self, size: int | None = None) -> int:
        """Set the end of the file; the disk follows in `finish`."""
        self._size = self._position if size is None else size
        return self._size

    def readable(self) -> bool:
        """Return True."""
        return True

    def writable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def close(self) -> None:
        """Close the file as it is."""
        self._disk.close()
        super().close()


def _write(disk: Any, data: Any) -> None:
    """Write all: a write to the disk may be partial before it fails."""
    view = memoryview(data)
    while len(view):
        view = view[disk.write(view) :]


def write_netcdf(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset as netCDF-4 in one step.

    Ctrl-C waits until then: in a callback from libhdf5 it would leave a file there that cannot be closed. Raises
    WriteError if the file cannot be written (what was at `path` stays), TypeError or ValueError if netCDF cannot hold
    part of the dataset.
    """
    with Interrupt() as interrupt, replacing(path) as part, DiskFile(part) as file:
        dataset.to_netcdf(file, engine="h5netcdf")
        file.finish()
    trust_hdf5(Path(path))
    if interrupt.asked:
        raise KeyboardInterrupt


_lock = threading.Lock()
_child: Child | None = None
_owner = 0
_sound: dict[Path, tuple[int, ...]] = {}


def check_hdf5(path: Path) -> str | None:
    """Fault of an HDF5 or netCDF-4 file, read as a whole in a child process, as the predicate of a sentence; or None.

    A fault is that libhdf5 crashes on it, does not end, or takes too much memory; an exception is none.
    """
    with _lock:
        if _sound.get(path.absolute()) == _stamp(path):
            return None
        wrong = _ask(path)
    if wrong is None:
        trust_hdf5(path)
    return wrong


def trust_hdf5(path: Path) -> None:
    """Mark a file in its present state as undamaged, because this process has just written it."""
    _sound[path.absolute()] = _stamp(path)


def _stamp(path: Path) -> tuple[int, ...]:
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _ask(path: Path) -> str | None:
    """Fault of a file as the child process meets it, as the predicate of a sentence; None for none."""
    from rotorsim.base.processes import ProcessDiedError

    size = path.stat().st_size
    seconds = SECONDS + PER_BYTE * size
    request = os.fspath(path.absolute()), seconds, max(LARGEST, DENSEST * size)
    slow = f"is damaged: reading it has not ended after {seconds:.0f} s; copy it again"
    try:
        fits = _started().call(_read_whole, *request, limit=None if os.name == "posix" else 10 * seconds)
    except TimeoutError:  # where the child cannot limit its own computing time
        return slow
    except ProcessDiedError as error:
        return slow if error.code in TIMED_OUT else "is damaged: reading it crashes the HDF5 library; copy it again"
    return None if fits else "claims to hold more than fits into memory; it is damaged: copy it again"


def _started() -> Child:
    """The child of this process, which serves many files."""
    from rotorsim.base.processes import Child

    global _child, _owner
    if _child is None or _owner != os.getpid() or not _child.alive:
        _child, _owner = Child(), os.getpid()
        at_end(_child.kill)
    return _child


def _read_whole(path: str, seconds: float, most: float) -> bool:
    """Read all that is in a file: once as HDF5, once as netCDF, with whatever exceptions, for these do no harm.

    False if it needs more memory [byte] than `most` or than there is; a signal ends the process that takes longer than
    the computing time `seconds`.
    """
    import h5netcdf
    import h5py

    _limit_memory()
    _limit_time(seconds)
    try:
        with _harmless(), h5py.File(path, "r") as file:
            if _declared(file) > most:
                return False
            _walk(file)
        with _harmless(), h5netcdf.File(path, "r", phony_dims="sort") as file:
            for variable in file.variables.values():
                dict(variable.attrs)
    except MemoryError:
        return False
    return True


@lru_cache(maxsize=1)
def _limit_memory() -> None:
    """Limit the address space to `MEMORY` above its present size."""
    if resource is not None and sys.platform == "linux":
        with open("/proc/self/statm") as file:
            size = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, resource.RLIM_INFINITY))


def _limit_time(seconds: float) -> None:
    """Limit the remaining CPU time [s]; SIGXCPU ends the process."""
    if resource is not None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        limit = math.ceil(used.ru_utime + used.ru_stime + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))


@contextmanager
def _harmless() -> Iterator[None]:
    """Suppress every exception except lack of memory."""
    try:
        yield
    except MemoryError:
        raise
    except Exception:
        pass


def _objects(root: Any) -> Iterator[tuple[Any, bool]]:
    """All groups and data sets that lie in the file itself, each once, and whether it is a data set.

    Where damage hides the address of an object, its data are still read, its members are not.
    """
    import h5py

    queue, seen = [root], set()
    while queue:
        item, address = queue.pop(), None
        with _harmless():
            address = int(h5py.h5o.get_info(item.id).addr)
        if address in seen:
            continue
        seen |= {address} - {None}
        yield item, isinstance(item, h5py.Dataset)
        with _harmless():
            for name in item if isinstance(item, h5py.Group) and address is not None else ():
                with _harmless():
                    if isinstance(item.get(name, getlink=True), h5py.HardLink):
                        queue.append(item[name])


def _declared(root: Any) -> float:
    """Total declared size of a file's data sets [bytes]; those that damage hides do not count."""
    total = 0.0
    for item, is_data in _objects(root):
        with _harmless():
            total += item.nbytes if is_data and item.shape else 0
    return total


def _walk(root: Any) -> None:
    """Read all attributes and all data, large ones piece by piece."""
    for item, is_data in _objects(root):
        with _harmless():
            for name in item.attrs:
                item.attrs[name]
        with _harmless():
            if not is_data or item.external or item.is_virtual:
                continue
            if not item.shape:
                item[()]
                continue
            rows = max(1, SLAB * item.shape[0] // max(item.nbytes, 1))
            for start in range(0, item.shape[0], rows):
                item[start : start + rows]

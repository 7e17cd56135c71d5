"""Crash-safe file object for libhdf5: it hides disk errors and keeps the state of the last commit.

libhdf5 keeps a file open that it could not flush, tries again when the process ends, and may end it by a signal. Hence
it never sees an error of the disk: from the first one on its writes stay in memory, and `commit` raises the error.

Between commits new data go to the disk beyond the committed end, and changes of committed bytes stay in memory. A
commit appends these changes to the file as a write-ahead log before it applies them. A process that is killed thus
leaves the state of its last commit: `repair` applies a complete log, and libhdf5 ignores what follows the end that is
written in its superblock.
"""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rotorsim.base.files import to_disk

PAGE = 4096
MAGIC = b"rotorsim commit\n"
TRAILER = struct.Struct(f"<{len(MAGIC)}sQQI")
"""Magic, number of pages, committed size [byte], checksum of the log before the trailer."""


class CommittedFile(io.RawIOBase):
    """A file open for libhdf5.

    Parameters
    ----------
    path : Path
        The file.
    mode : str
        "x" makes it, "r+" appends to a complete one.

    Attributes
    ----------
    error : OSError or None
        The disk's first error since the last commit.
    """

    def __init__(self, path: Path, mode: str = "x") -> None:
        self._disk: Any = open(path, f"{mode}b+" if mode == "x" else f"{mode}b", buffering=0)  # noqa: SIM115
        self.error: OSError | None = None
        self._position = 0
        self._logged = False
        self._pages: dict[int, bytearray] = {}
        self._keep(os.fstat(self._disk.fileno()).st_size)

    def _keep(self, size: int) -> None:
        """Take the first `size` bytes on the disk for the committed state."""
        self._size = self._committed = size
        self._border = self._written = -(-size // PAGE) * PAGE
        self._pages.clear()

    @property
    def is_removed(self) -> bool:
        """Whether the file is no longer in any folder."""
        return os.fstat(self._disk.fileno()).st_nlink == 0

    def commit(self) -> None:
        """Make the present state the one to keep; raises the OSError of a write that failed since the last commit."""
        self._pad(self._size)
        if self._committed < self._size and self._committed % PAGE:
            self._page(self._committed // PAGE)  # what follows on its page is from an older log
        if self.error is None:
            self._log()
        if self.error is not None:
            raise self.error
        self._logged = True
        self._apply_log()

    def _apply_log(self) -> None:
        _apply(self._disk, self._pages, self._size)
        self._logged = False
        self._keep(self._size)

    def _log(self) -> None:
        """Append the changed pages to the file, if there are any."""
        try:
            self._disk.truncate(max(self._size, self._border))  # an older log must not be applied
            if self._pages:
                self._disk.seek(0, os.SEEK_END)
                _write(self._disk, _log_of(self._pages, self._size))
            to_disk(self._disk)
        except OSError as error:
            self.error = error

    def roll_back(self) -> None:
        """Return to the state of the last commit; libhdf5 must have closed the file. Raises OSError."""
        if self._logged:  # the disk refused to overwrite; the log is still there, for `repair` too
            self._apply_log()
        self._disk.truncate(self._committed)
        self._keep(self._committed)
        self.error = None

    def finish(self) -> None:
        """Commit what is new and cut off the log; raises OSError."""
        if self.error is not None or self._pages or self._size != self._committed:
            self.commit()
        self._disk.truncate(self._committed)
        to_disk(self._disk)

    def copy_to(self, path: Path) -> None:
        """Write the committed state to another file; raises OSError."""
        self._disk.seek(0)
        with path.open("wb") as other:
            left = self._committed
            while left:
                block = self._disk.read(min(left, 1 << 20))
                other.write(block)
                left -= len(block)

    def write(self, data: Any) -> int:
        """Write all of the data at the position."""
        view = memoryview(data).cast("B")
        first = self._position
        self._position += len(view)
        self._size = max(self._size, self._position)
        held = len(view) if self.error else min(max(self._border - first, 0), len(view))
        self._hold(first, view[:held])
        self._append(first + held, view[held:])
        return len(view)

    def _hold(self, first: int, view: memoryview) -> None:
        """Write into pages in memory."""
        for number, start, piece in _split(first, view):
            self._page(number)[start : start + len(piece)] = piece

    def _page(self, number: int) -> bytearray:
        """A page in memory."""
        if number not in self._pages:
            self._pages[number] = self._stored(number * PAGE, PAGE)
        return self._pages[number]

    def _append(self, first: int, view: memoryview) -> None:
        """Write beyond the committed state: to the disk or, where that fails, into memory."""
        if not len(view):
            return
        self._pad(first)
        try:
            if self.error is None:
                self._disk.seek(first)
                _write(self._disk, view)
                self._written = max(self._written, first + len(view))
        except OSError as error:
            self.error = error
        if self.error is not None:
            self._hold(first, view)

    def _pad(self, end: int) -> None:
        """Fill the disk with zeros up to `end`, so that no later write into a hole can fail."""
        while self.error is None and self._written < end:
            try:
                self._disk.seek(self._written)
                self._written += self._disk.write(bytes(min(end - self._written, 1 << 20)))
            except OSError as error:
                self.error = error

    def _stored(self, first: int, size: int) -> bytearray:
        """Bytes on the disk that belong to the state; zeros where there are none."""
        end = self._committed if first < self._border else self._written
        found = bytearray(size)
        self._disk.seek(first)
        view = memoryview(found)[: max(min(size, end - first), 0)]
        while len(view) and (n := self._disk.readinto(view)):
            view = view[n:]
        return found

    def readinto(self, buffer: Any) -> int:
        """Read at the position; zeros beyond the end."""
        view = memoryview(buffer).cast("B")
        first, border = self._position, self._border
        inner = min(max(border - first, 0), len(view))
        view[:inner] = self._stored(first, inner)
        view[inner:] = self._stored(first + inner, len(view) - inner)
        for number, start, piece in _split(first, view) if self._pages else ():
            if number in self._pages:
                piece[:] = self._pages[number][start : start + len(piece)]
        self._position += len(view)
        return len(view)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move the position."""
        base = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size}
        self._position = base[whence] + offset
        return self._position

    def tell(self) -> int:
        """The position."""
        return self._position

    def truncate(self, size: int | None = None) -> int:
        """Set the end of the file."""
        self._size = self._position if size is None else size
        self._written = max(min(self._written, self._size), self._border)
        return self._size

    def readable(self) -> bool:
        """Yes."""
        return True

    def writable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True

    def close(self) -> None:
        """Close the file as it is."""
        self._disk.close()
        super().close()


def repair(path: Path) -> None:
    """Restore a file of a killed process to the state of its last commit.

    A log that is complete is applied; without one the file is in that state already.
    """
    with path.open("rb+", buffering=0) as disk:
        end = disk.seek(0, os.SEEK_END)
        if end < TRAILER.size:
            return
        disk.seek(end - TRAILER.size)
        magic, count, size, checksum = TRAILER.unpack(disk.read(TRAILER.size))
        first = end - TRAILER.size - count * (8 + PAGE)
        if magic != MAGIC or first < size:
            return
        disk.seek(first)
        log = disk.read(count * (8 + PAGE))
        if zlib.crc32(log) == checksum:
            _apply(disk, dict(_pages_of(log)), size)
            disk.truncate(size)


def _log_of(pages: dict[int, bytearray], size: int) -> bytes:
    log = b"".join(struct.pack("<Q", number) + page for number, page in sorted(pages.items()))
    return log + TRAILER.pack(MAGIC, len(pages), size, zlib.crc32(log))


def _pages_of(log: bytes) -> Iterator[tuple[int, bytearray]]:
    for start in range(0, len(log), 8 + PAGE):
        yield struct.unpack_from("<Q", log, start)[0], bytearray(log[start + 8 : start + 8 + PAGE])


def _apply(disk: Any, pages: dict[int, bytearray], size: int) -> None:
    for number, page in pages.items():
        disk.seek(number * PAGE)
        _write(disk, memoryview(page)[: max(size - number * PAGE, 0)])


def _split(first: int, view: memoryview) -> Iterator[tuple[int, int, memoryview]]:
    """Page by page: number of the page, first byte in it, piece of the view."""
    done = 0
    while done < len(view):
        number, start = divmod(first + done, PAGE)
        piece = view[done : done + PAGE - start]
        yield number, start, piece
        done += len(piece)


def _write(disk: Any, data: Any) -> None:
    """Write all: a write to the disk may be partial before it fails."""
    view = memoryview(data)
    while len(view):
        view = view[disk.write(view) :]

"""Reading of whole HDF5 files in a child process of `rotorsim.base.hdf5`, which contains their crashes and hangs."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import h5netcdf
import h5py

try:
    import resource
except ImportError:  # Windows: the parent's time limit alone
    resource = None  # type: ignore[assignment]

SLAB = 1 << 23
"""Bytes read at a time."""
MEMORY = 2 << 30
"""Address space [byte] beyond what the process has at its start."""


def read_whole(path: str, seconds: float, most: float) -> bool:
    """Read all that is in a file: once as HDF5, once as netCDF, with whatever exceptions, for these do no harm.

    False if it needs more memory [byte] than `most` or than there is; a signal ends the process that takes longer than
    the computing time `seconds`.
    """
    limit_memory()
    limit_time(seconds)
    try:
        with harmless(), h5py.File(path, "r") as file:
            if declared(file) > most:
                return False
            walk(file)
        with harmless(), h5netcdf.File(path, "r", phony_dims="sort") as file:
            for variable in file.variables.values():
                dict(variable.attrs)
    except MemoryError:
        return False
    return True


@lru_cache(maxsize=1)
def limit_memory() -> None:
    """Limit the address space to `MEMORY` above its present size."""
    if resource is not None and sys.platform == "linux":
        with open("/proc/self/statm") as file:
            size = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, resource.RLIM_INFINITY))


def limit_time(seconds: float) -> None:
    """Limit the remaining CPU time [s]; SIGXCPU ends the process."""
    if resource is not None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        limit = math.ceil(used.ru_utime + used.ru_stime + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))


@contextmanager
def harmless() -> Iterator[None]:
    """Suppress every exception except lack of memory."""
    try:
        yield
    except MemoryError:
        raise
    except Exception:
        pass


def objects(root: Any) -> Iterator[Any]:
    """All groups and data sets that lie in the file itself, each once."""
    queue, seen = [root], set()
    while queue:
        item = queue.pop()
        found = address(item)
        if found in seen:
            continue
        seen |= {found} - {None}
        yield item
        if isinstance(item, h5py.Group) and found is not None:
            with harmless():
                queue.extend(members(item))


def address(item: Any) -> int | None:
    """Address of an object in its file; None if damage hides it (data are still read, members are not)."""
    with harmless():
        return int(h5py.h5o.get_info(item.id).addr)
    return None


def members(group: Any) -> Iterator[Any]:
    """Members of a group that are hard links."""
    for name in group:
        with harmless():
            if isinstance(group.get(name, getlink=True), h5py.HardLink):
                yield group[name]


def declared(root: Any) -> float:
    """Total declared size of a file's data sets [bytes]."""
    return float(sum(size(item) for item in objects(root) if isinstance(item, h5py.Dataset)))


def size(item: Any) -> int:
    """Bytes of a data set; 0 if damage hides it."""
    with harmless():
        return item.nbytes if item.shape else 0
    return 0


def walk(root: Any) -> None:
    """Read all attributes and all data."""
    for item in objects(root):
        with harmless():
            attributes(item)
        if isinstance(item, h5py.Dataset) and not item.external and not item.is_virtual:
            with harmless():
                data(item)


def attributes(item: Any) -> None:
    """Read the attributes of an object."""
    for name in item.attrs:
        with harmless():
            item.attrs[name]


def data(item: Any) -> None:
    """Read a data set piece by piece."""
    if not item.shape:
        item[()]
        return
    rows = max(1, SLAB * item.shape[0] // max(item.nbytes, 1))
    for start in range(0, item.shape[0], rows):
        item[start : start + rows]

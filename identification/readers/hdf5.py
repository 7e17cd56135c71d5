"""Safe opening of HDF5 files: no links out of the file, no more data than the file can hold.

A child process reads it first, because a damaged file can crash libhdf5 or keep it busy for ever.

Links to other files, external and virtual datasets are refused, because a file must not make the reader open others.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any

from identification.errors import ReadError
from identification.records.table import MAX_VALUES
from rotorsim.base.hdf5 import check_hdf5
from rotorsim.base.sentences import quote

MAX_OBJECTS = 10_000


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """The file's root group, checked; raises ReadError if it is damaged or refers to anything outside."""
    import h5py

    if wrong := check_hdf5(path):
        raise ReadError(wrong)
    try:
        file = h5py.File(path, "r")
    except (OSError, ValueError, RuntimeError) as error:
        raise ReadError("is a damaged or cut off HDF5 file; copy it again") from error
    with file:
        try:
            check(file)
            yield file
        except ReadError:
            raise
        except Exception as error:  # h5py answers damage with anything from KeyError to UnicodeDecodeError
            raise ReadError("is a damaged or cut off HDF5 file; copy it again") from error


def check(root: Any) -> None:
    """Raise ReadError for links and datasets that lead out of the file, and for more data than can be read."""
    import h5py

    queue, seen = [root], 0
    while queue:
        group = queue.pop()
        for name in group:
            seen += 1
            if seen > MAX_OBJECTS:
                raise ReadError(f"holds more than {MAX_OBJECTS} objects; it is not a record")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ReadError(f"{quote(name)} is a link; store the data itself in the file")
            item = group[name]
            if isinstance(item, h5py.Dataset):
                check_dataset(name, item)
            elif isinstance(item, h5py.Group) and group is root:
                queue.append(item)


def check_dataset(name: str, dataset: Any) -> None:
    """Raise ReadError if a dataset lies outside the file or is too large."""
    if dataset.external or dataset.is_virtual:
        raise ReadError(f"{quote(name)} keeps its data in another file; store them in this one")
    if prod(dataset.shape or (0,)) > MAX_VALUES:
        raise ReadError(f"{quote(name)} declares {prod(dataset.shape)} values, above the limit of {MAX_VALUES}; cut it")

"""One variable of many records as a dask array whose chunks are groups of records: few tasks, whatever the number."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

CHUNK = 64_000_000
"""Bytes of a chunk, about."""


@dataclass(frozen=True)
class Variable:
    """An array (case, *shape) that is read from its files when it is indexed; shorter records end in NaN."""

    paths: tuple[Path, ...]
    name: str
    record: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def shape(self) -> tuple[int, ...]:
        """Cases first."""
        return (len(self.paths), *self.record)

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.shape)

    def __getitem__(self, where: tuple[slice, ...]) -> np.ndarray:
        """Values of a block."""
        cases, *rest = where
        bounds = [part.indices(size) for part, size in zip(rest, self.record, strict=True)]
        paths = self.paths[cases]
        block = np.full((len(paths), *(len(range(*bound)) for bound in bounds)), self._missing, self.dtype)
        for row, path in zip(block, paths, strict=True):
            found = _read(path, self.name, tuple(slice(*bound) for bound in bounds))
            row[tuple(slice(n) for n in found.shape)] = found
        return block

    @property
    def _missing(self) -> Any:
        return np.nan if self.dtype.kind == "f" else 0


def _read(path: Path, name: str, where: tuple[slice, ...]) -> np.ndarray:
    import h5py

    with h5py.File(path, "r") as file:
        return np.asarray(file[name][where])


def stacked(variable: Variable) -> Any:
    """The dask array of a variable."""
    import dask.array as da

    size = int(np.prod(variable.record)) * variable.dtype.itemsize
    together = int(np.clip(CHUNK // max(size, 1), 1, len(variable.paths)))
    first = variable.record[0] if size <= CHUNK else max(1, variable.record[0] * CHUNK // size)
    return da.from_array(
        variable, chunks=(together, first, *variable.record[1:]), name=False, meta=np.empty(0, variable.dtype)
    )

"""One variable of many records as a dask array whose chunks are groups of records: few tasks, whatever the number."""

from __future__ import annotations

from collections.abc import Sequence
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

    def __getitem__(self, where: tuple[Any, ...]) -> np.ndarray:
        """Values at one index per dimension: a number, a slice or a list of numbers, each dimension by itself."""
        cases, *rest = (_places(one, size) for one, size in zip(where, self.shape, strict=True))
        spans = tuple(slice(min(numbers, default=0), max(numbers, default=-1) + 1) for numbers in rest)
        block = np.full((len(cases), *(span.stop - span.start for span in spans)), self._missing, self.dtype)
        for row, case in zip(block, cases, strict=True):
            found = _read(self.paths[case], self.name, spans)
            row[tuple(slice(n) for n in found.shape)] = found
        for axis, (numbers, span) in enumerate(zip(rest, spans, strict=True), start=1):
            if numbers != range(span.start, span.stop):  # backwards, with steps, or picked
                block = block.take([number - span.start for number in numbers], axis)
        return block[tuple(0 if isinstance(one, (int, np.integer)) else slice(None) for one in where)]

    @property
    def _missing(self) -> Any:
        return np.nan if self.dtype.kind == "f" else 0


def _places(where: Any, size: int) -> Sequence[int]:
    """The numbers that an index stands for."""
    if isinstance(where, slice):
        return range(size)[where]
    return [range(size)[number] for number in np.ravel(where)]


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

"""Lazy dask array of one variable over many records, chunked by groups of records."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.campaign.errors import StoreError

CHUNK = 64_000_000
"""Bytes of a chunk, about."""


@dataclass(frozen=True)
class Variable:
    """Array (case, *shape) read from its files on indexing; shorter records are padded with NaN."""

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
    with opened(path) as file:
        return np.asarray(file[name][where])


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open record file; raises StoreError if it cannot be read.

    It is not read in a child process first as files of others are: its size is that of the file that was written.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except (OSError, KeyError, RuntimeError, ValueError) as error:
        raise StoreError(f"{path}: cannot be read ({error}); remove it and run the campaign again") from error


def stacked(variable: Variable) -> Any:
    """Dask array of a variable over all cases."""
    import dask.array as da

    size = int(np.prod(variable.record)) * variable.dtype.itemsize
    together = int(np.clip(CHUNK // max(size, 1), 1, len(variable.paths)))
    first = variable.record[0] if size <= CHUNK else max(1, variable.record[0] * CHUNK // size)
    return da.from_array(
        variable, chunks=(together, first, *variable.record[1:]), name=False, meta=np.empty(0, variable.dtype)
    )

"""HDF5 files of other programs: vectors and matrices of numbers at the top or one group below it.

A data set gives a column, a matrix one for each of its shorter dimension (MATLAB writes matrices turned round). Units
are taken from the attribute `units` or `unit`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import ReadError
from identification.readers.hdf5 import check_dataset, opened
from identification.records.table import Column, Table

WIDEST = 64


def read_plain_hdf5(path: Path) -> Table:
    """Table of a file's numeric data sets; raises ReadError if there is none."""
    import h5py

    columns: list[Column] = []
    others: dict[str, str] = {}
    with opened(path) as file:
        for name, item in _items(file):
            if not isinstance(item, h5py.Dataset):
                continue
            check_dataset(name, item)
            if item.dtype.kind not in "fiub" or item.ndim not in (1, 2) or 0 in item.shape:
                others[name] = f"has shape {item.shape} of {item.dtype}; save vectors of numbers"
            elif item.ndim == 2 and min(item.shape) > WIDEST:
                others[name] = f"has shape {item.shape}, more than {WIDEST} columns; save vectors"
            else:
                columns += _columns(name, np.asarray(item[()], float), _unit(item))
    if not columns:
        raise ReadError("holds no vector of numbers; save some")
    return Table("HDF5", tuple(columns), others)


def _items(file: Any) -> Iterator[tuple[str, Any]]:
    """Objects at the top, and in groups there as `group/name`."""
    for name, item in file.items():
        if hasattr(item, "items") and not name.startswith("#"):
            yield from ((f"{name}/{inner}", part) for inner, part in item.items())
        else:
            yield name, item


def _columns(name: str, values: np.ndarray, unit: str | None) -> list[Column]:
    if values.ndim == 1 or 1 in values.shape:
        return [Column(name, values.ravel(), unit, (name.rpartition("/")[2],))]
    long = values if values.shape[0] >= values.shape[1] else values.T
    return [Column(f"{name}_{i + 1}", column, unit) for i, column in enumerate(long.T)]


def _unit(item: Any) -> str | None:
    for key in ("units", "unit"):
        found = item.attrs.get(key)
        text = found.decode("utf-8", "replace") if isinstance(found, bytes) else found
        if isinstance(text, str) and text.strip():
            return text.strip()
    return None

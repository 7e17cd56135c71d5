"""MATLAB v5 writer: one vector or matrix per variable with a row per sample, units, header as text."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.readers.mat import HEADER, MAX_WIDTH
from identification.records.vectors import VECTORS
from identification.writers.flat import flat_columns, header
from rotorsim.base.files import replacing

if TYPE_CHECKING:
    import xarray as xr


def write_mat(record: xr.Dataset, path: Path) -> None:
    """Write a record or run-up vectors as a .mat file."""
    from scipy.io import savemat

    columns = flat_columns(record)
    content: dict[str, Any] = {name: column[:, None] for name, (_, column) in columns.items()}
    units = {name: unit for name, (unit, _) in columns.items()}
    for name in map(str, record.data_vars):
        if name not in VECTORS and record[name].ndim == 2 and _is_plain(record, name):
            parts = [content.pop(f"{name}_{label}") for label in record[record[name].dims[1]].values]
            for label in record[record[name].dims[1]].values:
                units[name] = units.pop(f"{name}_{label}")
            content[name] = np.hstack(parts)
    with replacing(path) as part, part.open("wb") as file:
        savemat(file, {**content, "units": units, HEADER: header(record)}, long_field_names=True, do_compression=True)


def _is_plain(record: xr.Dataset, name: str) -> bool:
    """Whether the columns' labels are those that the reader gives them back, and the shape is one it takes."""
    labels = record[record[name].dims[1]].values.tolist()
    return 1 < len(labels) <= min(record.sizes["time"], MAX_WIDTH) and labels in (
        ["x", "y"],
        list(range(1, len(labels) + 1)),
    )

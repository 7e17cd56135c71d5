"""CSV writer: header and provenance in two comment lines, names with units, numbers exact to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from identification.records.table import MARK
from identification.writers.flat import flat_columns, header
from rotorsim.base.files import replacing

if TYPE_CHECKING:
    import xarray as xr

ROWS = 10_000
"""Rows turned into text at a time."""


def write_csv(record: xr.Dataset, path: Path) -> None:
    """Write a record or run-up vectors as comma-separated text."""
    columns = flat_columns(record)
    lines = [f"# {MARK}, version 1", f"# {header(record)}"]
    lines.append(",".join(f"{name} [{unit}]" for name, (unit, _) in columns.items()))
    values = [column for _, column in columns.values()]
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(lines) + "\n")
        for start in range(0, len(values[0]), ROWS):
            block = np.column_stack([column[start : start + ROWS] for column in values]).tolist()
            file.writelines(",".join(map(repr, row)) + "\n" for row in block)

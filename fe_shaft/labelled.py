"""Results as xarray Datasets, every variable with its unit and long name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

Variable = tuple[tuple[str, ...], Any, str, str]
"""Dimensions, values, unit, long name."""


def dataset(variables: dict[str, Variable], coords: dict[str, Variable], **attrs: Any) -> xr.Dataset:
    """A Dataset of (dimensions, values, unit, long name)."""
    import xarray as xr

    def unpack(table: dict[str, Variable]) -> dict[str, Any]:
        return {
            key: (dims, np.asarray(values), {"units": unit, "long_name": text})
            for key, (dims, values, unit, text) in table.items()
        }

    return xr.Dataset(unpack(variables), unpack(coords), attrs)

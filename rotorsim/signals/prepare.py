"""Preparation of records: `angle`, `speed` and `pressure` under common names.

A measured record may have them under `..._measured` only, or not at all. What is not there is put in as zero, which
costs no memory, and named in the attribute `assumed`; a speed that follows from the angle is differentiated where it
is read.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from rotorsim.base.errors import DataError
from rotorsim.signals.record_blocks import displacement_name

HALF_SPAN = 0.01
"""Half the stretch [s] over which a speed is taken from the angle."""


class SpeedOfAngle(BackendArray):
    """Shaft speed [rad/s] as the slope of the angle [rad] about each sample, computed for the samples that are read."""

    def __init__(self, angle: xr.Variable, dt: float) -> None:
        self.angle, self.dt = angle, dt
        self.shape, self.dtype = angle.shape, np.dtype(float)
        self.half = max(1, min(round(HALF_SPAN / dt), (angle.shape[0] - 1) // 2))

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        n = self.shape[0]
        wanted = np.arange(n)[key[0]] if not isinstance(key[0], slice) else np.arange(*key[0].indices(n))
        first = max(0, int(np.min(wanted, initial=n)) - self.half)
        angle = np.asarray(self.angle[first : int(np.max(wanted, initial=0)) + self.half + 1].values, float)
        left, right = np.maximum(wanted - self.half, 0), np.minimum(wanted + self.half, n - 1)
        return (angle[right - first] - angle[left - first]) / ((right - left) * self.dt)


def prepared(record: xr.Dataset) -> xr.Dataset:
    """The record with `angle`, `speed` and two or more samples, still unread.

    Raises
    ------
    DataError
        Without a displacement of the disc, or with fewer than two samples.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "disc" in rs.signals.prepared(record)
    True
    """
    displacement_name(record)
    n = record.sizes.get("time", 0)
    if n < 2:
        raise DataError(f"record: {n} samples make no report; give at least 2")
    for name in ("angle", "speed", "pressure"):
        if name not in record and f"{name}_measured" in record:
            record = record.assign({name: record[f"{name}_measured"].variable})
    assumed = [name for name in ("angle", "speed") if name not in record]
    if assumed == ["speed"]:
        record, assumed = record.assign(speed=("time", _slope(record))), []
    nothing = np.broadcast_to(0.0, n)
    record = record.assign({name: ("time", nothing) for name in assumed})
    return record.assign_attrs(assumed=" ".join(assumed)) if assumed else record


def _slope(record: xr.Dataset) -> Any:
    return indexing.LazilyIndexedArray(SpeedOfAngle(record["angle"].variable, sampling_time(record)))


def sampling_time(record: xr.Dataset) -> float:
    """Mean sampling time [s]."""
    ends = np.asarray(record["time"].isel(time=[0, -1]).values, float)
    return float(ends[1] - ends[0]) / (record.sizes["time"] - 1)


def sensed_name(record: xr.Dataset) -> str:
    """Displacement for an identification: `disc_measured` if present, else `disc`."""
    return "disc_measured" if "disc_measured" in record else displacement_name(record)

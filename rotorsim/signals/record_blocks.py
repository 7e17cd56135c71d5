"""Records of any length: opened, prepared under common names, and read block by block.

A measured record may have `angle`, `speed` and `pressure` under `..._measured` only, or not at all. A missing one is
put in as zero, which costs no memory, and named in the attribute `assumed`; a speed that follows from the angle is
differentiated where it is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from identification.records.schema import measured_name, named_axes
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.hdf5 import check_hdf5


class MissingError(RotorsimError):
    """Raised where a record holds nothing for a figure; the message is a sentence for the reader of the report."""


def need(held: bool, sentence: str) -> None:
    """Raise MissingError with the sentence unless `held`."""
    if not held:
        raise MissingError(sentence)


BLOCK = 100_000
"""Samples read at a time."""
Values = dict[str, np.ndarray]


def open_record(path: str | Path) -> xr.Dataset:
    """Open a record without reading it, not even its time axis where xarray allows that; raises DataError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.open_record("run.nc")["disc"].sel(axis="x").sizes["time"] > 0
    True
    """
    try:
        if wrong := check_hdf5(Path(path)):
            raise DataError(f"{path}: {wrong}")
        return named_axes(_opened(path))
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as a record ({error}); give a file that a run wrote") from error


def _opened(path: str | Path) -> xr.Dataset:
    try:
        return xr.open_dataset(path, engine="h5netcdf", create_default_indexes=False)
    except TypeError:  # an xarray before that option
        return xr.open_dataset(path, engine="h5netcdf")


def displacement_name(record: xr.Dataset) -> str:
    """`disc` of a virtual record, `disc_measured` of a measured one; raises DataError without either."""
    for name in ("disc", "disc_measured"):
        if name in record:
            return name
    raise DataError("record: neither 'disc' nor 'disc_measured'; give the displacement of the disc")


def blocks(record: xr.Dataset, names: Sequence[str], size: int = BLOCK) -> Iterator[Values]:
    """Values of some variables, block after block of time."""
    missing = [name for name in names if name not in record.variables]
    if missing:
        raise DataError(f"record: no variable '{missing[0]}'; it is needed for this analysis")
    for start in range(0, record.sizes["time"], size):
        part = record.isel(time=slice(start, start + size))
        yield {name: np.asarray(part[name].values, float) for name in names}


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
    return measured_name(record, "disc") or displacement_name(record)


def overlapping(record: xr.Dataset, names: Sequence[str], length: int, hop: int) -> Iterator[Values]:
    """Blocks of whole segments of `length` samples, a new segment every `hop` samples; a rest is left out."""
    held: Values = {}
    for values in blocks(record, names, max(BLOCK // 2, length)):
        held = {k: np.concatenate((held[k], v)) for k, v in values.items()} if held else values
        count = (len(held[names[0]]) - length) // hop + 1
        if count > 0:
            yield {k: v[: (count - 1) * hop + length] for k, v in held.items()}
            held = {k: v[count * hop :] for k, v in held.items()}


ENVELOPE_BINS = 600


@dataclass(frozen=True)
class Envelope:
    """Least, largest and mean value (bin, ...) of a variable in stretches of the record around `time` (bin,) [s]."""

    time: np.ndarray
    least: np.ndarray
    most: np.ndarray
    mean: np.ndarray


def envelopes(record: xr.Dataset, names: Sequence[str], bins: int = ENVELOPE_BINS) -> dict[str, Envelope]:
    """Envelopes of some variables in at most `bins` stretches of equally many samples, in one pass."""
    per_bin = max(1, -(-record.sizes["time"] // bins))
    rows: dict[str, list[tuple[np.ndarray, ...]]] = {name: [] for name in names}
    time = []
    for block in blocks(record, ["time", *names], per_bin * max(1, 100_000 // per_bin)):
        starts = np.arange(0, len(block["time"]), per_bin)
        counts = np.diff(np.append(starts, len(block["time"])))
        time.append(np.add.reduceat(block["time"], starts) / counts)
        for name in names:
            v = block[name]
            mean = np.add.reduceat(v, starts) / counts.reshape(-1, *(1,) * (v.ndim - 1))
            rows[name].append((np.minimum.reduceat(v, starts), np.maximum.reduceat(v, starts), mean))
    middle = np.concatenate(time)
    return {k: Envelope(middle, *(np.concatenate(part) for part in zip(*v, strict=True))) for k, v in rows.items()}


SECONDS = 0.25
"""Length of the stretch [s]; that of a fast shaft is down to a fifth of it."""
TURNS = 8.0
"""Most turns of the shaft in the stretch."""
LEAD = 0.1
"""Share of the stretch that lies before the event."""


def eventful_stretch(record: xr.Dataset, names: list[str], speed: float) -> slice:
    """Samples about the largest change of the inputs `names` (time, axis); the middle of the record without any.

    `speed` [rad/s] shortens the stretch of a fast shaft.
    """
    dt, n = sampling_time(record), record.sizes["time"]
    seconds = np.clip(2 * np.pi * TURNS / speed, SECONDS / 5, SECONDS) if speed > 0 else SECONDS
    count = int(min(n, max(2, round(float(seconds) / dt))))
    event = largest_change(record, names)
    start = n // 2 - count // 2 if event is None else event - round(LEAD * count)
    start = int(np.clip(start, 0, n - count))
    return slice(start, start + count)


def largest_change(record: xr.Dataset, names: list[str]) -> int | None:
    """Sample of the largest change from one sample to the next, of the first input that changes at all."""
    best: dict[str, tuple[float, int]] = {}
    last: dict[str, np.ndarray] = {}
    position = 0
    for block in blocks(record, names) if names else ():
        for name, values in block.items():
            joined = np.concatenate((last.get(name, values[:1]), values))
            change = np.abs(np.diff(joined, axis=0)).max(axis=1)
            i = int(change.argmax())
            if change[i] > best.get(name, (0.0, 0))[0] * (1 + 1e-6):
                best[name] = (float(change[i]), position + i)
            last[name] = values[-1:]
        position += len(block[names[0]])
    return next((best[name][1] for name in names if name in best), None)

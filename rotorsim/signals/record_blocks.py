r"""Records of any length: opened, prepared under common names, read block by block; readings of their probes.

A measured record may have `angle`, `speed` and `pressure` under `..._measured` only, or not at all. A missing one is
put in as zero, which costs no memory, and named in the attribute `assumed`; a speed that follows from the angle is
differentiated where it is read.

The runout profile of a figure is the mean over the shaft angle at slow roll: of samples of any number in bins of the
angle, in one pass, and the harmonics of the mean. What a prefilter subtracts is `identification.Runout`: a function of
the angle, without gaps and of zero mean, from samples in memory.

Cites: thesis.
"""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr
from xarray.backends import BackendArray, CachingFileManager
from xarray.core import indexing

from identification import SchemaError
from identification.records.schema import measured_name, named_axes
from identification.records.sensors import SAME_PLACE, fit_harmonics, probe_outputs
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
DECODED = {"_FillValue", "missing_value", "scale_factor", "add_offset"}
"""Attributes in a file that say that its numbers are not the values."""
Values = dict[str, np.ndarray]


def open_record(path: str | Path) -> xr.Dataset:
    """Open a record without reading it, not even its time axis where xarray allows that; raises DataError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.open_record("run.nc")["disc"].sel(axis="x").sizes["time"] > 0
    True
    """
    if not Path(path).exists():
        raise DataError(f"{path}: is not there; give the path of a record or result")
    try:
        if wrong := check_hdf5(Path(path)):
            raise DataError(f"{path}: {wrong}")
        return _read_directly(named_axes(xr.open_dataset(path, engine="h5netcdf", create_default_indexes=False)), path)
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as a record ({error}); give a file that a run wrote") from error


class StoredArray(BackendArray):
    """Numbers of a variable in a file, read where they lie.

    Before each piece h5netcdf asks all variables along a growing dimension for their lengths, which takes longer than
    to read it.
    """

    def __init__(self, file: CachingFileManager, name: str, shape: tuple[int, ...]) -> None:
        self.file, self.name, self.shape, self.dtype = file, name, shape, np.dtype(float)

    def __getitem__(self, key: Any) -> Any:
        level = indexing.IndexingSupport.OUTER_1VECTOR
        return indexing.explicit_indexing_adapter(key, self.shape, level, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        with self.file.acquire_context() as file:
            return file[self.name][key]


def _read_directly(record: xr.Dataset, path: str | Path) -> xr.Dataset:
    """An open record whose numbers over time are read without h5netcdf, where they need no decoding."""
    manager, found = CachingFileManager(h5py.File, os.path.abspath(path), mode="r"), {}
    with manager.acquire_context() as file:
        for name, variable in record.variables.items():
            stored = file.get(str(name)) if "time" in variable.dims else None
            if not isinstance(stored, h5py.Dataset) or DECODED & variable.encoding.keys():
                continue
            if stored.dtype == variable.dtype == float and stored.shape == variable.shape:
                data = indexing.LazilyIndexedArray(StoredArray(manager, str(name), variable.shape))
                found[name] = xr.Variable(variable.dims, data, variable.attrs, variable.encoding)
    coords = {name: found.pop(name) for name in list(found) if name in record.coords}
    read = record.assign(found).assign_coords(xr.Coordinates(coords, indexes={}))
    read.set_close(partial(_close, record, manager))
    return read


def _close(record: xr.Dataset, file: CachingFileManager) -> None:
    record.close()
    file.close()


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
        piece = {"time": slice(start, start + size)}
        yield {name: np.asarray(record.variables[name].isel(piece, missing_dims="ignore").values, float)
               for name in names}  # fmt: skip


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
        slope = SpeedOfAngle(record["angle"].variable, sampling_time(record))
        record, assumed = record.assign(speed=("time", indexing.LazilyIndexedArray(slope))), []
    nothing = np.broadcast_to(0.0, n)
    record = record.assign({name: ("time", nothing) for name in assumed})
    return record.assign_attrs(assumed=" ".join(assumed)) if assumed else record


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


READINGS = "probe_measured"
SHOWN = {"m": ("µm", 1e6), "m/s": ("mm/s", 1e3), "m/s^2": ("m/s²", 1.0), "V": ("V", 1.0)}
"""Unit in which a reading is shown, and its factor."""


def probe_numbers(record: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Numbers of each probe by its name: unit, mean, and rms and peak about the mean, in its unit; in two passes.

    Empty for a record without readings of probes.
    """
    if READINGS not in record:
        return {}
    n = record.sizes["time"]
    mean = sum(block[READINGS].sum(axis=0) for block in blocks(record, [READINGS])) / n
    square, peak = np.zeros(len(mean)), np.zeros(len(mean))
    for block in blocks(record, [READINGS]):
        off = block[READINGS] - mean
        square += (off**2).sum(axis=0)
        peak = np.maximum(peak, np.abs(off).max(axis=0))
    columns = zip(probe_names(record), probe_units(record), mean, np.sqrt(square / n), peak, strict=True)
    return {
        name: {"unit": unit, "mean": float(m), "rms": float(rms), "peak": float(p)} for name, unit, m, rms, p in columns
    }


def probe_names(record: xr.Dataset) -> list[str]:
    """Names of the probes of a record."""
    return [str(name) for name in record["probe"].values]


def probe_units(record: xr.Dataset) -> list[str]:
    """Units of their readings."""
    return [str(unit) for unit in record["probe_unit"].values]


def shown_reading(value: float, unit: str) -> str:
    """A reading as text."""
    text, factor = SHOWN[unit]
    return f"{value * factor:.3g} {text}"


def probe_planes(record: xr.Dataset) -> list[tuple[str, ...]]:
    """Names of the displacement probes of each plane in which they see both x and y, along the shaft.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.signals.probe_planes(record)
    []
    """
    if READINGS not in record or not {"probe_position", "probe_quantity"} <= set(record.coords):
        return []
    places = np.asarray(record["probe_position"].values, float)
    kinds = record["probe_quantity"].values
    found: dict[tuple[float, str], list[str]] = {}
    for name, z, kind in sorted(zip(probe_names(record), places, kinds, strict=True), key=lambda one: one[1]):
        group = next((g for g in found if abs(g[0] - z) <= SAME_PLACE and g[1] == kind), (float(z), str(kind)))
        found.setdefault(group, []).append(name)
    return [tuple(group) for group in found.values() if _sees_both(record, group)]


def _sees_both(record: xr.Dataset, group: list[str]) -> bool:
    try:
        probe_outputs(record.isel(time=slice(0, 2)), group)
    except SchemaError:
        return False
    return True


BINS, HARMONICS = 180, 8


@dataclass(frozen=True)
class RunoutProfile:
    """Runout over `angle` (bin,) [rad]: `mean` (bin, axis) [m], less its average, and its standard deviation `scatter`
    (bin, axis) [m]; `harmonic` (order, axis) complex 0-pk [m] of 1X, 2X ...; number of `revolutions`."""

    angle: np.ndarray
    mean: np.ndarray
    scatter: np.ndarray
    harmonic: np.ndarray
    revolutions: float


def runout_of(record: xr.Dataset, name: str, revolutions: float, bins: int = BINS) -> RunoutProfile:
    """Runout profile of a variable (time, axis) [m] over `angle`, in one pass; empty bins are NaN.

    Test: ``test_signals.py::test_a_runout_of_known_harmonics_is_found``.

    Examples
    --------
    >>> import rotorsim as rs
    >>> slow = rs.experiments.slow_roll(plant, speed=60.0, pressure=0.5e6, revolutions=2)
    >>> rs.signals.runout_of(slow, "disc", revolutions=2.0).mean.shape
    (131, 2)
    """
    need(revolutions >= 1, f"The shaft turns {revolutions:.2g} revolutions; a runout takes a whole one.")
    bins = int(np.clip(record.sizes["time"] / (4 * revolutions), 2 * HARMONICS + 2, bins))
    count, sums, squares = np.zeros(bins), np.zeros((bins, 2)), np.zeros((bins, 2))
    origin = np.asarray(record[name].isel(time=0).values, float)
    for block in blocks(record, ("angle", name)):
        index = np.minimum((block["angle"] % (2 * np.pi) * bins / (2 * np.pi)).astype(int), bins - 1)
        d = block[name] - origin
        count += np.bincount(index, minlength=bins)
        for k in range(2):
            sums[:, k] += np.bincount(index, d[:, k], bins)
            squares[:, k] += np.bincount(index, d[:, k] ** 2, bins)
    held = np.where(count > 0, count, np.nan)[:, None]
    mean = sums / held
    scatter = np.sqrt(np.maximum(squares / held - mean**2, 0))
    angle = (np.arange(bins) + 0.5) * 2 * np.pi / bins
    seen = np.isfinite(mean[:, 0])
    c = fit_harmonics(angle[seen], mean[seen], HARMONICS)
    harmonic = c[:HARMONICS] - 1j * c[HARMONICS:]
    return RunoutProfile(angle, mean - np.nanmean(mean, axis=0), scatter, harmonic, revolutions)

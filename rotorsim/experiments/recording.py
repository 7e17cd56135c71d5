"""Streaming of a run into a netCDF-4 file with constant memory; interrupted records stay valid.

The file grows under a temporary name in the same folder and is moved to its own when it is closed, complete or
interrupted. It is flushed every second: a kill costs what was recorded since, and the record where it hits the few
milliseconds of a flush. The space for the next samples is reserved before they are written: a disk that takes no more
ends the record, `write` raises WriteError, and what was written until then is kept. `recover` brings records of killed
runs back from their temporary files.
"""

from __future__ import annotations

import errno
import os
import time as clock
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any

import h5netcdf
import h5py
import numpy as np

from identification import AXES, PROBE_COORDINATES, VARIABLES, probe_units
from identification.records.schema import warm_bodies
from rotorsim.base import files
from rotorsim.base.hdf5 import DiskFile, check_hdf5, trust_hdf5

CHUNK = 1000
"""Samples that are stored together."""
BLOCK = 5 * CHUNK
"""Samples that are written at once."""
FLUSH = 1.0
"""Time [s] between two flushes of the file."""
STRUCTURE = 6000
"""Space [byte] that is reserved for a variable's part of the file's own tables."""
FEWEST = 2
"""Samples of the shortest record that the schema takes."""
REMOVED = "cannot be written: it was removed while it was written; leave its folder alone until the run has ended"
Values = dict[str, np.ndarray]


def snapshot_variables(several: bool) -> dict[str, tuple[tuple[str, ...], str, str]]:
    """Dimensions, unit and long name of what is kept of snapshots of a film, or of several: coordinates first."""
    film = ("bearing",) if several else ()
    return {
        "theta": (("theta",), "rad", "angle on the bearing"),
        "film_z" if several else "z": ((*film, "z"), "m", "axial position from the middle of the film"
                                       if several else "axial position"),
        "film_pressure": (("snapshot", *film, "theta", "z"), "Pa", "film pressure, absolute"),
        "snapshot_time": (("snapshot",), "s", "time of the snapshot"),
        "snapshot_speed": (("snapshot",), "rad/s", "shaft speed at the snapshot"),
    }  # fmt: skip


class Recording:
    """A growing record of the schema; use as a context manager. `write` appends, `snapshot` keeps a film pressure.

    `probes` are names and coordinates as `make_record` of the schema takes them, `bearings` the names of several gas
    bearings. `samples` is their number in the record, `stopped` the WriteError after which nothing more can be written.
    Raises WriteError if not even an empty record can be written.
    """

    def __init__(
        self, path: Path, attrs: dict[str, Any], probes: dict[str, Any] | None = None, bearings: Sequence[str] = ()
    ) -> None:
        self.path, self._probes, self._bearings = path, probes or {}, tuple(bearings)
        self.samples = 0
        self.stopped: files.WriteError | None = None
        self._flushed = clock.monotonic()
        self._own_folder = not path.parent.exists()
        files.make_folder(path.parent)
        self._target = files.followed(path)
        self._temporary = files.temporary(self._target, files.GROWING)
        try:
            files.check_target(self._target)
            self._disk = DiskFile(self._temporary)
        except OSError as error:
            self._remove_own_folder()
            raise files.write_error(path, error) from error
        try:
            self._disk.reserve(10 * STRUCTURE)
        except OSError as error:
            self._remove()
            raise files.write_error(path, error) from error
        self._hdf5 = h5py.File(self._disk, "w", track_order=True, rdcc_nbytes=0)
        self._file = h5netcdf.File(self._hdf5, "w")
        self._stored: dict[str, h5py.Dataset] = {}
        self._begin(attrs)
        self._hdf5.flush()

    def _begin(self, attrs: dict[str, Any]) -> None:
        self._file.dimensions = {"time": None, "axis": len(AXES), "snapshot": None}
        self._file.attrs.update(attrs)
        self._variable("time", ("time",), "s", "time")
        self._names("axis", AXES)
        if len(self._bearings) > 1:
            self._file.dimensions["bearing"] = len(self._bearings)
            self._names("bearing", self._bearings)
        if self._probes:
            self._file.dimensions["probe"] = len(self._probes["probe"])
            for name, values in self._probes.items():
                self._add_coordinate(name, values)

    def _names(self, dim: str, names: Sequence[str]) -> None:
        """Names along a dimension."""
        variable = self._file.create_variable(dim, (dim,), h5py.string_dtype())
        variable[:] = np.array(names, object)

    def _add_coordinate(self, name: str, values: list[Any]) -> None:
        """A coordinate of the probes: text or numbers."""
        kind = h5py.string_dtype() if isinstance(values[0], str) else "f8"
        variable = self._file.create_variable(name, ("probe",), kind)
        variable[:] = np.array(values, object if isinstance(values[0], str) else float)
        if name in PROBE_COORDINATES:
            unit, text = PROBE_COORDINATES[name]
            variable.attrs.update({"long_name": text} | ({"units": unit} if unit else {}))

    def _variable(self, name: str, dims: tuple[str, ...], units: str, long_name: str) -> Any:
        shape = tuple(len(self._file.dimensions[d]) for d in dims[1:])
        chunks = (CHUNK if dims[0] == "time" else 1, *shape)
        variable = self._file.create_variable(name, dims, "f8", chunks=chunks)
        variable.attrs["units"], variable.attrs["long_name"] = units, long_name
        self._stored[name] = self._hdf5[name]  # to append without a look at the file's tables each time
        return variable

    def write(self, time: np.ndarray, values: Values) -> None:
        """Append samples: variables of the schema, each (n,) or (n, dim); raises WriteError where the disk ends."""
        if self.stopped is not None:
            raise self.stopped
        self._write({"time": time, **values}, BLOCK)
        if self._disk.is_removed:
            self.stopped = files.WriteError(errno.ENOENT, REMOVED, str(self.path))
            raise self.stopped

    def _write(self, values: Values, step: int) -> None:
        """Append samples in pieces, and those that a full disk does not take as a block in the smallest ones."""
        row = sum(value[:1].nbytes for value in values.values())
        for piece in _pieces(values, self.samples, step):
            chunks = -(-(self.samples % CHUNK + len(piece["time"])) // CHUNK)
            try:
                self._reserve(row * chunks * CHUNK, len(piece))
            except OSError as error:
                if step == CHUNK:
                    raise self._stop(error) from error
                self._write(piece, CHUNK)
                continue
            self._append(piece)
            if clock.monotonic() - self._flushed > FLUSH:
                self._flush()

    def _reserve(self, size: int, variables: int) -> None:
        """Take the space [byte] for new values of some variables from the disk; raises OSError if there is none."""
        self._disk.reserve(size + (variables + 4) * STRUCTURE)

    def _flush(self) -> None:
        self._hdf5.flush()
        try:
            self._disk.to_disk()
        except OSError as error:
            raise self._stop(error) from error
        self._flushed = clock.monotonic()

    def _stop(self, error: OSError) -> files.WriteError:
        """End the record: the space for its mark is reserved already."""
        self.stopped = files.write_error(self.path, error)
        self._file.attrs["ended"] = self.stopped.reason
        return self.stopped

    def _append(self, values: Values) -> None:
        end = self.samples + len(values["time"])
        for name, value in values.items():
            if name not in self._stored:
                self._add(name, value)
            self._stored[name].resize(end, axis=0)  # h5netcdf would look up all variables in the file's tables
            self._stored[name][self.samples : end] = value
        self.samples = end

    def _add(self, name: str, value: np.ndarray) -> None:
        known = VARIABLES[name]
        for dim in {"injector"} & set(known.dims) - set(self._file.dimensions):
            self._file.dimensions[dim] = value.shape[1]
            number = self._file.create_variable(dim, (dim,), "i8")
            number[:] = np.arange(1, value.shape[1] + 1)
        if "body" in known.dims and "body" not in self._file.dimensions:
            self._file.dimensions["body"] = value.shape[1]
            self._names("body", warm_bodies(self._bearings if len(self._bearings) > 1 else ()))
        units = probe_units(self._probes) if "probe" in known.dims else known.units
        variable = self._variable(name, ("time", *known.dims), units, known.long_name)
        if "probe" in known.dims:
            variable.attrs["coordinates"] = " ".join(PROBE_COORDINATES)

    def snapshot(self, time: float, speed: float, theta: np.ndarray, z: np.ndarray, pressure: np.ndarray) -> None:
        """Keep the film pressure of one instant, see `Simulation.film_snapshot`, unless the disk has ended."""
        if self.stopped is not None:
            return
        try:
            self._reserve(theta.nbytes + z.nbytes + pressure.nbytes, len(snapshot_variables(False)))
        except OSError as error:
            self._stop(error)
            return
        file = self._file
        if "theta" not in file.dimensions:
            known = snapshot_variables(z.ndim > 1)
            file.dimensions["theta"], file.dimensions["z"] = len(theta), z.shape[-1]
            for name, values in zip(known, (theta, z), strict=False):
                self._variable(name, *known[name])[:] = values
            for name in list(known)[2:]:
                self._variable(name, *known[name])
            if z.ndim > 1:
                file.variables["film_pressure"].attrs["coordinates"] = "film_z"
        n = len(file.dimensions["snapshot"])
        file.resize_dimension("snapshot", n + 1)
        for name, value in (("film_pressure", pressure), ("snapshot_time", time), ("snapshot_speed", speed)):
            file.variables[name][n] = value

    def note(self, **attrs: Any) -> None:
        """Add attributes, unless the disk has ended."""
        if self.stopped is None:
            self._file.attrs.update(attrs)

    def close(self) -> None:
        """Close and move to the final name if what was recorded makes a record.

        Raises WriteError if nothing could be kept. A record that was only kept in part has `stopped`.
        """
        if self._disk.closed:
            return
        try:
            self._file.close()
            self._hdf5.close()
            self._finish()
            if self.samples >= FEWEST:
                self._publish()
            elif self.stopped is not None:
                raise self.stopped
        finally:
            self._remove()

    def _finish(self) -> None:
        try:
            self._disk.finish()
        except OSError as error:
            raise files.write_error(self.path, error) from error

    def _publish(self) -> None:
        try:
            if self._disk.is_removed:
                files.make_folder(self.path.parent)
                with files.replacing(self.path) as part:
                    self._disk.copy_to(part)
            else:
                self._disk.close()
                os.replace(self._temporary, self._target)
            trust_hdf5(self.path)
        except OSError as error:
            raise files.write_error(self.path, error) from error

    def _remove(self) -> None:
        """Remove the temporary file, and the folder if it was made for this record and is empty."""
        self._disk.close()
        with suppress(OSError):
            self._temporary.unlink(missing_ok=True)
        self._remove_own_folder()

    def _remove_own_folder(self) -> None:
        if self._own_folder:
            with suppress(OSError):
                self.path.parent.rmdir()

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close, whatever ended the run."""
        self.close()


def _pieces(values: Values, first: int, step: int) -> Iterator[Values]:
    """Pieces of samples numbered from `first` on, cut at the multiples of `step`."""
    n = len(values["time"])
    cuts = [0, *range(step - first % step, n, step), n]
    for start, end in pairwise(cuts):
        yield {name: value[start:end] for name, value in values.items()}


ENDED = "killed"


def recover(folder: Path) -> list[tuple[Path, int]]:
    """Bring back what killed runs of this computer had recorded in a folder, and remove their other temporary files.

    Returns files NAME-killed.nc, NAME-killed-2.nc ... with their numbers of samples. Raises OSError if a file cannot be
    moved; it stays as it is.
    """
    files.sweep(folder)
    found = []
    for part in files.left_behind(folder, files.GROWING):
        samples = _samples(part)
        if samples < FEWEST:
            part.unlink()
            continue
        path = _free(folder / files.target_of(part))
        os.rename(part, path)
        found.append((path, samples))
    return found


def add_attribute(path: Path, name: str, text: str) -> None:
    """Add an attribute to a finished record, by a new file in its place; raises WriteError and leaves the old one."""
    with files.replacing(path) as part:
        with DiskFile(path, "r+") as disk:
            disk.copy_to(part)
        with DiskFile(part, "r+") as disk:
            disk.reserve(STRUCTURE)
            with h5py.File(disk, "r+", track_order=True) as file:
                file.attrs[name] = text
            disk.finish()
    trust_hdf5(path)


def duration(path: Path) -> float:
    """Length [s] of a record that a run wrote."""
    with h5py.File(path, "r") as file:
        return len(file["time"]) / float(np.asarray(file.attrs["sample_rate_hz"]).item())


def _samples(part: Path) -> int:
    """Samples in a temporary file, which is marked; 0 if it was killed before its first flush or within one."""
    if check_hdf5(part) is not None:
        return 0
    with suppress(OSError, KeyError, RuntimeError), DiskFile(part, "r+") as disk:
        with h5py.File(disk, "r+", track_order=True) as file:
            samples = len(file["time"])
            file.attrs["ended"] = ENDED  # in the space that was reserved for the samples to come
        disk.finish()
        return samples
    return 0


def _free(path: Path) -> Path:
    """The first free name for what is left of a record."""
    number, free = 1, path.with_stem(f"{path.stem}-{ENDED}")
    while free.exists():
        number += 1
        free = path.with_stem(f"{path.stem}-{ENDED}-{number}")
    return free

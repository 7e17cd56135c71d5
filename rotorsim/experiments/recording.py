"""Streams a run into one NetCDF-4 file: constant memory, nothing half-written under the final name.

The file grows under a temporary name beside its target and is moved there when it is closed, complete or interrupted.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Any

import h5netcdf
import numpy as np

from identification import AXES, VARIABLES
from rotorsim.errors import DataError

CHUNK = 5000
FEWEST = 2
"""Samples of the shortest record that the schema takes."""


class Recording:
    """A growing record of the schema; use as a context manager. `write` appends, `snapshot` keeps a film pressure."""

    def __init__(self, path: Path, attrs: dict[str, Any]) -> None:
        self.path = path
        self.samples = 0
        self._temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
        self._own_folder = not path.parent.exists()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = h5netcdf.File(self._temporary, "w")
        except OSError as error:
            raise DataError(f"output: cannot write {path} ({error.strerror}); choose another --out") from error
        self._file.dimensions = {"time": None, "axis": 2, "snapshot": None}
        self._file.attrs.update(attrs)
        self._variable("time", ("time",), "s", "time")
        names = self._file.create_variable("axis", ("axis",), "S1")
        names[:] = np.array(AXES, "S1")

    def _variable(self, name: str, dims: tuple[str, ...], units: str, long_name: str) -> Any:
        shape = tuple(len(self._file.dimensions[d]) for d in dims[1:])
        chunks = (CHUNK if dims[0] == "time" else 1, *shape)
        variable = self._file.create_variable(name, dims, "f8", chunks=chunks)
        variable.attrs["units"], variable.attrs["long_name"] = units, long_name
        return variable

    def write(self, time: np.ndarray, values: dict[str, np.ndarray]) -> None:
        """Append samples: variables of the schema, each (n,) or (n, dim)."""
        end = self.samples + len(time)
        self._file.resize_dimension("time", end)
        for name, value in {"time": time, **values}.items():
            if name not in self._file.variables:
                self._add(name, value)
            self._file.variables[name][self.samples : end] = value
        self.samples = end

    def _add(self, name: str, value: np.ndarray) -> None:
        known = VARIABLES[name]
        if "injector" in known.dims and "injector" not in self._file.dimensions:
            self._file.dimensions["injector"] = value.shape[1]
            number = self._file.create_variable("injector", ("injector",), "i8")
            number[:] = np.arange(1, value.shape[1] + 1)
        self._variable(name, ("time", *known.dims), known.units, known.long_name)

    def snapshot(self, time: float, speed: float, theta: np.ndarray, z: np.ndarray, pressure: np.ndarray) -> None:
        """Keep the film pressure (theta, z) [Pa, absolute] of one instant."""
        file = self._file
        if "theta" not in file.dimensions:
            for name, values, unit, label in (
                ("theta", theta, "rad", "angle on the bearing"),
                ("z", z, "m", "axial position"),
            ):
                file.dimensions[name] = len(values)
                self._variable(name, (name,), unit, label)[:] = values
            self._variable("film_pressure", ("snapshot", "theta", "z"), "Pa", "film pressure, absolute")
            self._variable("snapshot_time", ("snapshot",), "s", "time of the snapshot")
            self._variable("snapshot_speed", ("snapshot",), "rad/s", "shaft speed at the snapshot")
        n = len(file.dimensions["snapshot"])
        file.resize_dimension("snapshot", n + 1)
        for name, value in (("film_pressure", pressure), ("snapshot_time", time), ("snapshot_speed", speed)):
            file.variables[name][n] = value

    def note(self, **attrs: Any) -> None:
        """Add attributes."""
        self._file.attrs.update(attrs)

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close and move to the final name if what was recorded makes a record, whatever ended the run."""
        if self.samples:
            self._file.resize_dimension("time", self.samples)
        self._file.close()
        if self.samples >= FEWEST:
            os.replace(self._temporary, self.path)
        else:
            self._temporary.unlink(missing_ok=True)
            if self._own_folder:
                self.path.parent.rmdir()

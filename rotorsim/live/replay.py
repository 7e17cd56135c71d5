"""Replay of a recorded run in the views of the live rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import identification as idn
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.live.frame import Geometry, make_frame
from rotorsim.live.rig.history import LENGTH
from rotorsim.machine import Machine
from rotorsim.plant.kernels.columns import AT, COLUMNS, FILM_COLUMNS, FORCE, N_INPUTS, REFERENCE, film_columns


class Replay:
    """Record during replay: `advance` moves on in time, `frame` gives the present view.

    Examples
    --------
    >>> import rotorsim as rs
    >>> replay = rs.live.Replay(Path("run.nc"))
    >>> replay.advance(100)
    100
    """

    def __init__(self, path: Path) -> None:
        try:
            record = idn.read(path)
        except (idn.ReadError, idn.SchemaError) as error:
            raise DataError(str(error)) from error
        try:
            self.machine = Machine.from_text(record.attrs["machine"])
        except KeyError as error:
            raise DataError(
                f"{path}: carries no machine, so its views cannot be drawn; replay a virtual record"
            ) from error
        except MachineFileError as error:
            raise DataError(f"{path}: its machine is refused ({error.problems[0]}); replay another record") from error
        self.Ts = idn.sampling_time(record)
        self.name, self.rows = path.name, _table(record)
        film = "film_pressure" in record
        self._films = np.asarray(record["film_pressure"]) if film else None
        self._times = np.asarray(record["snapshot_time"]) if film else np.zeros(0)
        theta, z = (np.asarray(record[name]) if film else np.zeros(0) for name in ("theta", "z"))
        self.geometry = Geometry.of(self.machine, theta, z)
        self.rest = np.asarray(record.attrs.get("rest", self.rows[0, :2]), float)
        self.at = 0

    def drop_film(self) -> None:
        """Show no film."""
        self._films = None

    @property
    def samples(self) -> int:
        """Length."""
        return len(self.rows)

    @property
    def seconds(self) -> float:
        """Place [s]."""
        return self.at * self.Ts

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.samples * self.Ts

    def advance(self, samples: int) -> int:
        """Move on by at most so many samples; returns how many there were."""
        moved = min(samples, self.samples - self.at)
        self.at += moved
        return moved

    def seek(self, seconds: float) -> None:
        """Go to a time [s]."""
        self.at = min(max(round(seconds / self.Ts), 0), self.samples)

    def frame(self, shown: int = 0) -> dict[str, Any]:
        """Frame for the page at the present place, with the film of that number."""
        rows = self.rows[max(self.at - LENGTH, 0) : self.at]
        shown = min(shown, max(len(self.machine.films) - 1, 0))
        return make_frame(rows, self._film(shown), self.geometry, self.seconds, self.rest, shown)

    def _film(self, shown: int) -> np.ndarray | None:
        """The last pressure of a film that was kept before the present place."""
        if self._films is None or not len(self._films):
            return None
        number = int(np.searchsorted(self._times, self.seconds + self.Ts / 2)) - 1
        kept = np.asarray(self._films[max(number, 0)])
        return kept[shown] if kept.ndim == 3 else kept


def _table(record: Any) -> np.ndarray:
    """Rows (n, columns, pins, probes, films, temperatures and 6 inputs) of a record; what it lacks is zero."""
    pins, probes = record.sizes.get("injector", 0), record.sizes.get("probe", 0)
    films, heat = film_columns(record.sizes.get("bearing", 0)), record.sizes.get("body", 0)
    rows = np.zeros((record.sizes["time"], len(COLUMNS) + pins + probes + films + heat + N_INPUTS))
    for name, column in AT.items():
        base, _, axis = name.rpartition("_")
        if name in record:
            rows[:, column] = record[name]
        elif axis in ("x", "y") and base in record:
            rows[:, column] = record[base][:, "xy".index(axis)]
    places = {
        "pin": len(COLUMNS),
        "probe_measured": len(COLUMNS) + pins,
        "temperature_rise": -N_INPUTS - heat,
        "reference": REFERENCE.start - N_INPUTS,
        "disc_force": FORCE.start - N_INPUTS,
    }
    for name, first in places.items():
        if name in record:
            count = record[name].shape[1]
            stop = None if first + count == 0 else first + count
            rows[:, first:stop] = record[name]
    for number in range(record.sizes.get("bearing", 0) if films and "journals" in record else 0):
        first = len(COLUMNS) + pins + probes + FILM_COLUMNS * number
        rows[:, first : first + 2] = record["journals"][:, number]
    return rows

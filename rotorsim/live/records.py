"""Records of a live rig: recording with film pressures and all settings, and the replay in the views of the rig."""

import json
from pathlib import Path
from typing import Any

import numpy as np

import identification as idn
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.experiments.recording import FEWEST, Recording
from rotorsim.live.frame import Geometry, make_frame
from rotorsim.live.rig import LENGTH, Rig
from rotorsim.live.settings import OFF
from rotorsim.machine import Machine
from rotorsim.plant.kernels import layout
from rotorsim.plant.locations import probe_coordinates
from rotorsim.plant.plant import dated
from rotorsim.plant.simulation import split_columns


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
        """Move on by this many samples at most; returns their number."""
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
    """Rows (n, columns, pins and their readings, probes, films, temperatures and 6 inputs) of a record.

    What the record lacks is zero.
    """
    pins, probes = record.sizes.get("injector", 0), record.sizes.get("probe", 0)
    first_probe = len(layout.COLUMNS) + pins * (2 if "pin_measured" in record else 1)
    films, heat = layout.film_columns(record.sizes.get("bearing", 0)), record.sizes.get("body", 0)
    rows = np.zeros((record.sizes["time"], first_probe + probes + films + heat + layout.N_INPUTS))
    for name, column in layout.AT.items():
        base, _, axis = name.rpartition("_")
        if name in record:
            rows[:, column] = record[name]
        elif axis in ("x", "y") and base in record:
            rows[:, column] = record[base][:, "xy".index(axis)]
    places = {
        "pin": len(layout.COLUMNS),
        "pin_measured": len(layout.COLUMNS) + pins,
        "probe_measured": first_probe,
        "temperature_rise": -layout.N_INPUTS - heat,
        "reference": layout.REFERENCE.start - layout.N_INPUTS,
        "disc_force": layout.FORCE.start - layout.N_INPUTS,
    }
    for name, first in places.items():
        if name in record:
            count = record[name].shape[1]
            stop = None if first + count == 0 else first + count
            rows[:, first:stop] = record[name]
    for number in range(record.sizes.get("bearing", 0) if films and "journals" in record else 0):
        first = first_probe + probes + layout.FILM_COLUMNS * number
        rows[:, first : first + 2] = record["journals"][:, number]
    return rows


FILM_EVERY = 250
"""Samples from one film pressure to the next."""


class Recorder:
    """Record in progress; rows are appended as they are simulated."""

    def __init__(self, rig: Rig, path: Path) -> None:
        attrs = rig.plant.provenance(rig.seed) | {"machine": rig.machine.text, "machine_hash": rig.machine.hash}
        attrs |= dated() | {"experiment": "live", "rest": rig.rest}
        self._file = Recording(path, attrs, probe_coordinates(rig.machine), rig.machine.film_names)
        self.path, self._rig = path, rig
        self._changes: list[tuple[float, str, float | str]] = [
            (0.0, key, value) for key, value in rig.settings.everything().items() if key in rig.settings.operating
            or key in rig.settings.switches
        ]  # fmt: skip
        self._name_controllers()

    @property
    def seconds(self) -> float:
        """Length so far [s]."""
        return self._file.samples * self._rig.Ts

    @property
    def kept(self) -> bool:
        """True if there is enough of it for a file."""
        return self._file.samples >= FEWEST

    def note(self, key: str, value: float | str) -> None:
        """Write down that a setting changed."""
        self._changes.append((round(self.seconds, 4), key, value))

    def _name_controllers(self) -> None:
        """Every controller that was on becomes an attribute, as in other records of a closed loop."""
        names = {str(value) for _, key, value in self._changes if key == "controller" and value != OFF}
        if names:
            self._file.note(controller=", ".join(sorted(names)))

    def write(self, rows: np.ndarray) -> None:
        """Append rows that were just simulated."""
        if not len(rows):
            return
        first, film = self._file.samples, self._rig.has_film
        values: dict[str, Any] = split_columns(self._rig.assembly, rows[:, : -layout.N_INPUTS], layout.inputs_of(rows))
        self._file.write((first + np.arange(len(rows))) * self._rig.Ts, values)
        if film and self._file.samples // FILM_EVERY > first // FILM_EVERY:
            self._file.snapshot(self.seconds, self._rig.speed, *self._rig.simulation.film_snapshot())

    def close(self) -> None:
        """Finish the file under its name; raises WriteError where the disk takes no more than a part of it, or none."""
        self._name_controllers()
        self._file.note(changes=json.dumps(self._changes), ended=getattr(self._file.stopped, "reason", "complete"))
        self._file.close()
        if self._file.stopped is not None:
            raise self._file.stopped

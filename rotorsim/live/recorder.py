"""Recording of a live run in the schema, with film pressure every 250 samples and all settings."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.experiments.recording import FEWEST, Recording
from rotorsim.live.rig.operating import OFF
from rotorsim.live.rig.rig import Rig
from rotorsim.plant.kernels.columns import N_INPUTS, inputs_of
from rotorsim.plant.probes import probe_coordinates
from rotorsim.plant.simulation import split_columns

FILM_EVERY = 250
"""Samples from one film pressure to the next."""


class Recorder:
    """Record in progress; rows are appended as they are simulated."""

    def __init__(self, rig: Rig, path: Path) -> None:
        attrs = rig.plant.provenance(rig.seed) | {"machine": rig.machine.text, "machine_hash": rig.machine.hash}
        attrs |= {"experiment": "live", "rest": rig.rest}
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
        """Whether there is enough of it for a file."""
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
        values: dict[str, Any] = split_columns(self._rig.assembly, rows[:, :-N_INPUTS], inputs_of(rows))
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

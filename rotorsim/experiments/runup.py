"""Run-up and coast-down: the speed follows a ramp, the record is streamed to a file or returned."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.errors import ConvergenceError, DataError
from rotorsim.experiments.interrupt import Interrupt
from rotorsim.experiments.recording import Recording
from rotorsim.machine.numerics import SAMPLE
from rotorsim.plant.plant import BLOCK, Plant, Signal
from rotorsim.plant.simulation import split_columns
from rotorsim.progress import track

if TYPE_CHECKING:
    import xarray as xr

LONGEST = 1e6
"""Longest run [s]."""
SNAPSHOTS = 6
"""Film pressures kept of a run, evenly spaced over it."""


@dataclass(frozen=True)
class Outcome:
    """What a streamed run came to: samples simulated of those asked for, why it ended, numbers of the solver."""

    samples: int
    asked: int
    ended: str
    counters: dict[str, float]

    @property
    def complete(self) -> bool:
        """Whether everything asked for was simulated."""
        return self.samples == self.asked


def runup(
    plant: Plant,
    start: float = 0.0,
    stop: float = 2 * np.pi * 100,
    rate: float = 2 * np.pi * 100 / 60,
    pressure: Signal = 0.3e6,
    seed: int = 0,
    progress: bool = False,
) -> xr.Dataset:
    """Run up from speed `start` to `stop` [rad/s] at `rate` [rad/s^2] and gauge pressure [Pa]; returns the record."""
    return plant.simulate(
        ramp_time(start, stop, rate), _ramp(start, stop, rate), pressure, seed=seed, progress=progress
    )


def coastdown(
    plant: Plant,
    start: float = 2 * np.pi * 100,
    stop: float = 0.0,
    rate: float = 2 * np.pi * 40 / 60,
    pressure: Signal = 0.3e6,
    seed: int = 0,
    progress: bool = False,
) -> xr.Dataset:
    """Coast down from `start` to `stop` [rad/s] at the declared `rate` [rad/s^2]; as `runup`."""
    return runup(plant, start, stop, rate, pressure, seed, progress)


def record_runup(
    plant: Plant,
    path: Path,
    start: float,
    stop: float,
    rate: float,
    pressure: float,
    seed: int = 0,
    progress: bool = False,
) -> Outcome:
    """Run up as `runup` and stream to the NetCDF file `path`, with film pressures at `SNAPSHOTS` instants.

    An interruption (KeyboardInterrupt) or a step without solution ends the run and keeps what was simulated.
    """
    samples = round(ramp_time(start, stop, rate) / SAMPLE)
    attrs: dict[str, Any] = plant.provenance(seed) | {"experiment": "runup", "pressure": pressure}
    attrs |= {"start_speed": start, "stop_speed": stop, "rate": rate}
    has_film = plant.assembly.film_model is not None
    marks = set(np.linspace(0, samples, SNAPSHOTS)[:-1].astype(int) // BLOCK)
    ended = "complete"
    with Interrupt() as interrupt, Recording(path, attrs) as recording:
        simulation = plant.start(start, pressure)

        def keep(table: np.ndarray, rows: np.ndarray) -> None:
            time = (recording.samples + np.arange(len(table))) * SAMPLE
            recording.write(time, split_columns(table, rows[: len(table)], has_film))

        def blocks() -> Iterator[tuple[np.ndarray, np.ndarray]]:
            for i in range(0, samples, BLOCK):
                if interrupt.asked:
                    raise KeyboardInterrupt
                if has_film and i // BLOCK in marks:
                    _snapshot(recording, simulation)
                rows = ramp_rows(start, stop, samples, i, pressure)
                try:
                    yield simulation.advance(rows), rows
                except ConvergenceError as error:
                    keep(error.where["table"], rows)
                    raise

        try:
            for table, rows in track(blocks(), samples, SAMPLE, progress):
                keep(table, rows)
        except KeyboardInterrupt:
            ended = "interrupted"
        except ConvergenceError as error:
            ended = str(error)
        if has_film and recording.samples:
            _snapshot(recording, simulation)
        recording.note(ended=ended, **simulation.counters)
    return Outcome(recording.samples, samples, ended, simulation.counters)


def ramp_rows(start: float, stop: float, samples: int, first: int, pressure: float) -> np.ndarray:
    """Input rows of one block of a ramp of `samples` samples, from sample `first` on."""
    count = min(BLOCK, samples - first)
    rows = np.zeros((count, 6))
    rows[:, 0] = start + (stop - start) * (first + 1 + np.arange(count)) / samples
    rows[:, 1] = pressure
    return rows


def ramp_time(start: float, stop: float, rate: float) -> float:
    """Duration [s] of a ramp; raises DataError for a rate or range that makes none."""
    if not rate > 0:
        raise DataError(f"rate = {rate * 30 / np.pi:g} rpm/s: must be positive, also downwards; give e.g. 100 rpm/s")
    if start == stop:
        raise DataError("start and stop are the same speed; give a range to run through")
    duration = abs(stop - start) / rate
    if duration > LONGEST:
        raise DataError(f"rate = {rate * 30 / np.pi:g} rpm/s: the run would last {duration / 86400:.3g} days; raise it")
    return duration


def _ramp(start: float, stop: float, rate: float) -> np.ndarray:
    """Speed at every sample of the ramp, its end included."""
    n = round(ramp_time(start, stop, rate) / SAMPLE)
    return np.linspace(start, stop, n + 1)


def _snapshot(recording: Recording, simulation: Any) -> None:
    grid = simulation.assembly.film_model.grid
    time = simulation.samples * SAMPLE
    speed = float(simulation.w[simulation.assembly.rotor.speed])
    recording.snapshot(time, speed, grid.theta, grid.z, simulation.film_pressure())

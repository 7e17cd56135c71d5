"""Run-up and coast-down: the speed follows a ramp, the record is streamed to a file or returned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.errors import ConvergenceError, DataError
from rotorsim.experiments.recording import Recording
from rotorsim.plant.assemble import SAMPLE
from rotorsim.plant.plant import BLOCK, Plant, Signal
from rotorsim.plant.simulation import split_columns
from rotorsim.progress import track

if TYPE_CHECKING:
    import xarray as xr

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
    duration = ramp_time(start, stop, rate)
    inputs, begin = plant.inputs(duration, _ramp(start, stop, rate), pressure)
    attrs: dict[str, Any] = plant.provenance(seed) | {"experiment": "runup", "pressure": pressure}
    attrs |= {"start_speed": start, "stop_speed": stop, "rate": rate}
    simulation = plant.start(*begin)
    has_film = plant.assembly.film_model is not None
    marks = set(np.linspace(0, len(inputs) - 1, SNAPSHOTS).astype(int) // BLOCK)
    ended = "complete"
    with Recording(path, attrs) as recording:

        def blocks() -> Any:
            for i in range(0, len(inputs), BLOCK):
                if has_film and i // BLOCK in marks:
                    _snapshot(recording, simulation)
                rows = inputs[i : i + BLOCK]
                yield simulation.advance(rows), rows

        try:
            for table, rows in track(blocks(), len(inputs), progress):
                time = (recording.samples + np.arange(len(table))) * SAMPLE
                recording.write(time, split_columns(table, rows, has_film))
        except KeyboardInterrupt:
            ended = "interrupted"
        except ConvergenceError as error:
            ended = str(error)
        if has_film and recording.samples:
            _snapshot(recording, simulation)
        recording.note(ended=ended, **simulation.counters)
    return Outcome(recording.samples, len(inputs), ended, simulation.counters)


def ramp_time(start: float, stop: float, rate: float) -> float:
    """Duration [s] of a ramp; raises DataError for a rate or range that makes none."""
    if not rate > 0:
        raise DataError(f"rate = {rate * 30 / np.pi:g} rpm/s: must be positive, also downwards; give e.g. 100 rpm/s")
    if start == stop:
        raise DataError("start and stop are the same speed; give a range to run through")
    return abs(stop - start) / rate


def _ramp(start: float, stop: float, rate: float) -> np.ndarray:
    """Speed at every sample of the ramp, its end included."""
    n = round(ramp_time(start, stop, rate) / SAMPLE)
    return np.linspace(start, stop, n + 1)


def _snapshot(recording: Recording, simulation: Any) -> None:
    grid = simulation.assembly.film_model.grid
    time = simulation.samples * SAMPLE
    speed = float(simulation.w[simulation.assembly.rotor.speed])
    recording.snapshot(time, speed, grid.theta, grid.z, simulation.film_pressure())

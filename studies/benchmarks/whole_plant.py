"""Speed of the complete rig: film, plena, rotor, four piezos with PD loops, sensor noise, effects."""

import resource
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rotorsim.base.units import RIG_SAMPLE
from rotorsim.experiments import Prbs, record
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.simulation import Simulation
from studies.benchmarks.result import Figure

SPEED, PRESSURE, SAMPLES, REPEATS = 2 * np.pi * 50, 0.5e6, 5000, 9
GRIDS = {"32x8, 0.2 ms": ((32, 8, 2e-4), 20.0), "32x16, 0.1 ms": ((32, 16, 1e-4), 10.0)}
"""Grid and step, and the real-time factor to reach."""


def whole_plant() -> Iterator[Figure]:
    """Time of a sample under PRBS +-1 V at 3 krpm, and what the four piezos take of a step, side by side."""
    prbs = Prbs(SPEED, PRESSURE, 1.0, 2.0).rows(2000, SAMPLES)
    still = np.tile([SPEED, PRESSURE, 0, 0, 0, 0], (SAMPLES, 1))
    machine = load_machine("dtu_gas_bearing")
    for name, (size, factor) in GRIDS.items():
        whole, ideal = (_start(m, *size) for m in (machine, machine.replace("actuators.mode", "ideal")))
        times = np.array([(_time(whole, prbs), _time(whole, still), _time(ideal, still)) for _ in range(REPEATS)])
        sample = statistics.median(times[:, 0]) * 1e6
        yield Figure(f"sample of the whole rig under PRBS, {name}", sample, "us", RIG_SAMPLE * 1e6 / factor)
        yield Figure("  real-time factor", RIG_SAMPLE * 1e6 / sample, "1")
        steps = round(RIG_SAMPLE / size[2])
        yield Figure("  four piezos in a step", float(np.median(times[:, 1] - times[:, 2])) / steps * 1e6, "us", 2.0)


def _start(machine: object, n_theta: int, n_z: int, dt: float) -> Simulation:
    simulation = Plant(machine, n_theta=n_theta, n_z=n_z, dt=dt).start(SPEED, PRESSURE)  # type: ignore[arg-type]
    simulation.advance(np.tile([SPEED, PRESSURE, 0, 0, 0, 0], (100, 1)))
    return simulation


def _time(simulation: Simulation, rows: np.ndarray) -> float:
    """Seconds a sample."""
    begin = time.perf_counter()
    simulation.advance(rows)
    return (time.perf_counter() - begin) / len(rows)


def long_run() -> Iterator[Figure]:
    """Growth of the memory when a streamed run is ten times as long."""
    plant = Plant("dtu_gas_bearing", n_theta=16, n_z=8, dt=2e-4)
    peaks = []
    for duration in (20.0, 200.0):
        with tempfile.TemporaryDirectory() as folder:
            record(plant, Prbs(SPEED, PRESSURE, 1.0, duration), Path(folder) / "prbs.nc")
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    yield Figure("peak memory, streamed run of 20 s", peaks[0], "MB")
    yield Figure("  more for 200 s", peaks[1] - peaks[0], "MB", 20.0)

"""Speed of the plant: time per coupled step, full run-up, equilibrium, import and first compilation."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rotorsim.base.units import RPM, TO_UM
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from studies.benchmarks.reference_work import in_turns
from studies.benchmarks.result import Figure

SPEED, PRESSURE = 2 * np.pi * 100, 0.3e6
BOUNDS = {(32, 8): 4.0, (32, 16): 6.0, (64, 16): 12.0, (128, 32): 60.0}
"""Time of a 0.2 ms step [us] at the small orbit; twice that at the large one."""
UNBALANCE = {"11 um orbit": "6.7 g*mm", "31 um orbit": "19 g*mm"}
BARE = {
    "effects.coupling.force_2x": "0 N",
    "effects.coupling.force_3x": "0 N",
    "actuators.mode": "ideal",
    "effects.runout.roughness": "0 um",
    "effects.noise.sigma": "0 um",
}
"""Changes that leave only film, plena, rotor and unbalance."""
SAMPLES, ROUNDS = 5000, 5


def steps() -> Iterator[Figure]:
    """Median processor time of a 0.2 ms step over runs of 1 s, for each grid and two orbits at 6 krpm."""
    for factor, (orbit, me) in enumerate(UNBALANCE.items(), start=1):
        for (n_theta, n_z), bound in BOUNDS.items():
            yield from _step_figures(n_theta, n_z, me, f"step {n_theta}x{n_z}, {orbit}", factor * bound)


def _step_figures(n_theta: int, n_z: int, me: str, name: str, bound: float) -> Iterator[Figure]:
    machine = load_machine("dtu_gas_bearing").replace("effects.unbalance.me", me)
    for path, value in BARE.items():
        machine = machine.replace(path, value)
    simulation = Plant(machine, n_theta=n_theta, n_z=n_z, dt=2e-4).start(SPEED, PRESSURE)
    rows = np.tile([SPEED, PRESSURE, 0, 0, 0, 0], (SAMPLES, 1))
    simulation.advance(rows)
    tables: list[np.ndarray] = []
    before = simulation.counters
    spent = in_turns(lambda: tables.append(simulation.advance(rows)), SAMPLES, SAMPLES, ROUNDS)
    after, table = simulation.counters, tables[-1]
    per_step = {k: (after[k] - before[k]) / (len(tables) * SAMPLES) for k in after}
    yield Figure(name, spent["us"], "us", bound)
    yield Figure("  ratio to the reference arithmetic", spent["ratio"], "1")
    yield Figure("  iterations per step", per_step["iterations"], "1", 2.5 if "11 um" in name else None)
    yield Figure(
        "  factorisations per 1000 steps", 1e3 * per_step["factorisations"], "1", 20.0 if "11 um" in name else None
    )
    yield Figure("  disc orbit x, 0-pk", float(np.ptp(table[:, 0]) / 2 * TO_UM), "um")


def equilibrium() -> Iterator[Figure]:
    """Median time of an equilibrium at 64x16."""
    plant = Plant("dtu_gas_bearing", n_theta=64, n_z=16)
    plant.equilibrium(0.0, PRESSURE)
    times = []
    for rpm in range(0, 6000, 500):
        begin = time.perf_counter()
        plant.equilibrium(rpm * RPM, PRESSURE)
        times.append((time.perf_counter() - begin) * 1e3)
    yield Figure("equilibrium 64x16", statistics.median(times), "ms", 40.0)


_RUN = """
import resource, sys, time
from pathlib import Path
import numpy as np
begin = time.perf_counter()
from rotorsim.plant import Plant
from rotorsim.experiments import Runup, record
plant = Plant("dtu_gas_bearing")
plant.start(0.0, 0.3e6).advance(np.tile([0, 0.3e6, 0, 0, 0, 0], (1, 1)))
ready = time.perf_counter() - begin
begin = time.perf_counter()
record(plant, Runup(0.0, 628.3185307179587, 10.471975511965978, 0.3e6), Path(sys.argv[1]))
print(ready, time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def whole_run() -> Iterator[Figure]:
    """Default run-up of 60 s in a fresh process: time to the first step, time of the simulation, peak memory."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [sys.executable, "-P", "-c", _RUN, str(Path(folder) / "run.nc")]
        subprocess.run(arguments, check=True, capture_output=True)
        runs = np.array(
            [subprocess.run(arguments, check=True, capture_output=True).stdout.split() for _ in range(3)], float
        )
    ready, simulated, memory = np.median(runs, axis=0)
    yield Figure("start of the program to the first step, warm", float(ready), "s", 2.0)
    yield Figure("default run-up, 60 s at 32x16, 0.1 ms", float(simulated), "s", 5.0)
    yield Figure("  peak memory", float(memory), "MB", 600.0)


def imports() -> Iterator[Figure]:
    """Time of `import rotorsim`, less an empty interpreter's."""

    def run(code: str) -> float:
        times = []
        for _ in range(5):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-P", "-c", code], check=True)
            times.append(time.perf_counter() - begin)
        return statistics.median(times)

    yield Figure("import rotorsim", run("import rotorsim") - run("pass"), "s", 1.0)


def first_compilation() -> Iterator[Figure]:
    """Time to the first step with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"ROTORSIM_CACHE_DIR": folder}
        code = _RUN.split("begin = time.perf_counter()\nrecord")[0] + "print(ready)"
        done = subprocess.run([sys.executable, "-P", "-c", code], check=True, capture_output=True, env=environment)
    yield Figure("first run ever: to the first step", float(done.stdout), "s", 60.0)

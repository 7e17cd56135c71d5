"""Speed of the exported FMU against the Python plant, export time and file size."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from fmu.importer import fmpy
from rotorsim.base.units import RIG_SAMPLE
from studies.benchmarks.result import Figure

GENERIC = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}
"""Python's kernels compiled for what a portable unit is compiled for."""
BASELINES = {"portable": GENERIC, "native": {}}
_RUN = """
import json, statistics, sys, time
import numpy as np
import fmpy
from fmu.importer import ImportedUnit
from rotorsim.plant import Plant
SPEED, PRESSURE, N, REPEATS = 628.3185307179587, 0.3e6, 2000, 9
begin = time.perf_counter()
with ImportedUnit(sys.argv[1]) as unit:
    instance = unit.instance()
    instance.initialise({"shaft.speed_ref": SPEED, "injection.pressure": PRESSURE})
    ready = time.perf_counter() - begin
    simulation = Plant("dtu_gas_bearing").start(SPEED, PRESSURE)
    rows = np.tile([SPEED, PRESSURE, 0, 0, 0, 0], (N, 1))
    simulation.advance(rows)
    step, k, unit_times, plant_times = instance.slave.doStep, 0, [], []
    for _ in range(REPEATS):
        begin = time.thread_time()
        for k in range(k, k + N):
            step(currentCommunicationPoint=k * 2e-4, communicationStepSize=2e-4)
        k += 1
        unit_times.append((time.thread_time() - begin) / N)
        begin = time.thread_time()
        simulation.advance(rows)
        plant_times.append((time.thread_time() - begin) / N)
    instance.close()
ratio = statistics.median(a / b for a, b in zip(unit_times, plant_times))
print(json.dumps([ready, statistics.median(unit_times), statistics.median(plant_times), ratio]))
"""


def unit() -> Iterator[Figure]:
    """The shipped rig at its own grid, as a portable and as a native unit through FMPy; both baselines side by side."""
    fmpy()
    for cpu, environment in BASELINES.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "rig.fmu"
            _export(path, cpu)
            yield Figure(f"unit, {cpu}: size", path.stat().st_size / 1e3, "kB", 400.0)
            ready, step, plant, ratio = _measure(path, environment)
        yield Figure("  load and initialise", ready, "s", 0.5)
        yield Figure(
            "  doStep of 0.2 ms through FMPy",
            step * 1e6,
            "us",
            RIG_SAMPLE * 1e6 / 5 if cpu == "portable" else None,
        )
        yield Figure("  the same sample in Python, same processor", plant * 1e6, "us")
        yield Figure("  ratio", ratio, "1", 1.2)
        yield Figure("  real-time factor", RIG_SAMPLE / step, "1")


def export_cold() -> Iterator[Figure]:
    """Time of an export for this computer by a program that starts with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        _export(Path(folder) / "rig.fmu", "portable", {"ROTORSIM_CACHE_DIR": folder})
        yield Figure("export for this computer, empty cache", time.perf_counter() - begin, "s", 60.0)


def _export(path: Path, cpu: str, environment: dict[str, str] | None = None) -> None:
    command = [sys.executable, "-P", "-m", "rotorsim", "fmu", "export", "--cpu", cpu, "--out", str(path)]
    subprocess.run(command, check=True, capture_output=True, env=os.environ | (environment or {}))


def _measure(path: Path, environment: dict[str, str]) -> list[float]:
    """Readiness [s], doStep [s], Python's sample [s], ratio, in a process with that environment."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", _RUN, str(path)], check=True, capture_output=True, env=os.environ | environment
    )
    return [float(x) for x in json.loads(done.stdout)]

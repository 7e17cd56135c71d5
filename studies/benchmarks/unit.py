"""Speed of the exported FMU against the Python plant, export time and file size."""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fmu.importer import fmpy
from rotorsim.base.units import RIG_SAMPLE
from studies.benchmarks.result import Figure

GENERIC = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}
"""Python's kernels compiled for what a portable unit is compiled for."""
BASELINES = {"portable": GENERIC, "native": {}}
GOALS = {"portable": 1.15, "native": 1.05}
"""Time of a step over that of Python, by processor."""
_LOOP = """
typedef int Step(void *, double, double, int, int *, int *, int *, double *);
int play(Step *step, void *unit, long first, long n, double h) {
    int event, end, early, worst = 0;
    double reached;
    for (long k = first; k < first + n; k++) worst |= step(unit, k * h, h, 0, &event, &end, &early, &reached);
    return worst;
}
"""
_RUN = """
import ctypes, json, sys, time
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
    step, k, times = instance.slave.doStep, 0, []
    play, unit = ctypes.CDLL(sys.argv[2]).play, ctypes.c_void_p(instance.slave.component)
    play.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long, ctypes.c_long, ctypes.c_double]
    for _ in range(REPEATS):
        marks = [time.thread_time()]
        assert play(instance.slave.dll.fmi3DoStep, unit, k, N, 2e-4) == 0
        marks.append(time.thread_time())
        for k in range(k + N, k + 2 * N):
            step(currentCommunicationPoint=k * 2e-4, communicationStepSize=2e-4)
        k += 1
        marks.append(time.thread_time())
        simulation.advance(rows)
        marks.append(time.thread_time())
        times.append(np.diff(marks) / N)
    instance.close()
times = np.array(times)
print(json.dumps([ready, *np.median(times, axis=0), *np.median(times[:, :2] / times[:, 2:], axis=0)]))
"""


def unit() -> Iterator[Figure]:
    """The shipped rig at its own grid, as a portable and as a native unit through FMPy; both baselines side by side."""
    fmpy()
    for cpu, environment in BASELINES.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "rig.fmu"
            _export(path, cpu)
            yield Figure(f"unit, {cpu}: size", path.stat().st_size / 1e3, "kB", 400.0)
            ready, step, through, plant, ratio, ratio_through = _measure(path, environment)
        yield Figure("  load and initialise", ready, "s", 0.5)
        yield Figure(
            "  doStep of 0.2 ms, called from C",
            step * 1e6,
            "us",
            RIG_SAMPLE * 1e6 / 5 if cpu == "portable" else None,
        )
        yield Figure("  the same, called by FMPy", through * 1e6, "us")
        yield Figure("  the same sample in Python, same processor", plant * 1e6, "us")
        yield Figure("  ratio of C", ratio, "1", GOALS[cpu])
        yield Figure("  ratio of FMPy", ratio_through, "1")
        yield Figure("  real-time factor", RIG_SAMPLE / step, "1")


def export_cold() -> Iterator[Figure]:
    """Processor time of an export for this computer by a program that starts with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        _export(Path(folder) / "rig.fmu", "portable", {"ROTORSIM_CACHE_DIR": folder})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        yield Figure("export for this computer, empty cache", used, "s", 15.0)


def _export(path: Path, cpu: str, environment: dict[str, str] | None = None) -> None:
    command = [sys.executable, "-P", "-m", "rotorsim", "fmu", "export", "--cpu", cpu, "--out", str(path)]
    subprocess.run(command, check=True, capture_output=True, env=os.environ | (environment or {}))


def _measure(path: Path, environment: dict[str, str]) -> list[float]:
    """Readiness [s]; a step [s] from C, from FMPy and of Python; ratios of the first two to the third.

    All in one process with that environment.
    """
    library = path.with_suffix(".so")
    command = ["gcc", "-O2", "-shared", "-fPIC", "-xc", "-", "-o", str(library)]
    subprocess.run(command, input=_LOOP, check=True, text=True)
    done = subprocess.run(
        [sys.executable, "-P", "-c", _RUN, str(path), str(library)],
        check=True,
        capture_output=True,
        env=os.environ | environment,
    )
    return [float(x) for x in json.loads(done.stdout)]

"""Benchmark of linear analyses: time of operating points and maps, agreement with the nonlinear plant."""

import resource
import statistics
import time
from collections.abc import Iterator

import numpy as np

from reynolds import GasBearing, Injector
from rotorsim.analysis import critical_speeds, operating_map, operating_point, whirl_onset
from rotorsim.base.units import RIG_SAMPLE, RPM, TO_MPA
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from studies.benchmarks.result import Figure
from studies.benchmarks.speed import BARE

PRESSURES = (0.3e6, 0.5e6, 0.7e6)


def quiet(**grid: float) -> Plant:
    """The rig without unbalance, coupling forces and noise; its actuators stay and hold the pins."""
    machine = load_machine("dtu_gas_bearing")
    still = {k: v for k, v in BARE.items() if k != "actuators.mode"} | {"effects.unbalance.me": "0 g*mm"}
    for path, value in still.items():
        machine = machine.replace(path, value)
    return Plant(machine, **grid)  # type: ignore[arg-type]


def points() -> Iterator[Figure]:
    """CPU time of one operating point with K, C at three frequencies."""
    for (n_theta, n_z), bound in (((64, 16), 40.0), ((32, 16), 20.0)):
        plant = Plant("dtu_gas_bearing", n_theta=n_theta, n_z=n_z)
        times = []
        for rpm in range(0, 6500, 500):
            begin = time.process_time()
            point = operating_point(plant, rpm * RPM, 0.5e6)
            point.model.static_gain, point.model.delay, point.model.whirl  # noqa: B018
            times.append((time.process_time() - begin) * 1e3)
        name = f"operating point {n_theta}x{n_z}, equilibrium to K, C at 3 frequencies"
        yield Figure(name, statistics.median(times[1:]), "ms", bound)


def maps() -> Iterator[Figure]:
    """The 7 x 5 grid of the thesis, a map of 40 x 20 on all cores, and how the cost grows on one."""
    plant = Plant("dtu_gas_bearing")
    operating_map(plant, [0.0], [0.5e6])
    for size, bound in (((7, 5), 1.5), ((40, 20), 20.0)):
        spent, own = _map(plant, size, None)
        yield Figure(f"map of {size[0]} x {size[1]} points, 32x16", spent, "s", bound)
        yield Figure("  a point", spent / (size[0] * size[1]) * 1e3, "ms")
        yield Figure("  CPU time, all processes with their start", own, "s")
    sizes = ((7, 5), (14, 10), (28, 20))
    costs = [_map(plant, size, 1)[1] for size in sizes]
    order = np.polyfit(np.log([a * b for a, b in sizes]), np.log(costs), 1)[0]
    yield Figure("CPU time of 35, 140, 560 points: power of their number", float(order), "1", 1.1)


def _map(plant: Plant, size: tuple[int, int], workers: int | None) -> tuple[float, float]:
    """Wall and CPU time [s] of a map of the thesis' range."""
    speeds, pressures = np.linspace(0, 6000, size[0]) * RPM, np.linspace(0.3e6, 0.7e6, size[1])
    begin, cpu = time.perf_counter(), _cpu()
    operating_map(plant, speeds, pressures, workers=workers)
    return time.perf_counter() - begin, _cpu() - cpu


def _cpu() -> float:
    """CPU time [s] of this process and of those that ended."""
    uses = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in uses)


def onsets() -> Iterator[Figure]:
    """Whirl onset against growth and decay of a tap in the nonlinear plant, 5 % of speed below and above."""
    plant = quiet()
    wrong = 0
    found = whirl_onset(plant, PRESSURES)
    for pressure, onset in zip(PRESSURES, found["onset_speed"].values, strict=True):
        for share in (0.95, 1.05):
            growth, expected = _growth(plant, share * onset, pressure)
            wrong += int(np.sign(growth) != np.sign(share - 1))
            name = f"  {pressure * TO_MPA:g} MPa, {share:g} of {onset / RPM:.0f} rpm: growth against eigenvalue"
            yield Figure(name, abs(growth / expected - 1) * 100, "%")
    yield Figure("whirl onset: wrong signs of six nonlinear runs", wrong, "1", 0.0)


def _growth(plant: Plant, speed: float, pressure: float) -> tuple[float, float]:
    """Rate of growth [1/s] of 0.1 N of push over a second, and the rightmost eigenvalue's."""
    rows = np.zeros((5000, 6))
    rows[:, 0], rows[:, 1], rows[0, 4:] = speed, pressure, 0.1
    away = plant.start(speed, pressure).advance(rows)[:, :2] - plant.equilibrium(speed, pressure).disc
    peaks = np.hypot(*away.T).reshape(10, 500).max(axis=1)[2:]
    growth = np.polyfit(500 * RIG_SAMPLE * np.arange(8), np.log(peaks), 1)[0]
    return float(growth), float(plant.linearise(speed, pressure).eigenvalues.real.max())


def crossings() -> Iterator[Figure]:
    """The upper 1X crossing of the Campbell diagram against the peak of a slow run-up with a light unbalance."""
    machine = quiet().machine.replace("effects.unbalance.me", "0.3 g*mm")
    plant, pressure = Plant(machine), 0.7e6
    crossing = float(critical_speeds(plant, np.array([pressure]), (1,))["critical_speed"][0, 0, 1])
    low, high, n = 0.9 * crossing, 1.1 * crossing, 100_000
    speed = np.linspace(low, high, n)
    record = plant.simulate(n * RIG_SAMPLE, speed=np.append(speed, high), pressure=pressure)
    forward = record["disc"].values[:, 0] + 1j * record["disc"].values[:, 1]
    turned = (forward - forward.mean()) * np.exp(-1j * record["angle"].values)
    window = 1000
    amplitude = np.abs(np.convolve(turned, np.ones(window) / window, "same"))[window:-window]
    peak = record["speed"].values[window:-window][int(amplitude.argmax())]
    yield Figure("Campbell crossing of 1X against the run-up's peak, 0.7 MPa", abs(crossing / peak - 1) * 100, "%", 1.0)


def films() -> Iterator[Figure]:
    """Film coefficients against differences of the steady film and against a march with a small harmonic motion."""
    injectors = tuple(Injector(angle) for angle in np.deg2rad([90, 0, -90, 180]))
    bearing = GasBearing(0.02, 0.04, 25e-6, injectors=injectors, n_theta=32, n_z=16)
    at, speed, supply, omega = np.array([2e-6, -6e-6]), 314.159, 0.5e6, 2 * np.pi * 120
    k = bearing.coefficients(tuple(at), speed, [0.0, omega], supply_pressure=supply)
    yield Figure("film K(0) against differences of the steady film", _differences(bearing, at, speed, supply, k.K[0]),
                 "1", 1e-6)  # fmt: skip
    yield Figure("film K, C at 120 Hz against a march of 0.01 um", _harmonic(bearing, at, speed, supply, omega, k),
                 "%", 1.0)  # fmt: skip


def _differences(bearing: object, at: np.ndarray, speed: float, supply: float, K: np.ndarray) -> float:
    def force(x: np.ndarray) -> np.ndarray:
        return np.asarray(bearing.steady(tuple(x), speed, supply).force)  # type: ignore[attr-defined]

    step, columns = 1e-8, []
    for axis in np.eye(2):
        columns.append(-(force(at + step * axis) - force(at - step * axis)) / (2 * step))
    return float(np.abs(np.stack(columns, 1) - K).max() / np.abs(K).max())


def _harmonic(bearing: object, at: np.ndarray, speed: float, supply: float, omega: float, k: object) -> float:
    """Largest deviation of K + i omega C [%] from the fitted force of a harmonic motion of 0.01 um."""
    size, period = 1e-8, 2 * np.pi / omega
    dt, n = period / 200, 1600
    worst, Z = 0.0, k.K[1] + 1j * omega * k.C[1]  # type: ignore[attr-defined]
    for axis in range(2):
        moved = np.eye(2)[axis]
        march = bearing.march(  # type: ignore[attr-defined]
            lambda t, moved=moved: tuple(at + size * moved * np.sin(omega * t)), n * dt, dt, speed, supply
        )
        last = slice(-600, None)
        turn = np.exp(1j * omega * march.time[last])
        basis = np.column_stack([turn.real, turn.imag, np.ones(600)])
        c = np.linalg.lstsq(basis, march.force[last], rcond=None)[0]
        # x = Im(exp(i w t)), so F = -Im(Z exp(i w t)) = -(Re Z sin + Im Z cos)
        found = -(c[1] + 1j * c[0]) / size
        worst = max(worst, float(np.abs(found - Z[:, axis]).max() / np.abs(Z).max()))
    return 100 * worst

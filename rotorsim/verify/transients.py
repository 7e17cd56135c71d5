"""Transient tests of a law: speed and pressure ramps, overload impact, frozen sensor, noise."""

from __future__ import annotations

import numpy as np

from rotorsim.base.constants import KRPM, RIG_SAMPLE
from rotorsim.experiments.catalogue.impact import Impact
from rotorsim.plant import Plant
from rotorsim.verify.other import AnyLaw
from rotorsim.verify.running import Frozen, Run, run_rows, steady_rows

REST = 0.4
"""Time [s] at constant values before and after a change."""


def changing(
    speeds: tuple[float, float], pressures: tuple[float, float], duration: float, Ts: float = RIG_SAMPLE
) -> np.ndarray:
    """Rows every `Ts` [s] that stay, go straight from the first to the second values in `duration` [s], and stay."""
    rest, n = round(REST / Ts), max(round(duration / Ts), 1)
    part = np.concatenate([np.zeros(rest), np.arange(1, n + 1) / n, np.ones(rest)])
    rows = np.zeros((len(part), 6))
    rows[:, 0] = speeds[0] + (speeds[1] - speeds[0]) * part
    rows[:, 1] = pressures[0] + (pressures[1] - pressures[0]) * part
    return rows


def speed_ramp(plant: Plant, law: AnyLaw | None, rate: float, pressure: float = 0.5e6) -> Run:
    """From rest to 6 krpm at one pressure, at a rate [rad/s^2]."""
    Ts = plant.machine.sampling_time
    return run_rows(plant, law, changing((0.0, 6 * KRPM), (pressure, pressure), 6 * KRPM / rate, Ts))


def pressure_step(plant: Plant, law: AnyLaw | None, low: float = 0.3e6, high: float = 0.7e6) -> Run:
    """From one pressure to the other from one sample to the next, at 3 krpm."""
    Ts = plant.machine.sampling_time
    return run_rows(plant, law, changing((3 * KRPM, 3 * KRPM), (low, high), Ts, Ts))


def pressure_ramp(plant: Plant, law: AnyLaw | None, low: float = 0.7e6, high: float = 0.3e6) -> Run:
    """From one pressure to the other within half a second, at 3 krpm."""
    Ts = plant.machine.sampling_time
    return run_rows(plant, law, changing((3 * KRPM, 3 * KRPM), (low, high), 0.5, Ts))


def overload(plant: Plant, law: AnyLaw | None, peak: float) -> Run:
    """A hit that drives the references to their limits, at 3 krpm and 0.5 MPa."""
    Ts = plant.machine.sampling_time
    rows = steady_rows(3 * KRPM, 0.5e6, 1.0, Ts)
    hammer = Impact(peak=peak, angle=np.pi / 4, lead=REST, spacing=0.5, Ts=Ts)
    own = hammer.rows(0, hammer.samples)
    rows[: len(own), 4:6] += own[:, 4:6]
    return run_rows(plant, law, rows)


def frozen_sensor(plant: Plant, law: AnyLaw | None, channel: int) -> Run:
    """A displacement sensor that hangs, at 3 krpm and 0.5 MPa."""
    rows = steady_rows(3 * KRPM, 0.5e6, 1.2, plant.machine.sampling_time)
    return run_rows(plant, law, rows, fault=Frozen(channel, REST))


def at_rest(plant: Plant, law: AnyLaw, speed: float = 0.0, pressure: float = 0.5e6) -> Run:
    """A run in which nothing happens."""
    return run_rows(plant, law, steady_rows(speed, pressure, 0.8, plant.machine.sampling_time))


def noise(run: Run) -> np.ndarray:
    """Standard deviation (2,) [V] of the reference in a run at rest; infinite where the run ended."""
    return np.full(2, np.inf) if run.ended else run.reference[run.count(REST) :].std(axis=0)


def runup(plant: Plant, law: AnyLaw | None, rate: float, pressure: float, stop: float, down: bool = True) -> Run:
    """From rest to `stop` [rad/s] and, if `down`, back again, at a rate [rad/s^2]."""
    up = changing((0.0, stop), (pressure, pressure), stop / rate, plant.machine.sampling_time)
    return run_rows(plant, law, np.vstack([up, up[::-1]]) if down else up)


def amplitude(run: Run, first: int, last: int, name: str = "disc") -> float:
    """Amplitude [m] at the shaft's frequency of the larger axis, over samples first to last."""
    return float(amplitudes(run, first, last, name).max())


def amplitudes(run: Run, first: int, last: int, name: str = "disc") -> np.ndarray:
    """Amplitudes (2,) [m] at the shaft's frequency along x and y, over samples first to last.

    A law with a notch removes what its sensors show: `disc_measured`, of which runout is a part, and not `disc`.
    """
    angle = run.column("angle")[first:last]
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones(last - first)])
    found = np.linalg.lstsq(basis, run.pair(name)[first:last], rcond=None)[0]
    return np.asarray(np.hypot(found[0], found[1]))


def excursion(run: Run) -> float:
    """Largest distance [m] of the disc from a moving mean over 0.1 s; infinite where the run ended."""
    if run.ended:
        return float("inf")
    window = run.count(0.1)
    kernel = np.ones(window) / window
    padded = np.pad(run.disc, ((window // 2, window - window // 2 - 1), (0, 0)), mode="edge")
    mean = np.column_stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(2)])
    return float(np.linalg.norm(run.disc - mean, axis=1).max())

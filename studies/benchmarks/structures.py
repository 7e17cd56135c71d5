"""Benchmark of structures: Model 2 without and with rates of the pins, held against the plant's linearisation.

Exact responses from pins to disc at four operating points, weighted as the power of a PRBS does; no noise, no stroke.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import identification as idn
from identification.local.greybox import STRUCTURES, modes
from identification.local.structures import Structure
from identification.records.frequency_response import FrequencyResponse
from rotorsim.analysis.supply import regulator_pressure
from rotorsim.base.units import RPM
from rotorsim.plant.plant import Plant
from rotorsim.study.identification_vs_physics import Physics, physics
from studies.benchmarks.result import Figure

POINTS = ((0, 0.3e6), (3000, 0.5e6), (6000, 0.7e6), (5500, 0.35e6))
"""Speeds [rpm] and pressures [Pa]."""
LINES = np.linspace(5.0, 190.0, 150)
"""Frequencies [Hz]."""
HOLD, PRECISE, LEAST = 5e-3, 1e-3, 0.1
"""Time [s] for which the PRBS stands; standard deviation of a response over its largest, least weight of a line."""
TINY = 1e-6
"""Share of a matrix's largest element below which another is none."""
NAMES = {"rotor": "Model 2", "rotor-rate": "Model 2 with rates"}


def structures() -> Iterator[Figure]:
    """Largest error of a frequency and of a damping ratio of either structure at each point."""
    plant = Plant("dtu_gas_bearing")
    for rpm, pressure in POINTS:
        speed = rpm * RPM
        true, response = physics(plant, speed, pressure), exact(plant, speed, pressure)
        for kind, name in NAMES.items():
            fitted = idn.fit_frequency_response(response, model=begun(kind, true))
            wn, zeta = modes(fitted.theta)
            where = f"{name}, linearised plant at {rpm} rpm, {1e-6 * pressure:g} MPa"
            yield Figure(f"{where}: largest error of a frequency", _off(wn, true.wn), "%")
            yield Figure(f"{where}: of a damping ratio", _off(zeta, true.zeta), "%")


def exact(plant: Plant, speed: float, pressure: float) -> FrequencyResponse:
    """Response from pins, in volts, to disc at a speed [rad/s] and gauge pressure [Pa]."""
    found = plant.linearise(speed, regulator_pressure(plant.assembly, speed, pressure))
    G = np.array([found.transfer(2j * np.pi * f)[:, :2] for f in LINES])
    sd = PRECISE * np.abs(G).max() / np.maximum(np.sinc(LINES * HOLD), LEAST)
    return idn.measured_response(2 * np.pi * LINES, G, np.broadcast_to(sd[:, None, None], G.shape).copy())


def begun(kind: str, true: Physics) -> Structure:
    """A structure that starts at the response's own stiffness, damping, gain and delay, without rates."""
    structure, KDB = STRUCTURES[kind], true.KDB.reshape(3, 4)
    KDB = np.where(np.abs(KDB) > TINY * np.abs(KDB).max(axis=1, keepdims=True), KDB, 0.0)  # none across at standstill
    rest = np.zeros(len(structure.parameters) - KDB.size - 2)
    return replace(structure, start=tuple(np.concatenate([KDB.ravel(), 2 / true.delay, rest]).tolist()))


def _off(values: np.ndarray, true: np.ndarray) -> float:
    return 100 * float(np.abs(values / true - 1).max())

"""Linearised plant at an operating point, expressed in the parameters of the identified models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identification.local.start import levy
from identification.records.frequency_response import FrequencyResponse
from rotorsim.analysis.supply import regulator_pressure

if TYPE_CHECKING:
    from rotorsim.plant.plant import Plant


@dataclass(frozen=True, eq=False)
class Physics:
    """wn [rad/s], zeta, delay [s] (2,), static_gain (2, 2) [m/V], K, D, B (12,) that come closest to its response.

    The delay is the film's alone; an identified one contains the actuators. K, D, B are a least-squares fit to the
    response of the linearised plant between 0.1 and 1.8 times the first natural frequency, the film's delay given.
    """

    wn: np.ndarray
    zeta: np.ndarray
    static_gain: np.ndarray
    delay: np.ndarray
    KDB: np.ndarray


def physics(plant: Plant, speed: float, pressure: float) -> Physics:
    """The linearised plant at `speed` [rad/s] and gauge `pressure` [Pa] at the injectors, as a record has it."""
    found = plant.linearise(speed, regulator_pressure(plant.assembly, speed, pressure))
    peak = float(found.wn[0])
    omega = np.linspace(0.1 * peak, 1.8 * peak, 60)
    G = np.array([found.transfer(1j * w)[:, :2] for w in omega])
    ones = np.ones((len(omega), 2))
    response = FrequencyResponse(omega, G, ones, ones, 1)
    KDB = levy(response, peak, np.exp(-1j * omega * found.delay.mean()))
    return Physics(found.wn[:2], found.zeta[:2], found.static_gain, found.delay, KDB)

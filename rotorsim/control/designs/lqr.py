r"""LQG control: linear quadratic regulator with Kalman filter on the sampled model with its delay.

.. math:: J = \sum (y_k/y_0)^2 + (u_k/u_0)^2

The disturbance is a white force on the rotor, which the model knows as the rate of its velocities, of standard
deviation `force`; it enters where Model 3's lags do. Levels are those of a hammer blow and of the sensors' noise.

Cites: astrom_1997.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotorsim.base.units import KRPM, MPA
from rotorsim.control.designs.specification import (
    Specification,
    number,
    register,
    sampling_time,
    shaft_speed,
    supply_pressure,
)
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import proved_law
from rotorsim.control.plants import Model, check_modes, design_plant, sampled_plant
from rotorsim.control.systems import System, observer_law, sampled_riccati


@dataclass(frozen=True)
class LqrSpec(Specification):
    """Operating point; weights of the regulator and noise levels of the Kalman filter, all of which must be above 0."""

    speed: float = shaft_speed(3 * KRPM)
    pressure: float = supply_pressure(0.5 * MPA)
    y: float = number(1.0, "um", "Displacement y_0 that costs as much as u_0; without it there is no optimum.", above=0)
    u: float = number(0.5, "V", "Reference u_0 that costs as much as y_0; without it there is no optimum.", above=0)
    force: float = number(
        0.3, "um/ms", "Standard deviation of the velocities' disturbance; without it there is no optimum.", above=0
    )
    noise: float = number(
        0.33, "um", "Standard deviation of the sensors' noise; without it there is no optimum.", above=0
    )
    Ts: float = sampling_time()


Spec = LqrSpec


class Gains(NamedTuple):
    """Sampled plant (um, V), gain F (2, n) and cost P (n, n) of the regulator, gain L (n, 2) of the Kalman filter."""

    plant: System
    F: np.ndarray
    P: np.ndarray
    L: np.ndarray


@register("linear quadratic regulator on a Kalman filter")
def design(model: Model, spec: LqrSpec | None = None) -> Law:
    """The law; raises DesignError if two weights are too far apart, or a mode is not moved or seen."""
    spec = spec or LqrSpec()
    found = gains(model, spec)
    return proved_law("lqr", model, observer_law(found.plant, found.F, found.L), spec)


def gains(model: Model, spec: LqrSpec) -> Gains:
    """Regulator and Kalman filter; P is the cost in units of 1/u^2."""
    check_modes(design_plant(model, spec.speed, spec.pressure), "lqr")
    plant = sampled_plant(model, spec.speed, spec.pressure, spec.Ts)
    n = plant.order
    G = np.zeros((n, 2))
    G[2:4] = np.eye(2) * spec.force
    Q = plant.C.T @ plant.C * (spec.u / spec.y) ** 2  # cost in units of 1/u^2, covariances in those of noise^2
    fault = (
        "lqr: the Riccati equation of the {} has no stabilising solution in double precision; bring {} closer together"
    )
    weights = fault.format("regulator", "y and u")
    P = sampled_riccati(plant.A, plant.B, Q, np.eye(2), weights)
    F = np.linalg.solve(np.eye(2) + plant.B.T @ P @ plant.B, plant.B.T @ P @ plant.A)
    levels = fault.format("Kalman filter", "force and noise")
    V = sampled_riccati(plant.A.T, plant.C.T, (G @ G.T + 1e-9 * np.eye(n)) / spec.noise**2, np.eye(2), levels)
    L = np.linalg.solve(np.eye(2) + plant.C @ V @ plant.C.T, plant.C @ V).T
    return Gains(plant, F, P, L)

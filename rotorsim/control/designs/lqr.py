r"""LQG control: linear quadratic regulator with Kalman filter on the sampled model with its delay.

.. math:: J = \sum (y_k/y_0)^2 + (u_k/u_0)^2

The disturbance is a white force on the rotor, which the model knows as the rate of its velocities, of standard
deviation `force`; it enters where Model 3's lags do. Levels are those of a hammer blow and of the sensors' noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.base.constants import KRPM, MPA, SAMPLE
from rotorsim.control.designs.observers import observer_law
from rotorsim.control.designs.plants import Model, check_modes, design_plant, sampled_plant
from rotorsim.control.errors import DesignError
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import check_period, constant_law
from rotorsim.control.loop.stability_check import check_loop
from rotorsim.control.riccati import sampled_riccati


@dataclass(frozen=True)
class Spec:
    """Operating point [rad/s, Pa]; y_0 [um], u_0 [V]; standard deviations of velocity [um/ms] and noise [um]."""

    speed: float = 3 * KRPM
    pressure: float = 0.5 * MPA
    y: float = 1.0
    u: float = 0.5
    force: float = 0.3
    noise: float = 0.33
    Ts: float = SAMPLE


def design(model: Model, spec: Spec | None = None) -> Law:
    """The law; raises DesignError if a weight is not positive, two are too far apart, or a mode not moved or seen."""
    spec = spec or Spec()
    for name in ("y", "u", "force", "noise"):
        if not getattr(spec, name) > 0:
            raise DesignError(
                f"lqr.{name} = {getattr(spec, name)}: a weight without this part has no optimum; give > 0"
            )
    check_period(spec.Ts)
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
    law = constant_law("lqr", observer_law(plant, F, L), spec)
    check_loop(law, model, [(spec.speed, spec.pressure)])
    return law

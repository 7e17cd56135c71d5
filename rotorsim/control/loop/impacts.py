r"""Impact response of the closed loop on the identified model, without simulating the plant.

A hit is a jump of the rotor's velocity: the first states of every grey-box structure are positions and velocities.
Ratios of closed to open loop need no mass. Weights can so be chosen without seeing the plant they are verified on.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rotorsim.control.designs.plants import Model, sampled_plant
from rotorsim.control.law import Law
from rotorsim.control.loop.sampled_loop import law_system
from rotorsim.control.numerics.systems import System

SAMPLES = 500


def hit_responses(plant: System, controller: System | None, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """Norms (2,) of the disc [um] and of the reference [V] after a jump of 1 um/ms along x and along y."""
    n = plant.order
    m = 0 if controller is None else controller.order
    x, c = np.zeros((n, 2)), np.zeros((m, 2))
    x[2:4] = np.eye(2)
    disc, reference = np.zeros(2), np.zeros(2)
    for _ in range(samples):
        y = plant.C @ x
        u = np.zeros((2, 2))
        if controller is not None:
            u = controller.C @ c + controller.D @ y
            c = controller.A @ c + controller.B @ y
        x = plant.A @ x + plant.B @ u
        disc, reference = disc + (y**2).sum(axis=0), reference + (u**2).sum(axis=0)
    return np.sqrt(disc), np.sqrt(reference)


def hit_ratios(law: Law, model: Model, points: Iterable[tuple[float, float]]) -> np.ndarray:
    """Closed over open norms of the impact response (points, 2) at operating points [rad/s, Pa], on the model.

    Examples
    --------
    >>> import rotorsim as rs
    >>> bool((rs.control.hit_ratios(law, lpv, [(300.0, 0.5e6)]) > 0).all())
    True
    """
    rows = []
    for speed, pressure in points:
        plant = sampled_plant(model, speed, pressure, law.Ts)
        closed, _ = hit_responses(plant, law_system(law, speed, pressure))
        rows.append(closed / hit_responses(plant, None)[0])
    return np.array(rows)

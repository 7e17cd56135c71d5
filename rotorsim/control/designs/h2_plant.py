r"""Generalised plant of the H2 design (thesis Paper G, figure G.2): 14 states for Model 3.

.. math:: z = \begin{bmatrix} W_p y\\ W_u u\\ W_i \int y \end{bmatrix}, \quad y_\Delta = \int y + W_n w_n, \quad
          y = G u + G_f w_f, \qquad K = K_\Delta / s

w_f is a force on the rotor. W_p peaks at the shaft's speed, so that imbalance is rejected there; the integrators bring
the disc back to its centre.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.control.designs.mixed import Generalised
from rotorsim.control.designs.specification import Specification, number
from rotorsim.control.designs.weights import high_pass, notch
from rotorsim.control.numerics.systems import System, block_diag, series, side_by_side


@dataclass(frozen=True)
class H2Weights(Specification):
    """Thesis section G.3.1.

    The thesis leaves the imbalance gain B_delta and the units of W_i and W_n open; `force`, `W_i` and `W_n` are
    chosen here.
    """

    zeta_1: float = number(0.3, "1", "Damping ratio of W_p's zeros.")
    zeta_2: float = number(0.01, "1", "Damping ratio of W_p's poles.")
    k_0: float = number(0.5, "1", "W_p at rest over its level.")
    level: float = number(0.5, "1", "W_p at high frequency.")
    A_b: float = number(10 / 11, "1", "Inverse of W_u at rest.")
    over_M_b: float = number(165.0, "1", "1/M_b: W_u at high frequency.")
    omega_b: float = number(22000 * np.pi, "1/s", "Corner of W_u.", example=69000.0)
    W_i: float = number(1e-3, "1/ms", "Weight of the integral of the displacement.")
    W_n: float = number(0.5, "um*ms", "Level of the noise on the integral.")
    force: float = number(1.0, "um/ms^2", "Level of the force on the rotor.")


def scheduled_plant(plant: System, speed: float, weights: H2Weights) -> Generalised:
    """The generalised plant of a continuous plant in um, V and ms at a speed [rad/s]."""
    one = notch(speed / 1e3, weights.zeta_1, weights.zeta_2, weights.k_0, weights.level)
    up = high_pass(weights.omega_b / 1e3, weights.A_b, weights.over_M_b)
    Wp, Wu = side_by_side(one, one), side_by_side(up, up)
    n, p, u = plant.order, Wp.order, Wu.order
    A = block_diag(plant.A, Wp.A, Wu.A, np.zeros((2, 2)))
    A[n : n + p, :n], A[n + p + u :, :n] = Wp.B @ plant.C, plant.C
    total = len(A)
    B1 = np.zeros((total, 4))
    B1[2:4, :2] = weights.force * np.eye(2)
    B2 = np.vstack([plant.B, np.zeros((p, 2)), Wu.B, np.zeros((2, 2))])
    C1 = np.zeros((6, total))
    C1[:2, :n], C1[:2, n : n + p] = Wp.D @ plant.C, Wp.C
    C1[2:4, n + p : n + p + u] = Wu.C
    C1[4:, n + p + u :] = weights.W_i * np.eye(2)
    C2 = np.zeros((2, total))
    C2[:, n + p + u :] = np.eye(2)
    D12 = np.vstack([np.zeros((2, 2)), Wu.D, np.zeros((2, 2))])
    D21 = np.hstack([np.zeros((2, 2)), weights.W_n * np.eye(2)])
    return Generalised(A, B1, B2, C1, C2, np.zeros((6, 4)), D12, D21)


def with_integrator(K: System) -> System:
    """K / s: the controller that the plant itself meets."""
    integrator = System(np.zeros((2, 2)), np.eye(2), np.eye(2), np.zeros((2, 2)))
    return series(integrator, K)

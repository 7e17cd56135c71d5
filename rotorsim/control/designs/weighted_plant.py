r"""Generalised plant of the mixed sensitivity problem (thesis eq. E.16): 12 states for Model 3.

.. math:: z = \begin{bmatrix} W_p (w_1 + G u + G_f w_2)\\ W_u u\end{bmatrix}, \qquad y = w_1 + G u + G_f w_2

w_1 disturbs the output, as in the thesis. w_2, absent unless `force` is positive, disturbs the rotor's accelerations,
as a hammer does; without it an optimal controller may cancel the plant's lightly damped poles, which then stay in the
answer to forces.

The weighting filters are those of thesis E.13 to E.15 and of Paper G (G.6 to G.8), with rates per ms:

.. math:: w_p = \frac{s^2 + 2\zeta_1\omega s + \omega^2 k_0}{s^2 + 2\zeta_2\omega s + \omega^2}, \qquad
          w_u = \frac{s/M_b + \omega_b}{s + \omega_b A_b}

Cites: skogestad_2005, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotorsim.control.designs.specification import Specification, number
from rotorsim.control.plants import axis_modes
from rotorsim.control.systems import System, block_diag, side_by_side


@dataclass(frozen=True)
class Weights(Specification):
    """Weights of thesis section E.3."""

    zeta_1: float = number(0.3, "1", "Damping ratio of W_p's zeros; W_p and its inverse are stable above 0.", above=0)
    zeta_2: float = number(0.05, "1", "Damping ratio of W_p's poles; W_p and its inverse are stable above 0.", above=0)
    k_0: float = number(1 / 3, "1", "W_p at rest; W_p and its inverse are stable above 0.", above=0)
    A_b: float = number(10.0, "1", "Inverse of W_u at rest; W_u and its inverse are stable above 0.", above=0)
    over_M_b: float = number(15.0, "1", "1/M_b: W_u at high frequency.")
    omega_b: float = number(
        2000 * np.pi, "1/s", "Corner of W_u; W_u and its inverse are stable above 0.", above=0, example=6280.0
    )
    force: float = number(0.0, "1", "Level of the force among the disturbances.", low=0)


RIG = Weights(zeta_2=0.1, k_0=0.9, force=0.3)
"""Weights for the virtual rig, chosen by `rotorsim.control.designs.weight_search` on its identified Model 2 alone.

The thesis' k_0 = 1/3 lets the loop amplify slow disturbances three times: the law softens the bearing, and hits of 20 N
then leave the range in which the film is linear. A force among the disturbances asks for damping instead.
"""

MILD = Weights(k_0=0.5, force=0.1)
"""Between the thesis' weights and `RIG`: hits of 20 N stay where the film is linear. They were picked by runs of the
plant at the twenty points of `rotorsim.verify`, out of eight sets, with an LPV law of constant Y; at the twelve
others of `rotorsim.control.designs.weight_search` LPV leaves 0.66, H-infinity 0.655."""


class Generalised(NamedTuple):
    """x' = A x + B1 w + B2 u, z = C1 x + D11 w + D12 u, y = C2 x + D21 w (+ D22 u, which is zero)."""

    A: np.ndarray
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D11: np.ndarray
    D12: np.ndarray
    D21: np.ndarray

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)


def mixed_sensitivity(plant: System, weights: Weights) -> Generalised:
    """The generalised plant of a continuous plant in um, V and ms."""
    wx, wy = axis_modes(plant)
    Wp = side_by_side(*(notch(w, weights.zeta_1, weights.zeta_2, weights.k_0) for w in (wx, wy)))
    one = high_pass(weights.omega_b / 1e3, weights.A_b, weights.over_M_b)
    Wu = side_by_side(one, one)
    n, p, u = plant.order, Wp.order, Wu.order
    Bf = np.zeros((n, 0))
    if weights.force > 0:
        Bf = np.zeros((n, 2))
        Bf[2:4] = weights.force * np.eye(2)
    nw = 2 + Bf.shape[1]
    W1 = np.hstack([np.eye(2), np.zeros((2, nw - 2))])
    A = block_diag(plant.A, Wp.A, Wu.A)
    A[n : n + p, :n] = Wp.B @ plant.C
    B1 = np.vstack([np.hstack([np.zeros((n, 2)), Bf]), Wp.B @ W1, np.zeros((u, nw))])
    B2 = np.vstack([plant.B, np.zeros((p, 2)), Wu.B])
    C1 = np.block([[Wp.D @ plant.C, Wp.C, np.zeros((2, u))], [np.zeros((2, n + p)), Wu.C]])
    C2 = np.hstack([plant.C, np.zeros((2, p + u))])
    D11 = np.vstack([Wp.D @ W1, np.zeros((2, nw))])
    return Generalised(A, B1, B2, C1, C2, D11, np.vstack([np.zeros((2, 2)), Wu.D]), W1)


def closed(P: Generalised, K: System) -> System:
    """From w to z with the controller in place."""
    A = np.block([[P.A + P.B2 @ K.D @ P.C2, P.B2 @ K.C], [K.B @ P.C2, K.A]])
    B = np.vstack([P.B1 + P.B2 @ K.D @ P.D21, K.B @ P.D21])
    C = np.hstack([P.C1 + P.D12 @ K.D @ P.C2, P.D12 @ K.C])
    return System(A, B, C, P.D11 + P.D12 @ K.D @ P.D21)


def notch(omega: float, zeta_1: float, zeta_2: float, k_0: float, level: float = 1.0) -> System:
    """level * w_p in the thesis' realisation (G.7), states y and y' of the filter."""
    A = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta_2 * omega]])
    C = level * np.array([[omega**2 * (k_0 - 1), 2 * omega * (zeta_1 - zeta_2)]])
    return System(A, np.array([[0.0], [1.0]]), C, np.array([[level]]))


def high_pass(omega_b: float, A_b: float, over_M_b: float) -> System:
    """w_u; `over_M_b` is 1/M_b, the gain at high frequency, 1/A_b that at rest."""
    pole = omega_b * A_b
    return System(
        np.array([[-pole]]), np.array([[1.0]]), np.array([[omega_b - over_M_b * pole]]), np.array([[over_M_b]])
    )

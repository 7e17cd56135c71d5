r"""Level of the sensitivity of Fig. B.4 below which no linear controller keeps on a model: a limit, and no design.

.. math:: \gamma = \min_K \left\| \begin{bmatrix} W S\\ \epsilon K S \end{bmatrix} \right\|_\infty, \qquad
          |W(j\omega)|^{-1} \approx \text{1.2 at rest, 0.37 at 70, 190 Hz, 0.25 between, 1.3 at 280, 1.9 at 400 Hz}

What is returned is the lower bound of gamma; the upper one is only what some controller was seen to reach. With it
above 1 no controller, whatever its order and weights, has that S on the model with an effort below

.. math:: |K S| < \sqrt{\gamma^2 - 1} / (10 \epsilon)

10 epsilon being the effort's largest weight. A smaller epsilon allows more effort and gives a lower level, and below
the one here rounding leaves the bounds apart: [1.231, 1.232] at 2e-3, [1.185, 1.196] at 2e-4, [1.140, 1.219] at 5e-5,
[1.030, 1.339] at 1e-5 um/V for the rig at 4000 rpm and 0.7 MPa.

Cites: skogestad_2005, thesis.
"""

from __future__ import annotations

import numpy as np

from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.designs.hinf_synthesis import Generalised, bounds
from rotorsim.control.plants import Model, design_plant
from rotorsim.control.systems import System, block_diag, series, side_by_side

LEVEL = 0.59
SECTIONS = ((0.3254, 0.4428, 0.4946, 0.2587), (1.9226, 0.3817, 1.0608, 0.2435))
"""W: its gain at high frequency, and by section frequency [rad/ms] and damping ratio of zeros, then of poles."""
EFFORT, ROLL_OFF = 5e-5, 3.8
"""epsilon [um/V] at rest, and the frequency [rad/ms] from which on it rises to ten times that."""


def weight() -> System:
    """W for one axis, in ms."""
    made = System(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[LEVEL]]))
    for zero, damping, pole, light in SECTIONS:
        A = np.array([[0.0, 1.0], [-(pole**2), -2 * light * pole]])
        C = np.array([[zero**2 - pole**2, 2 * (damping * zero - light * pole)]])
        made = series(made, System(A, np.array([[0.0], [1.0]]), C, np.eye(1)))
    return made


def least_level(model: Model, speed: float, pressure: float) -> float:
    """Lower bound of gamma on the model at an operating point, with the delay of a sampled law."""
    return float(bounds(problem(model, speed, pressure)).low)


def problem(model: Model, speed: float, pressure: float) -> Generalised:
    """The plant with both weights, in um, V and ms."""
    plant = design_plant(model, speed, pressure, 1.5 * RIG_SAMPLE)
    rate = 10 * ROLL_OFF
    effort = System(np.array([[-rate]]), np.eye(1), np.array([[-9 * EFFORT * rate]]), np.array([[10 * EFFORT]]))
    Wp, Wu = side_by_side(weight(), weight()), side_by_side(effort, effort)
    n, p, u = plant.order, Wp.order, Wu.order
    A = block_diag(plant.A, Wp.A, Wu.A)
    A[n : n + p, :n] = Wp.B @ plant.C
    C1 = np.block([[Wp.D @ plant.C, Wp.C, np.zeros((2, u))], [np.zeros((2, n + p)), Wu.C]])
    return Generalised(
        A, np.vstack([np.zeros((n, 2)), Wp.B, np.zeros((u, 2))]), np.vstack([plant.B, np.zeros((p, 2)), Wu.B]), C1,
        np.hstack([plant.C, np.zeros((2, p + u))]), np.vstack([Wp.D, np.zeros((2, 2))]),
        np.vstack([np.zeros((2, 2)), Wu.D]), np.eye(2),
    )  # fmt: skip

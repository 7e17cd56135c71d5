r"""State feedback with a current Luenberger observer as one discrete law.

.. math:: \hat x_{k|k} = \hat x_k + L (y_k - C \hat x_k), \quad u_k = -F \hat x_{k|k}, \quad
          \hat x_{k+1} = A \hat x_{k|k} + B u_k

The plant's input register (its sample of delay) is part of x, so u_k acts on time in the observer.

Cites: astrom_1997.
"""

from __future__ import annotations

import numpy as np

from rotorsim.control.systems import System


def observer_law(plant: System, F: np.ndarray, L: np.ndarray) -> System:
    """The law from y to u of gains F (2, n) and L (n, 2) about a sampled plant."""
    inner = np.eye(plant.order) - L @ plant.C
    closed = plant.A - plant.B @ F
    return System(closed @ inner, closed @ L, -F @ inner, -F @ L)

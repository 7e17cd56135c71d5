r"""H2-optimal controller of a generalised plant from two Riccati equations.

.. math:: K_\Delta: \quad A_K = A + B_2 F + L C_2, \quad B_K = -L, \quad C_K = F

Cites: zhou_1996.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_are

from rotorsim.control.designs.mixed import Generalised
from rotorsim.control.errors import DesignError
from rotorsim.control.numerics.systems import System


def h2_controller(P: Generalised) -> System:
    """The optimal controller; raises DesignError where a Riccati equation has no stabilising solution."""
    try:
        R = P.D12.T @ P.D12
        X = solve_continuous_are(P.A, P.B2, P.C1.T @ P.C1, R, s=P.C1.T @ P.D12)
        F = -np.linalg.solve(R, P.B2.T @ X + P.D12.T @ P.C1)
        V = P.D21 @ P.D21.T
        Y = solve_continuous_are(P.A.T, P.C2.T, P.B1 @ P.B1.T, V, s=P.B1 @ P.D21.T)
        L = -np.linalg.solve(V, P.C2 @ Y + P.D21 @ P.B1.T).T
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(f"h2: a Riccati equation has no stabilising solution ({error}); check the weights") from error
    return System(P.A + P.B2 @ F + L @ P.C2, -L, F, np.zeros((P.B2.shape[1], P.C2.shape[0])))

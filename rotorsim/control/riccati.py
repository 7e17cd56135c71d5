r"""Stabilising solution of the discrete Riccati equation, accepted only if its closed loop decays.

.. math:: P = A^T P A - A^T P B (R + B^T P B)^{-1} B^T P A + Q

Cites: zhou_1996.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_discrete_are

from rotorsim.base.rounding import decays
from rotorsim.control.errors import DesignError


def sampled_riccati(A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, fault: str) -> np.ndarray:
    """P (n, n); raises DesignError with the sentence `fault` where there is none or rounding hides it."""
    try:
        P = solve_discrete_are(A, B, Q, R)
        poles = np.linalg.eigvals(A - B @ np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(fault) from error
    if not decays(poles):
        raise DesignError(fault)
    return np.asarray(P)

r"""Frequency response of a state-space model and its derivatives by the parameters.

.. math:: G = C R B + D, \qquad R = (s I - A)^{-1}, \qquad dG = C R\,(dA\, R B + dB) + dC\, R B + dD

with s = j omega of a continuous model, exp(j omega Ts) of a sampled one.

Cites: ljung_1999.
"""

from __future__ import annotations

import numpy as np

from identification.local.structure import Matrices


def response_with_derivatives(matrices: Matrices, slopes: Matrices, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """G (f, p, m) and its derivatives (f, p, m, q) at s (f,).

    matrices : A (n, n), B (n, m), C (p, n), D (p, m); slopes : their derivatives (q, ...).
    """
    A, B, C, D = matrices
    dA, dB, dC, dD = slopes
    R = np.linalg.inv(s[:, None, None] * np.eye(len(A)) - A)
    left, right = C @ R, R @ B
    dG = np.einsum("fin,qnm,fmj->fijq", left, dA, right) + np.einsum("fin,qnj->fijq", left, dB)
    if dC.any() or dD.any():
        dG = dG + np.einsum("qin,fnj->fijq", dC, right) + np.moveaxis(dD, 0, -1)
    return left @ B + D, dG

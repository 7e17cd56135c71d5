r"""Weighting filters of mixed sensitivity (thesis E.13 to E.15) and of Paper G (G.6 to G.8); rates per ms.

.. math:: w_p = \frac{s^2 + 2\zeta_1\omega s + \omega^2 k_0}{s^2 + 2\zeta_2\omega s + \omega^2}, \qquad
          w_u = \frac{s/M_b + \omega_b}{s + \omega_b A_b}

Cites: skogestad_2005, thesis.
"""

from __future__ import annotations

import numpy as np

from rotorsim.control.numerics.systems import System


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

r"""Standard deviations of fitted numbers, from the scatter between operating points (sandwich) or the floor.

.. math:: V = H^{-1} \Big(\sum_i g_i g_i'\Big) H^{-1} \frac{m}{m-1}, \quad g_i = J_i' r_i, \quad H = J'J + P

over the m records; the larger of this and H^-1 is told, because plain ones are too small where errors of a record hang
together. Source: Huber (1967); Liang & Zeger (1986).
"""

from __future__ import annotations

import numpy as np

from rotorsim.discrepancy.fit import Fit, prior_rows


def covariance(fit: Fit, record: np.ndarray) -> np.ndarray:
    """Covariance (k, k) of a fit's knobs; record (n,) says which record a number is of."""
    p = prior_rows(fit.knobs)
    size = np.sqrt(np.sum(fit.J**2, axis=0) + p**2)
    size[size == 0] = 1.0
    J = fit.J / size
    H = J.T @ J + np.diag((p / size) ** 2)
    inverse = np.linalg.pinv(H, rcond=1e-12)
    g = np.array([J[record == i].T @ fit.residual[record == i] for i in np.unique(record)])
    g -= g.mean(axis=0)
    m = len(g)
    between = inverse @ (g.T @ g * m / max(m - 1, 1)) @ inverse
    grown = np.sqrt(np.maximum(np.diag(between), 0) / np.maximum(np.diag(inverse), 1e-300))
    factor = np.maximum(grown, 1.0) / size
    return np.asarray(inverse * np.outer(factor, factor))


def sd_of_polar(c: float, s: float, V: np.ndarray, base: complex = 0.0) -> tuple[float, float, float, float]:
    """Amplitude, phase and their standard deviations of base + c + i s with covariance V (2, 2) of c, s."""
    z = base + complex(c, s)
    a, phi = abs(z), float(np.angle(z))
    along, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    return a, phi, float(np.sqrt(along @ V @ along)), float(np.sqrt(across @ V @ across) / max(a, 1e-300))

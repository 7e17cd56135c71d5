r"""Standard deviations of fitted parameters: sandwich estimator over operating points, or noise floor.

.. math:: V = H^{-1} \Big(\sum_i g_i g_i'\Big) H^{-1} \frac{m}{m-1}, \quad g_i = J_i' r_i, \quad H = J'J + P

over the m records; the larger of this and H^-1 is reported, because plain ones are too small where errors of a record
hang together. Source: Huber (1967); Liang & Zeger (1986).

J must be the Jacobian AT the fitted point: that of a chord, updated step by step, is right along the steps and wrong
across them, which makes parameters that are nearly alike look well determined, and ends a fit where the sum of squares
would still fall along them.

Cites: huber_1967, liang_1986.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.base.rounding import normal_root
from rotorsim.discrepancy.fit.least_squares import ParameterFit, fit as again, prior_rows
from rotorsim.discrepancy.linear_algebra import answer

if TYPE_CHECKING:
    from rotorsim.discrepancy.residuals.comparison import TwinComparison

MOST_ROUNDS = 4
STILL = 0.25
"""Fall of the sum of squares, as the Jacobian at the point foretells it, below which a fit has ended: half a standard
deviation."""


def finished(comparison: TwinComparison, fit: ParameterFit, progress: Callable[[], None] | None = None) -> ParameterFit:
    """Converged fit with central-difference Jacobians at its own point, the last one included."""
    for number in range(MOST_ROUNDS):
        fit = replace(fit, J=comparison.jacobian(fit.point, fit.parameters, progress=progress, central=True))
        if number == MOST_ROUNDS - 1 or fall(fit) < STILL:
            break
        fit = again(comparison, fit.point, fit.parameters, fit.J, fit.residual, steps=2, progress=progress)
    return fit


def fall(fit: ParameterFit) -> float:
    """Predicted decrease of the sum of squares with priors in a Gauss-Newton step."""
    size, J, H = scaled(fit)
    g = J.T @ fit.residual - prior_rows(fit.parameters) ** 2 * fit.vector / size
    return float(np.sum((g @ answer(normal_root, H)) ** 2))


def scaled(fit: ParameterFit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scales (k,) of the fit parameters, and Jacobian (n, k) and Hessian with priors (k, k) in these scales."""
    p = prior_rows(fit.parameters)
    size = np.sqrt(np.sum(fit.J**2, axis=0) + p**2)
    size[size == 0] = 1.0
    J = fit.J / size
    return size, J, J.T @ J + np.diag((p / size) ** 2)


def covariance(fit: ParameterFit, record: np.ndarray) -> np.ndarray:
    """Covariance (k, k) of the fit parameters; record (n,) is the record number of each value."""
    size, J, H = scaled(fit)
    root = answer(normal_root, H)
    inverse = root @ root.T
    g = np.array([J[record == i].T @ fit.residual[record == i] for i in np.unique(record)])
    g -= g.mean(axis=0)
    m = len(g)
    g = g @ root
    between = root @ (g.T @ g * m / max(m - 1, 1)) @ root.T
    grown = np.sqrt(np.maximum(np.diag(between), 0) / np.maximum(np.diag(inverse), 1e-300))
    factor = np.maximum(grown, 1.0) / size
    return np.asarray(inverse * np.outer(factor, factor))


def sd_of_polar(c: float, s: float, V: np.ndarray, base: complex = 0.0) -> tuple[float, float, float, float]:
    """Amplitude, phase and their standard deviations of base + c + i s with covariance V (2, 2) of c, s."""
    z = base + complex(c, s)
    a, phi = abs(z), float(np.angle(z))
    along, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    return a, phi, float(np.sqrt(along @ V @ along)), float(np.sqrt(across @ V @ across) / max(a, 1e-300))

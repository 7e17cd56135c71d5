"""Small LPV models of every structure with chosen parameters."""

import numpy as np

from identification.local.greybox import STRUCTURES
from identification.lpv_model import LpvModel, fit_surfaces, make_basis

POINTS = np.array([(w, p) for w in np.linspace(0, 600, 5) for p in np.linspace(3e5, 7e5, 4)])
PIEZO = (4e6, 2000.0, 20.0, 4e6, 2100.0, 20.0)

DEAD = (4000.0, 2500.0)


def theta_at(kind, w, p):
    """Parameters that are second-order polynomials of the operating point."""
    a, b = w / 600, (p - 3e5) / 4e5
    if kind == "blackbox":
        A, B, C = (
            np.array([[0.9, 0.3 + 0.05 * a], [-0.3, 0.9 - 0.02 * b]]),
            1e-6 * np.eye(2),
            np.eye(2) * (1 + 0.1 * a * b),
        )
        return np.concatenate([A.ravel(), B.ravel(), C.ravel()])
    K = np.array([-6e5, -2e4 * a, 2e4 * a, -6.4e5]) * (1 + 0.3 * b + 0.02 * a * a)
    D = np.array([-60.0, 5.0, -5.0, -60.0]) * (1 - 0.4 * b - 0.1 * a * b)
    B = np.array([5.0, 0.4, -0.4, 5.0]) * (1 + 0.2 * b * b - 0.05 * a)
    B *= 1e6 if kind == "2" else 1.0  # per metre of pin
    lags = [1500 - 100 * b, 1600 - 100 * a]
    return np.concatenate([K, D, B, {"1": [], "3": lags, "3-delay": [*lags, *DEAD], "2": [*lags, *PIEZO]}[kind]])


def make_lpv(kind):
    """A model of kind 1, 2, 3, 3-delay or blackbox (2 states, sampled at 0.2 ms)."""
    theta = np.array([theta_at(kind, w, p) for w, p in POINTS])
    basis, q = make_basis(POINTS, 2), theta.shape[1]
    sampled = kind == "blackbox"
    names = tuple(f"t{k}" for k in range(q)) if sampled else STRUCTURES[kind].parameters
    coefficients = fit_surfaces(basis, POINTS, theta)
    return LpvModel(
        kind, names, coefficients, basis, 2, POINTS, np.zeros(q), np.zeros(q), "none", 2e-4 if sampled else 0.0, 2
    )

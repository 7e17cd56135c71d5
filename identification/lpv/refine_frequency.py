r"""Refinement of surfaces by their frequency responses against those of the local models (thesis, section 4.1).

.. math:: \min_c \sum_j \sum_\omega \| G(\theta(q_j; c), j\omega) - G_j(j\omega) \|_F^2 / \overline{\|G_j\|_F^2}

by Gauss and Newton with damping from the plain surfaces.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.errors import UnfitError
from identification.local.frequency.response import response_with_derivatives
from identification.local.greybox import STRUCTURES, modes
from identification.local.structure import Structure
from identification.lpv.model import LpvModel

LINES, ITERATIONS, SPAN = 60, 12, (0.05, 2.5)
"""Frequencies, most steps, and range of frequencies in units of the mean natural frequency."""


def response(structure: Structure, theta: np.ndarray, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """G (f, 2, 2) and its derivatives (f, 2, 2, q)."""
    return response_with_derivatives(structure.matrices(theta), structure.derivatives(theta), 1j * omega)


def frequencies(values: np.ndarray) -> np.ndarray:
    """Lines [rad/s] for parameters (k, q) of a structure with K and D in front."""
    middle = float(np.mean([modes(theta)[0] for theta in values]))
    return np.geomspace(SPAN[0] * middle, SPAN[1] * middle, LINES)


def distance(model: LpvModel, points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Relative distance (k,) of frequency responses of surfaces and local parameters (k, q) at points (k, 2).

    Examples
    --------
    >>> import rotorsim as rs
    >>> points = np.array([[300.0, 0.5e6]])
    >>> rs.identification.distance(lpv, points, np.array([lpv.theta(*points[0])])).tolist()
    [0.0]
    """
    structure, omega = STRUCTURES[model.kind], frequencies(values)
    found = []
    for q, theta in zip(points, values, strict=True):
        local, surface = (response(structure, t, omega)[0] for t in (theta, model.theta(*q)))
        found.append(np.linalg.norm(surface - local) / np.linalg.norm(local))
    return np.array(found)


def refine_frequency(model: LpvModel, points: np.ndarray, values: np.ndarray) -> LpvModel:
    """Refined surfaces; raises UnfitError for black-box models."""
    if model.kind == "blackbox":
        raise UnfitError("fit_lpv.refine: a black-box model has no structure to refine; take model 1, 2 or 3")
    structure, omega, basis = STRUCTURES[model.kind], frequencies(values), model.basis.at(points)
    local = [response(structure, theta, omega)[0] for theta in values]
    weights = [1 / np.linalg.norm(G) for G in local]

    def normal(c: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        N, g, cost = np.zeros((c.size, c.size)), np.zeros(c.size), 0.0
        for phi, G0, weight in zip(basis, local, weights, strict=True):
            G, dG = response(structure, c @ phi, omega)
            e, J = weight * (G0 - G).ravel(), weight * dG.reshape(-1, len(c))
            cost += float(np.sum(np.abs(e) ** 2))
            N += np.kron((J.conj().T @ J).real, np.outer(phi, phi))
            g += np.kron((J.conj().T @ e).real, phi)
        return N, g, cost

    return replace(model, coefficients=minimise(normal, model.coefficients, ITERATIONS), refined="frequency")


def minimise(normal, c: np.ndarray, iterations: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Coefficients (q, t) where normal(c) -> (N, g, cost) comes to rest, by Levenberg and Marquardt."""
    damping, (N, g, cost) = 1e-4, normal(c)
    for _ in range(iterations):
        scale = np.sqrt(np.maximum(np.diag(N), 1e-300))
        M, s = N / np.outer(scale, scale), g / scale
        step = np.linalg.solve(M + damping * np.eye(len(M)), s)
        promised = float(2 * step @ s - step @ M @ step)
        if promised < 1e-8 * cost:
            break
        trial = c + (step / scale).reshape(c.shape)
        found = normal(trial)
        if np.isfinite(found[2]) and found[2] < cost:
            c, (N, g, cost), damping = trial, found, damping / 10
        else:
            damping *= 20
    return c

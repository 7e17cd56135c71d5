r"""Lowest eigenvalues of a rotor at many speeds at once, from a Krylov space of the inverse state matrix.

The inverse of the state matrix, A^-1 (q, v) = (-K^-1 (D q + M v), q), needs K^-1 C, K^-1 G, K^-1 M once for all speeds
where K does not change with them. A Krylov space of it, started from two vectors so that it also finds double
frequencies, holds the modes of smallest \|lambda\|; it is built for all speeds in the same few matrix products. What
has not converged is left to the caller, who solves the whole problem there.

Source: A. Ruhe, Math. Comp. 33 (1979) 680 (the band form of the Arnoldi process).

Cites: ruhe_1979.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, lu_factor, lu_solve

Matrix = NDArray[np.float64]
_CONVERGED = 1e-9
"""Residual of an eigenvalue over its size: the square of it is the error where the problem is near a symmetric one."""
_LEAST_CONDITION = 1e-14


@dataclass(frozen=True, eq=False)
class Inverse:
    """K^-1 M, K^-1 C, K^-1 G of scaled coordinates, the frequency [rad/s] that makes them plain numbers, the scale."""

    M: Matrix
    C: Matrix
    G: Matrix
    frequency: float
    scale: Matrix


def invert(M: Matrix, C: Matrix, G: Matrix, K: Matrix) -> Inverse | None:
    """Prepare; None where K is singular, as for a free rotor."""
    scale = 1 / np.sqrt(np.diag(M))
    M, C, G, K = (scale[:, None] * matrix * scale for matrix in (M, C, G, K))
    try:
        factor = lu_factor(K)
    except (LinAlgError, ValueError):
        return None
    pivots = np.abs(np.diag(factor[0]))
    if pivots.min() < _LEAST_CONDITION * pivots.max():
        return None
    n = len(M)
    parts = lu_solve(factor, np.hstack([M, C, G]))
    mass = parts[:, :n]
    frequency = float(1 / np.sqrt(max(np.abs(np.diag(mass)).sum(), np.finfo(float).tiny)))
    return Inverse(
        mass * frequency**2, parts[:, n : 2 * n] * frequency, parts[:, 2 * n :] * frequency, frequency, scale
    )


def lowest(inverse: Inverse, speeds: Matrix, depth: int) -> tuple[Matrix, Matrix, Matrix]:
    """Eigenvalues (n_speeds, depth) [rad/s], vectors (n_speeds, n, depth) and relative residuals (n_speeds, depth)."""
    basis, H = _arnoldi(inverse, speeds, depth)
    theta, y = np.linalg.eig(H[:, :depth])
    tail = np.linalg.norm(H[:, depth:] @ y, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        residual = tail / np.abs(theta)
        values = inverse.frequency / theta
    n = len(inverse.M)
    vectors = inverse.scale[:, None] * (basis[:, :depth, :n].transpose(0, 2, 1) @ y)
    return values, vectors, residual


def converged(residual: Matrix) -> NDArray[np.bool_]:
    """Which residuals mark an eigenvalue as found."""
    return np.asarray(residual < _CONVERGED)


def _arnoldi(inverse: Inverse, speeds: Matrix, depth: int) -> tuple[Matrix, Matrix]:
    """Basis (n_speeds, depth + 2, 2n) and band Hessenberg matrix (n_speeds, depth + 2, depth)."""
    n, count = len(inverse.M), len(speeds)
    basis = np.zeros((count, depth + 2, 2 * n))
    H = np.zeros((count, depth + 2, depth))
    start = np.random.default_rng(0).standard_normal((2, 2 * n))
    basis[:, :2] = np.linalg.qr(start.T)[0].T
    stacked = np.hstack([inverse.C.T, inverse.G.T])
    for j in range(depth):
        q, v = basis[:, j, :n], basis[:, j, n:]
        forces = q @ stacked
        w = np.concatenate([-(forces[:, :n] + speeds[:, None] * forces[:, n:] + v @ inverse.M.T), q], axis=1)
        known = basis[:, : j + 2]
        for _ in range(2):  # twice is enough
            part = np.matmul(known, w[:, :, None])
            w = w - np.matmul(part.transpose(0, 2, 1), known)[:, 0]
            H[:, : j + 2, j] += part[:, :, 0]
        length = np.linalg.norm(w, axis=1)
        H[:, j + 2, j] = length
        basis[:, j + 2] = w / np.maximum(length, np.finfo(float).tiny)[:, None]
    return basis, H

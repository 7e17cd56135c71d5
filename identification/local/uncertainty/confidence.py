r"""Parameter covariance under coloured residuals: the sandwich estimator (White 1980, Newey and West 1987).

.. math:: \mathrm{cov} = N^{-1} \Big( \sum_{|l| < L} (1 - |l|/L) \sum_k g_k g_{k+l}^T \Big) N^{-1}, \quad
          g_k = J_k^T e_k,\; N = \sum_k J_k^T J_k

Of this `spread` separates what white sensor noise of known size makes, by the same formula without correlations; the
rest comes from what is neither noise nor model (distortion).

The classical covariance sigma^2 N^{-1} is too small where residuals keep their sign for long, as they do after an
output-error fit of a lightly damped rotor.

Cites: newey_1987, white_1980.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

WINDOW = 0.1
"""Correlations of residuals are counted up to this lag [s]."""


class Spread(NamedTuple):
    """Covariance (q, q) of the parameters and the part of it that is not sensor noise."""

    covariance: np.ndarray
    distortion: np.ndarray

    def first(self, count: int) -> Spread:
        """Of the first parameters alone."""
        return Spread(*(M[:count, :count] for M in self))

    def joined(self, other: Spread) -> Spread:
        """Of two independent sets of parameters."""
        return Spread(*(block_diag(*pair) for pair in zip(self, other, strict=True)))


def spread(residual: np.ndarray, J: np.ndarray, Ts: float, noise: np.ndarray) -> Spread:
    """Covariance by `sandwich` and what noise (p,) of known standard deviation leaves unexplained of it."""
    whole = sandwich(residual, J, Ts)
    scale = np.sqrt(np.maximum(np.sum(J**2, axis=(0, 1)), 1e-300))
    unit = J / scale
    inverse = np.linalg.pinv(np.einsum("kpq,kpr->qr", unit, unit), rcond=1e-12, hermitian=True)
    meat = np.einsum("p,kpq,kpr->qr", noise**2, unit, unit)
    rest = whole * np.outer(scale, scale) - inverse @ meat @ inverse
    values, vectors = np.linalg.eigh((rest + rest.T) / 2)
    kept = (vectors * np.maximum(values, 0)) @ vectors.T
    return Spread(whole, kept / np.outer(scale, scale))


def sandwich(residual: np.ndarray, J: np.ndarray, Ts: float, window: float = WINDOW) -> np.ndarray:
    """Covariance (q, q) of the parameters from residual (n, p) and Jacobian (n, p, q)."""
    flat = J.reshape(-1, J.shape[2])
    scale = np.sqrt(np.maximum(np.sum(flat**2, axis=0), 1e-300))
    scores = np.einsum("kp,kpq->kq", residual, J) / scale
    lag = int(np.clip(window / Ts, 1, max(len(scores) // 20, 1)))
    summed = np.cumsum(np.vstack([np.zeros((lag, len(scale))), scores, np.zeros((lag, len(scale)))]), axis=0)
    blocks = summed[lag:] - summed[:-lag]
    meat = blocks.T @ blocks / lag
    inverse = np.linalg.pinv(flat.T @ flat / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return np.asarray(inverse @ meat @ inverse / np.outer(scale, scale))


def propagate(function: Callable[[np.ndarray], np.ndarray], theta: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard deviations of function(theta) to first order, by central differences."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0))
    columns = []
    for i in range(len(theta)):
        step = 1e-3 * sd[i] + 1e-7 * abs(theta[i]) + 1e-300
        high, low = theta.copy(), theta.copy()
        high[i] += step
        low[i] -= step
        columns.append((np.ravel(function(high)) - np.ravel(function(low))) / (2 * step))
    slope = np.array(columns).T
    return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, covariance, slope), 0))

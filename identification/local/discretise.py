r"""Discretisation of a continuous model with exact derivatives, by one augmented matrix exponential.

.. math:: \exp\begin{bmatrix} A T & B T\\ 0 & 0 \end{bmatrix} = \begin{bmatrix} F & G\\ 0 & I \end{bmatrix}

for inputs that are held; for inputs that run straight from sample to sample (measured pins) a further block gives

.. math:: x_{k+1} = F x_k + (\Gamma_1 - \Gamma_2) u_k + \Gamma_2 u_{k+1}

Scaling, Taylor series and squaring are differentiated term by term, for all parameters at once (Frechet derivative,
Al-Mohy and Higham 2009). Positions and velocities are first scaled alike, which keeps the squarings few.

Cites: almohy_2009.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

HOLDS = ("zero", "first")
TERMS = 12
"""Terms of the Taylor series; with a norm below 1/2 the first one left out is 1e-14."""


def zero_order_hold(A: np.ndarray, B: np.ndarray, Ts: float) -> tuple[np.ndarray, np.ndarray]:
    """F (n, n) and G (n, m) of a model with A and B whose input is held for Ts [s]."""
    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n] = np.hstack([A, B]) * Ts
    held = expm(block)
    return held[:n, :n], held[:n, n:]


def exponential(M: np.ndarray, dM: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """exp(M) of M (n, n) and its derivatives (q, n, n) in the directions dM (q, n, n)."""
    n = len(M)
    scale = _balance(M)
    M, dM = M * (1 / scale)[:, None] * scale, dM * (1 / scale)[:, None] * scale
    norm = max(float(np.abs(M).sum(axis=0).max()), 1e-300)
    squarings = int(max(0, np.ceil(np.log2(norm)) + 1)) if np.isfinite(norm) else 0
    X, dX = M / 2**squarings, dM / 2**squarings
    value, slope = np.eye(n), np.zeros_like(dM)
    for k in range(TERMS, 0, -1):
        slope = (dX @ value + X @ slope) / k
        value = np.eye(n) + X @ value / k
    for _ in range(squarings):
        slope = value @ slope + slope @ value
        value = value @ value
    back = scale[:, None] / scale
    return value * back, slope * back


def _balance(M: np.ndarray) -> np.ndarray:
    """Powers of two by which the states are scaled so that rows and columns of M weigh alike."""
    scale = np.ones(len(M))
    for _ in range(4):
        S = np.abs(M) * (1 / scale)[:, None] * scale
        np.fill_diagonal(S, 0)
        rows, columns = S.sum(axis=1), S.sum(axis=0)
        both = (rows > 0) & (columns > 0)
        scale[both] *= 2.0 ** np.round(0.5 * np.log2(rows[both] / columns[both]))
    return scale


def _augmented(A: np.ndarray, B: np.ndarray, Ts: float, hold: str) -> np.ndarray:
    """Blocks of A (..., n, n) and B (..., n, m)."""
    n, m = B.shape[-2:]
    size = n + m * (2 if hold == "first" else 1)
    block = np.zeros((*A.shape[:-2], size, size))
    block[..., :n, :n], block[..., :n, n : n + m] = A * Ts, B * Ts
    return block


def _inputs(block: np.ndarray, n: int, m: int, hold: str) -> np.ndarray:
    """[F G] out of the exponential."""
    if hold == "zero":
        return block[..., :n, :]
    early, late = block[..., :n, n : n + m], block[..., :n, n + m :]
    return np.concatenate([block[..., :n, :n], early - late, late], axis=-1)


def sampled(A: np.ndarray, B: np.ndarray, Ts: float, hold: str = "zero") -> np.ndarray:
    """[F G]: (n, n + m) for a held input, (n, n + 2 m) for inputs (u_k, u_k+1) of a straight one."""
    return sampled_with_derivatives(A, B, np.zeros((0, *A.shape)), np.zeros((0, *B.shape)), Ts, hold)[0]


def sampled_with_derivatives(
    A: np.ndarray, B: np.ndarray, dA: np.ndarray, dB: np.ndarray, Ts: float, hold: str = "zero"
) -> tuple[np.ndarray, np.ndarray]:
    """`sampled` and its derivatives (n, n + m or n + 2 m, q) for dA (q, n, n), dB (q, n, m)."""
    n, m = B.shape
    block = _augmented(A, B, Ts, hold)
    if hold == "first":
        block[n : n + m, n + m :] = np.eye(m)
    value, slope = exponential(block, _augmented(dA, dB, Ts, hold))
    return _inputs(value, n, m, hold), np.ascontiguousarray(np.moveaxis(_inputs(slope, n, m, hold), 0, -1))

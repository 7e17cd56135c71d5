r"""Sampling and simulation of linear models with exact derivatives by their parameters.

A continuous model is sampled by one augmented matrix exponential,

.. math:: \exp\begin{bmatrix} A T & B T\\ 0 & 0 \end{bmatrix} = \begin{bmatrix} F & G\\ 0 & I \end{bmatrix}

for inputs that are held; for inputs that run straight from sample to sample (measured pins) a further block gives

.. math:: x_{k+1} = F x_k + (\Gamma_1 - \Gamma_2) u_k + \Gamma_2 u_{k+1}

Scaling, Taylor series and squaring are differentiated term by term, for all parameters at once (Frechet derivative,
Al-Mohy and Higham 2009). Positions and velocities are first scaled alike, which keeps the squarings few.

The sampled model is simulated in one pass over the record.

.. math:: x_{k+1} = F x_k + G w_k,\; y_k = H x_k + E w_k, \qquad
          s^i_{k+1} = F s^i_k + F_i x_k + G_i w_k,\; \partial y_k/\partial\theta_i = H s^i_k + H_i x_k + E_i w_k

The derivatives F_i, G_i are those of the sampled matrices, so the sensitivities are exact for the sampled model. All
parameters of a state are neighbours in memory, which lets the loops over them vectorise. Each kernel stands in one file
with all that it calls, as numba's cache supposes.

Cites: almohy_2009, ljung_1999.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from scipy.linalg import expm

from rotorsim.base.cache import in_cache, kernels_in

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(**options: Any) -> Callable[[Function], Function]:
    """Decorator: numba's `njit`, with the machine code in the user's cache folder, where nobody else can write."""

    def compiled(function: Function) -> Function:
        with kernels_in(in_cache("identification"), numba.config):
            made: Function = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function)
        return made

    return compiled


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


FAST = {"contract", "reassoc"}
"""Reordering of sums; NaN and infinity keep their meaning."""


@kernel()
def respond(F: np.ndarray, G: np.ndarray, H: np.ndarray, E: np.ndarray, x0: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Outputs (n, p) of inputs w (n, m) from the state x0."""
    n, m, p = F.shape[0], w.shape[1], H.shape[0]
    x, following, y = x0.copy(), np.empty(n), np.empty((w.shape[0], p))
    for k in range(w.shape[0]):
        for r in range(p):
            value = 0.0
            for c in range(n):
                value += H[r, c] * x[c]
            for c in range(m):
                value += E[r, c] * w[k, c]
            y[k, r] = value
        for r in range(n):
            value = 0.0
            for c in range(n):
                value += F[r, c] * x[c]
            for c in range(m):
                value += G[r, c] * w[k, c]
            following[r] = value
        x, following = following, x
    return y


@kernel()
def _begin(x0: np.ndarray, w: np.ndarray) -> np.ndarray:
    """State and inputs in a row, (n + m,)."""
    z = np.empty(len(x0) + w.shape[1])
    z[: len(x0)] = x0
    return z


@kernel()
def _used(d: np.ndarray) -> np.ndarray:
    """Which elements (rows, columns) have a derivative by any parameter: the others cost nothing."""
    used = np.zeros(d.shape[:2], np.bool_)
    for r in range(d.shape[0]):
        for c in range(d.shape[1]):
            used[r, c] = np.any(d[r, c] != 0)
    return used


@numba.njit(forceinline=True, nogil=True, error_model="numpy", fastmath=FAST)
def _value(row: np.ndarray, through: np.ndarray, z: np.ndarray) -> float:
    """[row through] z."""
    value, n = 0.0, len(row)
    for c in range(n):
        value += row[c] * z[c]
    for c in range(len(through)):
        value += through[c] * z[n + c]
    return value


@numba.njit(forceinline=True, nogil=True, error_model="numpy", fastmath=FAST)
def _slope(row: np.ndarray, d: np.ndarray, used: np.ndarray, S: np.ndarray, z: np.ndarray, out: np.ndarray) -> None:
    """Write the derivatives (q,) of `_value` into `out`; S (n, q) are those of the state."""
    q = out.shape[0]
    out[:] = 0.0
    for c in range(len(row)):
        if row[c] != 0:
            for i in range(q):
                out[i] += row[c] * S[c, i]
    for c in range(len(z)):
        if used[c]:
            for i in range(q):
                out[i] += d[c, i] * z[c]


@numba.njit(forceinline=True, nogil=True, error_model="numpy", fastmath=FAST)
def _advance(
    F: np.ndarray,
    G: np.ndarray,
    dF: np.ndarray,
    used: np.ndarray,
    S: np.ndarray,
    T: np.ndarray,
    z: np.ndarray,
    x: np.ndarray,
) -> None:
    """Take the state in z one sample on; its derivatives follow in T, x (n,) is room."""
    n = F.shape[0]
    for r in range(n):
        x[r] = _value(F[r], G[r], z)
        _slope(F[r], dF[r], used[r], S, z, T[r])
    z[:n] = x


@kernel(fastmath=FAST)
def respond_with_sensitivities(
    F: np.ndarray,
    G: np.ndarray,
    H: np.ndarray,
    E: np.ndarray,
    dF: np.ndarray,
    dH: np.ndarray,
    x0: np.ndarray,
    dx0: np.ndarray,
    w: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Outputs (n, p) and their derivatives (n, p, q).

    dF (n, n + m, q) and dH (p, n + m, q) hold the derivatives of [F G] and [H E]; dx0 (n, q) that of the state x0.
    """
    n, p, q, samples = F.shape[0], H.shape[0], dx0.shape[1], w.shape[0]
    z, x, S, T = _begin(x0, w), np.empty(n), dx0.copy(), np.empty((n, q))
    y, J = np.empty((samples, p)), np.empty((samples, p, q))
    used_F, used_H = _used(dF), _used(dH)
    for k in range(samples):
        z[n:] = w[k]
        for r in range(p):
            y[k, r] = _value(H[r], E[r], z)
            _slope(H[r], dH[r], used_H[r], S, z, J[k, r])
        _advance(F, G, dF, used_F, S, T, z, x)
        S, T = T, S
    return y, J


@kernel(fastmath=FAST)
def normal_matrices(
    F: np.ndarray,
    G: np.ndarray,
    H: np.ndarray,
    E: np.ndarray,
    dF: np.ndarray,
    dH: np.ndarray,
    x0: np.ndarray,
    dx0: np.ndarray,
    w: np.ndarray,
    y: np.ndarray,
    Q: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """J'J (q, q), J'r (q,), Q'J (p, h, q), Q'r (p, h), r'r of r = y - y^ and J as in `respond_with_sensitivities`.

    Q (n, h) are regressors. Nothing of the record's length is stored.
    """
    n, p, q, samples, h = F.shape[0], H.shape[0], dx0.shape[1], w.shape[0], Q.shape[1]
    z, x, S, T, j = _begin(x0, w), np.empty(n), dx0.copy(), np.empty((n, q)), np.empty(q)
    N, g, QJ, Qr, cost = np.zeros((q, q)), np.zeros(q), np.zeros((p, h, q)), np.zeros((p, h)), 0.0
    used_F, used_H = _used(dF), _used(dH)
    for k in range(samples):
        z[n:] = w[k]
        for r in range(p):
            value = y[k, r] - _value(H[r], E[r], z)
            _slope(H[r], dH[r], used_H[r], S, z, j)
            cost += value * value
            for a in range(q):
                g[a] += j[a] * value
                for i in range(q):
                    N[a, i] += j[a] * j[i]
            for a in range(h):
                Qr[r, a] += Q[k, a] * value
                for i in range(q):
                    QJ[r, a, i] += Q[k, a] * j[i]
        _advance(F, G, dF, used_F, S, T, z, x)
        S, T = T, S
    return N, g, QJ, Qr, cost

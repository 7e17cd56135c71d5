r"""Responses of sampled linear models and their exact sensitivities, in one pass over the record.

.. math:: x_{k+1} = F x_k + G w_k,\; y_k = H x_k + E w_k, \qquad
          s^i_{k+1} = F s^i_k + F_i x_k + G_i w_k,\; \partial y_k/\partial\theta_i = H s^i_k + H_i x_k + E_i w_k

The derivatives F_i, G_i are those of the sampled matrices, so the sensitivities are exact for the sampled model. All
parameters of a state are neighbours in memory, which lets the loops over them vectorise.
"""

from __future__ import annotations

import numpy as np
from numba import njit

FAST = {"contract", "reassoc"}
"""Reordering of sums; NaN and infinity keep their meaning."""


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
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
    n, m, p, q, samples = F.shape[0], w.shape[1], H.shape[0], dx0.shape[1], w.shape[0]
    z, S, T = np.empty(n + m), dx0.copy(), np.empty((n, q))
    y, J = np.empty((samples, p)), np.empty((samples, p, q))
    used_F, used_H = np.zeros((n, n + m), np.bool_), np.zeros((p, n + m), np.bool_)
    for r in range(n):
        for c in range(n + m):
            used_F[r, c] = np.any(dF[r, c] != 0)
    for r in range(p):
        for c in range(n + m):
            used_H[r, c] = np.any(dH[r, c] != 0)
    z[:n] = x0
    x = x0.copy()
    for k in range(samples):
        z[:n] = x
        z[n:] = w[k]
        for r in range(p):
            value = 0.0
            for c in range(n):
                value += H[r, c] * z[c]
            for c in range(m):
                value += E[r, c] * z[n + c]
            y[k, r] = value
            for i in range(q):
                J[k, r, i] = 0.0
            for c in range(n):
                if H[r, c] != 0:
                    for i in range(q):
                        J[k, r, i] += H[r, c] * S[c, i]
            for c in range(n + m):
                if used_H[r, c]:
                    for i in range(q):
                        J[k, r, i] += dH[r, c, i] * z[c]
        for r in range(n):
            value = 0.0
            for c in range(n):
                value += F[r, c] * z[c]
            for c in range(m):
                value += G[r, c] * z[n + c]
            x[r] = value
            for i in range(q):
                T[r, i] = 0.0
            for c in range(n):
                if F[r, c] != 0:
                    for i in range(q):
                        T[r, i] += F[r, c] * S[c, i]
            for c in range(n + m):
                if used_F[r, c]:
                    for i in range(q):
                        T[r, i] += dF[r, c, i] * z[c]
        S, T = T, S
    return y, J


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
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
    n, m, p, q, samples, h = F.shape[0], w.shape[1], H.shape[0], dx0.shape[1], w.shape[0], Q.shape[1]
    z, x, S, T, j = np.empty(n + m), x0.copy(), dx0.copy(), np.empty((n, q)), np.empty(q)
    N, g, QJ, Qr, cost = np.zeros((q, q)), np.zeros(q), np.zeros((p, h, q)), np.zeros((p, h)), 0.0
    used_F, used_H = np.zeros((n, n + m), np.bool_), np.zeros((p, n + m), np.bool_)
    for r in range(n):
        for c in range(n + m):
            used_F[r, c] = np.any(dF[r, c] != 0)
    for r in range(p):
        for c in range(n + m):
            used_H[r, c] = np.any(dH[r, c] != 0)
    for k in range(samples):
        z[:n] = x
        z[n:] = w[k]
        for r in range(p):
            value = y[k, r]
            for c in range(n):
                value -= H[r, c] * z[c]
            for c in range(m):
                value -= E[r, c] * z[n + c]
            for i in range(q):
                j[i] = 0.0
            for c in range(n):
                if H[r, c] != 0:
                    for i in range(q):
                        j[i] += H[r, c] * S[c, i]
            for c in range(n + m):
                if used_H[r, c]:
                    for i in range(q):
                        j[i] += dH[r, c, i] * z[c]
            cost += value * value
            for a in range(q):
                g[a] += j[a] * value
                for i in range(q):
                    N[a, i] += j[a] * j[i]
            for a in range(h):
                Qr[r, a] += Q[k, a] * value
                for i in range(q):
                    QJ[r, a, i] += Q[k, a] * j[i]
        for r in range(n):
            value = 0.0
            for c in range(n):
                value += F[r, c] * z[c]
            for c in range(m):
                value += G[r, c] * z[n + c]
            x[r] = value
            for i in range(q):
                T[r, i] = 0.0
            for c in range(n):
                if F[r, c] != 0:
                    for i in range(q):
                        T[r, i] += F[r, c] * S[c, i]
            for c in range(n + m):
                if used_F[r, c]:
                    for i in range(q):
                        T[r, i] += dF[r, c, i] * z[c]
        S, T = T, S
    return N, g, QJ, Qr, cost

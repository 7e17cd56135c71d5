r"""LPV controller from the solution (X(q), Y, gamma), and the inequalities it must satisfy (thesis E.18, E.24).

With D_K = 0, M = I and N = I - X Y the two rows that hold B^ and C^ are stationary where

.. math:: \begin{bmatrix} 0 & D_{21} & 0\\ D_{21}^T & -\gamma I & D_{11}^T\\ 0 & D_{11} & -\gamma I\end{bmatrix}
          \begin{bmatrix} \hat B^T\\ *\\ * \end{bmatrix} = -\begin{bmatrix} C_2\\ B_1^T X\\ C_1 \end{bmatrix}, \quad
          \begin{bmatrix} 0 & D_{12}^T & 0\\ D_{12} & -\gamma I & D_{11}\\ 0 & D_{11}^T & -\gamma I\end{bmatrix}
          \begin{bmatrix} \hat C\\ *\\ * \end{bmatrix} = -\begin{bmatrix} B_2^T\\ C_1 Y\\ B_1^T \end{bmatrix}

and A^ cancels the (2, 1) block. Source: Gahinet (1996), explicit controller formulas for LMI-based synthesis.

Cites: gahinet_1996, thesis.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rotorsim.control.designs.lpv_problem import Solution
from rotorsim.control.designs.mixed import Generalised
from rotorsim.control.numerics.systems import System


class Hats(NamedTuple):
    """A^, B^, C^ of thesis eq. (E.18); D_K is zero."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray


def _t(M: np.ndarray) -> np.ndarray:
    return np.swapaxes(M, -1, -2)


def _like(M: np.ndarray, many: tuple[int, ...]) -> np.ndarray:
    """A constant matrix for each of many points."""
    return np.broadcast_to(M, (*many, *M.shape[-2:]))


def hats(P: Generalised, X: np.ndarray, Y: np.ndarray, gamma: float) -> Hats:
    """A^, B^, C^ at one operating point, or at many if the matrices of P and X are stacked (..., n, n)."""
    B = _t(_row(P.D21, P.D11, gamma, P.C2, _t(P.B1) @ X, P.C1))
    C = _row(_t(P.D12), _t(P.D11), gamma, _t(P.B2), P.C1 @ Y, _t(P.B1))
    low = np.concatenate([_t(X @ P.B1 + B @ P.D21), P.C1], axis=-2)
    right = np.concatenate([_t(P.B1), P.C1 @ Y + P.D12 @ C], axis=-2)
    nw, nz, many = P.B1.shape[-1], P.C1.shape[-2], P.A.shape[:-2]
    Delta = np.block(
        [[_like(gamma * np.eye(nw), many), -_t(P.D11)], [-P.D11, _like(gamma * np.eye(nz), many)]]
    )  # fmt: skip
    A = -(_t(P.A) + _t(low) @ np.linalg.solve(Delta, right))
    return Hats(A, B, C)


def _row(D: np.ndarray, D11: np.ndarray, gamma: float, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """First rows of the solution of one of the two systems."""
    k, m = D.shape[-2:]
    p, many = D11.shape[-2], D.shape[:-2]
    left = np.block(
        [
            [_like(np.zeros((k, k)), many), D, _like(np.zeros((k, p)), many)],
            [_t(D), _like(-gamma * np.eye(m), many), _t(D11)],
            [_like(np.zeros((p, k)), many), D11, _like(-gamma * np.eye(p), many)],
        ]
    )
    return np.asarray(-np.linalg.solve(left, np.concatenate([a, b, c], axis=-2))[..., :k, :])


def controller_at(P: Generalised, solution: Solution, point: np.ndarray) -> System:
    """The controller at a scaled operating point (thesis eq. E.24 without the rates)."""
    X, Y = solution.X_at(point), solution.Y
    hat = hats(P, X, Y, solution.gamma)
    N = np.eye(P.order) - X @ Y
    inner = hat.A - X @ P.A @ Y - hat.B @ P.C2 @ Y - X @ P.B2 @ hat.C
    K = np.linalg.solve(N, np.hstack([inner, hat.B]))
    n = P.order
    return System(K[:, :n], K[:, n:], hat.C, np.zeros((P.B2.shape[1], P.C2.shape[0])))


def inequalities(P: Generalised, solution: Solution, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """T1 > 0 and T2 < 0 (k, ., .) of thesis eq. (E.18), of the controller at scaled points (k, 2).

    The matrices of P are stacked over the points, (k, n, n) and so on.
    """
    X, Y, g = np.array([solution.X_at(q) for q in points]), solution.Y, solution.gamma
    hat = hats(P, X, Y, g)
    many, eye = P.A.shape[:-2], np.eye(P.A.shape[-1])
    T1 = np.block([[X, _like(eye, many)], [_like(eye, many), _like(Y, many)]])
    a, b = X @ P.A + hat.B @ P.C2, P.A @ Y + P.B2 @ hat.C
    c, d = _t(X @ P.B1 + hat.B @ P.D21), P.C1 @ Y + P.D12 @ hat.C
    nw, nz = P.B1.shape[-1], P.C1.shape[-2]
    cross = _t(hat.A) + P.A
    T2 = np.block(
        [
            [a + _t(a), _t(cross), _t(c), _t(P.C1)],
            [cross, b + _t(b), P.B1, _t(d)],
            [c, _t(P.B1), _like(-g * np.eye(nw), many), _t(P.D11)],
            [P.C1, d, P.D11, _like(-g * np.eye(nz), many)],
        ]
    )
    return T1, T2

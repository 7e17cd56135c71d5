r"""LMI problem of the LPV synthesis on a grid of operating points, with the controller variables eliminated.

.. math:: N_X^T \begin{bmatrix} A^T X + X A & X B_1 & C_1^T\\ \cdot & -\gamma I & D_{11}^T\\ \cdot & \cdot & -\gamma I
          \end{bmatrix} N_X \prec 0, \quad
          N_Y^T \begin{bmatrix} A Y + Y A^T & Y C_1^T & B_1\\ \cdot & -\gamma I & D_{11}\\ \cdot & \cdot & -\gamma I
          \end{bmatrix} N_Y \prec 0, \quad \begin{bmatrix} X & I\\ I & Y \end{bmatrix} \succeq 0

N_X spans what y does not see (C2, D21), N_Y what u does not move (B2, D12). X(q) is a polynomial in q, Y constant,
which makes the controller independent of q's rate; rates in X are neglected, as in the thesis. With the controller's
variables these inequalities are 30 x 30 and 1723 unknowns (thesis eq. E.18); eliminated, 546 for the same answer.
Source: Apkarian, Adams (1998); Gahinet, Apkarian (1994).

Cites: apkarian_1998, gahinet_1994, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from rotorsim.control.designs.mixed import Generalised
from rotorsim.control.numerics.lmi import Problem, symmetric_basis

EXPONENTS = ((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))
"""Basis functions of X over q scaled to [-1, 1] (thesis eq. E.8)."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Generalised plants at scaled points (k, 2) of [-1, 1]^2, in balanced states."""

    points: np.ndarray
    plants: tuple[Generalised, ...]


@dataclass(frozen=True, eq=False)
class Solution:
    """X (t, n, n) over the exponents, Y (n, n), gamma.

    eps is what the inequalities were kept away from zero by; X Y >= apart^2, which keeps I - X Y well conditioned.
    """

    X: np.ndarray
    Y: np.ndarray
    gamma: float
    exponents: tuple[tuple[int, int], ...]
    eps: float
    apart: float = 1.0

    def X_at(self, point: np.ndarray) -> np.ndarray:
        """X at a scaled operating point."""
        return np.asarray(np.tensordot(functions(self.exponents, point), self.X, 1))


def functions(exponents: tuple[tuple[int, int], ...], point: np.ndarray) -> np.ndarray:
    """Basis functions at a scaled point."""
    return np.array([point[0] ** i * point[1] ** j for i, j in exponents])


@dataclass(frozen=True, eq=False)
class Side:
    """One projected inequality: T'MR + R'MT - gamma W'W in the corner, E next to it, -gamma I below."""

    T: np.ndarray
    R: np.ndarray
    W: np.ndarray
    E: np.ndarray


def estimation_side(P: Generalised) -> Side:
    """The inequality of X."""
    N = null_space(np.hstack([P.C2, P.D21]))
    n = P.order
    return Side(N[:n], np.hstack([P.A, P.B1]) @ N, N[n:], N.T @ np.vstack([P.C1.T, P.D11.T]))


def feedback_side(P: Generalised) -> Side:
    """The inequality of Y."""
    N = null_space(np.hstack([P.B2.T, P.D12.T]))
    n = P.order
    return Side(N[:n], np.hstack([P.A.T, P.C1.T]) @ N, N[n:], N.T @ np.vstack([P.B1, P.D11]))


def matrix(side: Side, M: np.ndarray, gamma: float) -> np.ndarray:
    """The inequality's matrix, negative definite where it holds."""
    product = side.T.T @ M @ side.R
    corner = product + product.T - gamma * side.W.T @ side.W
    return np.block([[corner, side.E], [side.E.T, -gamma * np.eye(side.E.shape[1])]])


def _terms(side: Side, basis: np.ndarray) -> np.ndarray:
    """Coefficients (k, r + e, r + e) of M's entries in minus the inequality's matrix."""
    product = np.einsum("ar,kab,bs->krs", side.T, basis, side.R, optimize=True)
    r, e = side.T.shape[1], side.E.shape[1]
    full = np.zeros((len(basis), r + e, r + e))
    full[:, :r, :r] = -(product + product.transpose(0, 2, 1))
    return full


def _of_gamma(side: Side) -> np.ndarray:
    r, e = side.T.shape[1], side.E.shape[1]
    full = np.zeros((r + e, r + e))
    full[:r, :r], full[r:, r:] = side.W.T @ side.W, np.eye(e)
    return full


def _constant(side: Side) -> np.ndarray:
    r, e = side.T.shape[1], side.E.shape[1]
    full = np.zeros((r + e, r + e))
    full[:r, r:], full[r:, :r] = -side.E, -side.E.T
    return full


def _binds(gamma: float | None, bound: float, margin: float, feedback_only: bool) -> str:
    """Message about conflicting requirements of a problem without solution."""
    if feedback_only:
        limits = f"{1 / bound:.3g} I <= Y <= {bound:.3g} I"
        return f"lpv: no Y keeps its inequality (what references can reach) within {limits}; raise bound or lower eps"
    if gamma is None:
        return f"lpv: no X(q), Y below {bound:.3g} I keep X Y >= 1 and their inequalities; raise bound or lower eps"
    return (
        f"lpv: no X(q), Y below {bound:.3g} I keep their inequalities at gamma = {gamma:.4g} with margin {margin:g} in "
        "that of X (from y); raise backoff or bound, or lower margin"
    )


def synthesise(
    grid: Grid, exponents: tuple[tuple[int, int], ...] = EXPONENTS, gamma: float | None = None,
    eps: float = 1e-6, bound: float = 1e3, eps_X: float = 1e-6, feedback_only: bool = False,
) -> Solution:  # fmt: skip
    """Smallest gamma with the inequalities at least eps from zero; or, for a given gamma, X and Y furthest apart.

    Parameters
    ----------
    grid : plants over scaled operating points
    exponents : basis of X
    gamma : None to minimise it, else fixed
    eps, eps_X : margins of the inequalities of Y and of X, in the balanced states
    bound : X and Y stay below bound * I in the balanced states
    feedback_only : leave out every inequality of X; the gamma is then a lower bound, and the true one where y sees the
        disturbance through a square D21 and the plant is stable for some X(q)

    Raises
    ------
    DesignError
        If the solver has no solution.
    """
    n, t = grid.plants[0].order, 0 if feedback_only else len(exponents)
    basis = symmetric_basis(n)
    m = len(basis)
    at_Y, at_g = t * m, (t + 1) * m
    problem = Problem(at_g + 1)
    eye = np.eye(n)
    corner = np.zeros((m, 2 * n, 2 * n))
    lower = corner.copy()
    corner[:, :n, :n], lower[:, n:, n:] = basis, basis
    coupling = np.block([[np.zeros((n, n)), eye], [eye, np.zeros((n, n))]])
    for point, P in zip(grid.points, grid.plants, strict=True):
        f = functions(exponents, point)
        sides = [(at_Y, feedback_side(P), np.ones(1), eps)]
        if not feedback_only:
            sides.append((0, estimation_side(P), f, eps_X))
        for first, side, weights, away in sides:
            terms = _terms(side, basis)
            size = terms.shape[1]
            linear = [(first + i * m, w * terms) for i, w in enumerate(weights) if w]
            constant = _constant(side) - away * np.eye(size)
            if gamma is None:
                linear.append((at_g, _of_gamma(side)[None]))
            else:
                constant += gamma * _of_gamma(side)
            problem.add(constant, linear)
        if feedback_only:
            continue
        linear = [(i * m, w * corner) for i, w in enumerate(f) if w]
        linear.append((at_Y, lower))
        if gamma is None:
            problem.add(coupling, linear)
        else:
            problem.add(np.zeros_like(coupling), [*linear, (at_g, coupling[None])])
        problem.add(bound * eye, [(i * m, -w * basis) for i, w in enumerate(f) if w])
    problem.add(bound * eye, [(at_Y, -basis)])
    if feedback_only:
        problem.add(-eye / bound, [(at_Y, basis)])  # what X <= bound and T1 ask of Y
    cost = np.zeros(at_g + 1)
    cost[at_g] = 1.0 if gamma is None else -1.0
    x = problem.minimise(cost, _binds(gamma, bound, eps_X, feedback_only))
    X = np.tensordot(x[:at_Y].reshape(t, m), basis, 1) if t else np.zeros((0, n, n))
    Y = np.tensordot(x[at_Y:at_g], basis, 1)
    return Solution(
        X, Y, float(x[at_g]) if gamma is None else gamma, exponents, eps, 1.0 if gamma is None else float(x[at_g])
    )

r"""The H-infinity problem by two Riccati equations (Zhou, Doyle, Glover 1996, theorem 17.1), bisection on gamma.

After scaling u and z so that D12 = [0; I], and y and w so that D21 = [0 I], with D_{1*} = [D11 D12],
D_{*1} = [D11; D21]:

.. math:: R = D_{1*}^T D_{1*} - diag(\gamma^2 I, 0), \qquad \tilde R = D_{*1} D_{*1}^T - diag(\gamma^2 I, 0)

A controller with norm below gamma exists if both Riccati equations have stabilising solutions X, Y >= 0 whose product
has a spectral radius below gamma^2. Their solution is from the ordered Schur form of the Hamiltonian.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import schur

from rotorsim.control.errors import DesignError
from rotorsim.control.mixed import Generalised
from rotorsim.control.systems import System


class Scaled(NamedTuple):
    """Generalised plant with normal D12, D21, and the matrices that lead back: u = Su u', y' = Sy y."""

    P: Generalised
    Su: np.ndarray
    Sy: np.ndarray


def solve(P: Generalised, tolerance: float = 1e-7, highest: float = 1e4) -> float:
    """Smallest gamma [1] that a controller reaches; raises DesignError if none below `highest` does."""
    scaled = normalised(P)
    low, high = lower_bound(scaled.P), 1.0
    while central(scaled, high) is None:
        high *= 2
        if high > highest:
            raise DesignError(why_infeasible(scaled, highest))
    low = min(low, high)
    while high / low > 1 + tolerance:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if central(scaled, middle) is not None else (middle, high)
    return float(high)


def controller(P: Generalised, gamma: float) -> System:
    """The central controller for gamma; raises DesignError if there is none."""
    scaled = normalised(P)
    found = central(scaled, gamma)
    if found is None:
        raise DesignError(why_infeasible(scaled, gamma))
    return System(found.A, found.B @ scaled.Sy, scaled.Su @ found.C, scaled.Su @ found.D @ scaled.Sy)


def normalised(P: Generalised) -> Scaled:
    """The plant with D12 = [0; I] and D21 = [0 I]; raises DesignError where a rank is missing."""
    Q, Su = _columns_last(P.D12, "D12: some reference costs nothing at high frequency; give W_u a gain there")
    Qw, Sy = _columns_last(P.D21.T, "D21: some measurement has no disturbance; give it noise")
    Sy = Sy.T
    scaled = Generalised(
        P.A, P.B1 @ Qw, P.B2 @ Su, Q.T @ P.C1, Sy @ P.C2, Q.T @ P.D11 @ Qw, Q.T @ P.D12 @ Su, Sy @ P.D21 @ Qw
    )
    return Scaled(scaled, Su, Sy)


def _columns_last(D: np.ndarray, fault: str) -> tuple[np.ndarray, np.ndarray]:
    """Orthogonal Q and S with Q' D S = [0; I]."""
    m = D.shape[1]
    U, values, V = np.linalg.svd(D)
    if len(values) < m or values.min() < 1e-12 * max(values.max(), 1e-300):
        raise DesignError(f"h-infinity: rank of {fault}")
    Q = np.hstack([U[:, m:], U[:, :m]])
    return Q, V.T / values


def lower_bound(P: Generalised) -> float:
    """What D11 alone forces on gamma."""
    m2, p2 = P.B2.shape[1], P.C2.shape[0]
    top, left = P.D11[: P.D11.shape[0] - m2], P.D11[:, : P.D11.shape[1] - p2]
    norms = [np.linalg.norm(block, 2) for block in (top, left) if block.size]
    return max([1e-6, *map(float, norms)])


def central(scaled: Scaled, gamma: float) -> System | None:
    """Central controller of the scaled plant, or None where gamma is out of reach."""
    P = scaled.P
    if gamma <= lower_bound(P) * (1 + 1e-12):
        return None
    X, F = _state_side(P, gamma)
    Y, L = _state_side(dual(P), gamma)
    if X is None or Y is None:
        return None
    if np.abs(np.linalg.eigvals(X @ Y)).max(initial=0.0) >= gamma**2:
        return None
    return _assemble(P, gamma, X, Y, F, L.T)


def dual(P: Generalised) -> Generalised:
    """The transposed plant."""
    return Generalised(P.A.T, P.C1.T, P.C2.T, P.B1.T, P.B2.T, P.D11.T, P.D21.T, P.D12.T)


def _state_side(P: Generalised, gamma: float) -> tuple[np.ndarray | None, np.ndarray]:
    """X and F = -R^-1 (D1*' C1 + B' X) of one Riccati equation, None where it has no solution X >= 0."""
    B, D = np.hstack([P.B1, P.B2]), np.hstack([P.D11, P.D12])
    m1 = P.B1.shape[1]
    R = D.T @ D
    R[:m1, :m1] -= gamma**2 * np.eye(m1)
    try:
        inner = np.linalg.solve(R, np.hstack([D.T @ P.C1, B.T]))
    except np.linalg.LinAlgError:
        return None, np.zeros((B.shape[1], P.order))
    n = P.order
    G, S = inner[:, :n], inner[:, n:]
    A = P.A - B @ G
    Q = P.C1.T @ P.C1 - P.C1.T @ D @ G
    X = stabilising(A, B @ S, Q)
    return X, np.zeros((B.shape[1], n)) if X is None else -(G + S @ X)


def stabilising(A: np.ndarray, S: np.ndarray, Q: np.ndarray) -> np.ndarray | None:
    """X >= 0 with A'X + XA - X S X + Q = 0 and A - S X stable, or None."""
    n = len(A)
    H = np.block([[A, -S], [-Q, -A.T]])
    scale = np.abs(H).max()
    T, Z, count = schur(H, output="real", sort="lhp")
    values = np.linalg.eigvals(T)
    if count != n or np.abs(values.real).min() < 1e-11 * scale:
        return None
    try:
        X = np.linalg.solve(Z[:n, :n].T, Z[n:, :n].T).T
    except np.linalg.LinAlgError:
        return None
    X = (X + X.T) / 2
    if not np.all(np.isfinite(X)):
        return None
    values = np.linalg.eigvalsh(X)
    size = max(values[-1], 1e-6 * np.abs(A).max() / max(np.abs(S).max(), 1e-300))  # X = 0 up to rounding is a solution
    return X if values[0] >= -1e-8 * size else None


def _assemble(P: Generalised, gamma: float, X: np.ndarray, Y: np.ndarray, F: np.ndarray, L: np.ndarray) -> System:
    m1, m2 = P.B1.shape[1], P.B2.shape[1]
    p1, p2 = P.C1.shape[0], P.C2.shape[0]
    a, b = p1 - m2, m1 - p2
    D1111, D1112, D1121, D1122 = P.D11[:a, :b], P.D11[:a, b:], P.D11[a:, :b], P.D11[a:, b:]
    middle = np.linalg.solve(gamma**2 * np.eye(a) - D1111 @ D1111.T, D1112)
    DK = -D1121 @ D1111.T @ middle - D1122
    F12, F2 = F[b:m1], F[m1:]
    L12, L2 = L[:, a:p1], L[:, p1:]
    Z = np.linalg.inv(np.eye(P.order) - Y @ X / gamma**2)
    BK = Z @ (-L2 + (P.B2 + L12) @ DK)
    CK = F2 - DK @ (P.C2 + F12)
    AK = P.A + np.hstack([P.B1, P.B2]) @ F - BK @ (P.C2 + F12)
    return System(AK, BK, CK, DK)


def why_infeasible(scaled: Scaled, gamma: float) -> str:
    """Which condition of the theorem fails."""
    P = scaled.P
    bound = lower_bound(P)
    said = f"h-infinity: no controller reaches gamma = {gamma:.4g}: "
    if gamma <= bound:
        return said + f"the weights at infinite frequency alone ask for {bound:.4g}; lower W_p there"
    X, Y = _state_side(P, gamma)[0], _state_side(dual(P), gamma)[0]
    if X is None:
        return said + "the state-feedback Riccati equation (W_p against W_u) has no solution; lower W_p or W_u"
    if Y is None:
        return said + "the estimation Riccati equation has no solution; the disturbances are not seen well enough"
    return said + "both Riccati equations hold and only their coupling fails; relax W_p or W_u a little"

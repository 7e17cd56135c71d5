r"""Central H-infinity controller for a given gamma (Zhou, Doyle, Glover 1996, theorem 17.1).

After scaling u and z so that D12 = [0; I], and y and w so that D21 = [0 I], with D_{1*} = [D11 D12],
D_{*1} = [D11; D21]:

.. math:: R = D_{1*}^T D_{1*} - diag(\gamma^2 I, 0), \qquad \tilde R = D_{*1} D_{*1}^T - diag(\gamma^2 I, 0)

A controller with norm below gamma exists if both Riccati equations have stabilising solutions X, Y >= 0 whose product
has a spectral radius below gamma^2; this one then has it, and its loop is unstable otherwise. The signs of X and Y are
therefore not asked for here (where X = 0 they are rounding): `rotorsim.control.numerics.gamma` asks the loop.

Cites: benner_2001, zhou_1996.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import matrix_balance, schur

from rotorsim.base.rounding import EPS
from rotorsim.control.designs.mixed import Generalised
from rotorsim.control.errors import DesignError
from rotorsim.control.numerics.scaling import balanced
from rotorsim.control.numerics.systems import System


class Scaled(NamedTuple):
    """Plant with normal D12, D21 in balanced states and with z in a unit of its own; u = Su u', y' = Sy y."""

    P: Generalised
    Su: np.ndarray
    Sy: np.ndarray
    unit: float


def normalised(P: Generalised) -> Scaled:
    """The plant with D12 = [0; I] and D21 = [0 I]; raises DesignError where a rank is missing."""
    Q, Su = _columns_last(P.D12, "D12: some reference costs nothing at high frequency; give W_u a gain there")
    Qw, Sy = _columns_last(P.D21.T, "D21: some measurement has no disturbance; give it noise")
    Sy = Sy.T
    scaled = balanced(Generalised(
        P.A, P.B1 @ Qw, P.B2 @ Su, Q.T @ P.C1, Sy @ P.C2, Q.T @ P.D11 @ Qw, Q.T @ P.D12 @ Su, Sy @ P.D21 @ Qw
    ))  # fmt: skip
    unit = _unit(scaled)
    scaled = scaled._replace(C1=scaled.C1 / unit, D11=scaled.D11 / unit, B2=scaled.B2 * unit)
    return Scaled(balanced(scaled), Su * unit, Sy, unit)


def _unit(P: Generalised) -> float:
    """The unit of z in which w to z is as large as u to y: a power of two."""
    into, out = (float(np.linalg.norm(one)) / max(float(np.linalg.norm(two)), 1e-300)
                 for one, two in ((P.B1, P.B2), (P.C1, P.C2)))  # fmt: skip
    return float(2.0 ** np.round(np.log2(into * out) / 2)) if 0 < into * out < np.inf else 1.0


def _columns_last(D: np.ndarray, fault: str) -> tuple[np.ndarray, np.ndarray]:
    """Orthogonal Q and S with Q' D S = [0; I]; columns of D may differ in unit."""
    m = D.shape[1]
    units = np.linalg.norm(D, axis=0)
    units = 2.0 ** np.round(np.log2(np.where(units > 0, units, 1.0)))
    U, values, V = np.linalg.svd(D / units)
    if len(values) < m or values[-1] <= 1e-12 * values[0]:
        raise DesignError(f"h-infinity: rank of {fault}")
    return np.hstack([U[:, m:], U[:, :m]]), V.T / values / units[:, None]


def highest_frequency_bound(P: Generalised) -> float:
    """Lower bound on gamma from D11 alone, the plant at infinite frequency."""
    m2, p2 = P.B2.shape[1], P.C2.shape[0]
    top, left = P.D11[: P.D11.shape[0] - m2], P.D11[:, : P.D11.shape[1] - p2]
    return max((float(np.linalg.norm(block, 2)) for block in (top, left) if block.size), default=0.0)


def central(P: Generalised, gamma: float) -> System | None:
    """Central controller of a normalised plant; None where a Riccati equation has no stabilising solution."""
    if gamma <= highest_frequency_bound(P):
        return None
    state, output = state_side(P, gamma), state_side(dual(P), gamma)
    if state is None or output is None:
        return None
    try:
        K = _assemble(P, gamma, *state, output[0], output[1].T)
    except np.linalg.LinAlgError:
        return None
    return K if all(np.all(np.isfinite(M)) for M in K) else None


def dual(P: Generalised) -> Generalised:
    """The transposed plant."""
    return Generalised(P.A.T, P.C1.T, P.C2.T, P.B1.T, P.B2.T, P.D11.T, P.D21.T, P.D12.T)


def state_side(P: Generalised, gamma: float) -> tuple[np.ndarray, np.ndarray] | None:
    """X and F = -R^-1 (D1*' C1 + B' X) of one Riccati equation, None where it has no stabilising solution."""
    try:
        A, S, Q, G, inner = equation(P, gamma)
        X = stabilising(A, S, Q)
    except np.linalg.LinAlgError:
        return None
    return None if X is None else (X, -(G + inner @ X))


def equation(P: Generalised, gamma: float) -> tuple[np.ndarray, ...]:
    """A, S, Q of A'X + XA - X S X + Q = 0, and R^-1 D1*' C1, R^-1 B'."""
    B, D = np.hstack([P.B1, P.B2]), np.hstack([P.D11, P.D12])
    m1, n = P.B1.shape[1], P.order
    R = D.T @ D
    R[:m1, :m1] -= gamma**2 * np.eye(m1)
    inner = np.linalg.solve(R, np.hstack([D.T @ P.C1, B.T]))
    G, S = inner[:, :n], inner[:, n:]
    return P.A - B @ G, B @ S, P.C1.T @ P.C1 - P.C1.T @ D @ G, G, S


def hamiltonian(A: np.ndarray, S: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The Hamiltonian balanced by states x_i / t_i and costates x_i t_i, and t (n,) (Benner 2001)."""
    n = len(A)
    H = np.block([[A, -S], [-Q, -A.T]])
    _, (scale, _) = matrix_balance(H, permute=False, separate=True)
    t = 2.0 ** np.round((np.log2(scale[:n]) - np.log2(scale[n:])) / 2)
    both = np.concatenate([t, 1 / t])
    return H * both / both[:, None], t


def stabilising(A: np.ndarray, S: np.ndarray, Q: np.ndarray) -> np.ndarray | None:
    """X with A'X + XA - X S X + Q = 0 and A - S X stable from the ordered Schur form, or None."""
    n = len(A)
    H, t = hamiltonian(A, S, Q)
    _, Z, count = schur(H, output="real", sort="lhp")
    fold = Z[:n, :n].T @ Z[n:, :n]
    if count != n or np.abs(fold - fold.T).max() > np.sqrt(EPS):  # X is symmetric, or the axis split a pair
        return None
    X = np.linalg.solve(Z[:n, :n].T, Z[n:, :n].T) / t / t[:, None]
    return (X + X.T) / 2


def _assemble(P: Generalised, gamma: float, X: np.ndarray, F: np.ndarray, Y: np.ndarray, L: np.ndarray) -> System:
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

r"""State-space arithmetic: connections, discretisation, frequency response, norms, Riccati equation.

.. math:: \dot x = A x + B u, \quad y = C x + D u

Everything is a `System` of plain arrays; whether it is continuous or sampled is the caller's to know.

The stabilising solution of the discrete Riccati equation is accepted only if its closed loop decays:

.. math:: P = A^T P A - A^T P B (R + B^T P B)^{-1} B^T P A + Q

A state feedback with a current Luenberger observer is one discrete controller:

.. math:: \hat x_{k|k} = \hat x_k + L (y_k - C \hat x_k), \quad u_k = -F \hat x_{k|k}, \quad
          \hat x_{k+1} = A \hat x_{k|k} + B u_k

The plant's input register (its sample of delay) is part of x, so u_k acts on time in the observer.

Cites: astrom_1997, bruinsma_1990, zhou_1996.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import matrix_balance, solve_continuous_lyapunov, solve_discrete_are

from identification.local.simulation import zero_order_hold
from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import decays, unstable_poles


class System(NamedTuple):
    """A (n, n), B (n, m), C (p, n), D (p, m)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)


def block_diag(*matrices: np.ndarray) -> np.ndarray:
    """Block-diagonal matrix (scipy's takes ten times as long on small ones)."""
    sizes = np.array([M.shape for M in matrices])
    whole = np.zeros(sizes.sum(axis=0))
    i = j = 0
    for M in matrices:
        whole[i : i + M.shape[0], j : j + M.shape[1]] = M
        i, j = i + M.shape[0], j + M.shape[1]
    return whole


def gain(D: ArrayLike) -> System:
    """A system without states."""
    D = np.atleast_2d(np.asarray(D, float))
    return System(np.zeros((0, 0)), np.zeros((0, D.shape[1])), np.zeros((D.shape[0], 0)), D)


def series(first: System, second: System) -> System:
    """second * first: the output of `first` drives `second`."""
    A = np.block([[first.A, np.zeros((first.order, second.order))], [second.B @ first.C, second.A]])
    B = np.vstack([first.B, second.B @ first.D])
    return System(A, B, np.hstack([second.D @ first.C, second.C]), second.D @ first.D)


def side_by_side(*systems: System) -> System:
    """Block diagonal: each system has its own inputs and outputs."""
    return System(*(block_diag(*(getattr(s, name) for s in systems)) for name in "ABCD"))


def added(one: System, other: System, factor: float = 1.0) -> System:
    """one + factor * other."""
    A = block_diag(one.A, other.A)
    return System(A, np.vstack([one.B, other.B]), np.hstack([one.C, factor * other.C]), one.D + factor * other.D)


def feedback(forward: System, back: System) -> System:
    """forward (I - back forward)^-1: the output of `back` is added to the input; raises LinAlgError if ill-posed."""
    loop = np.linalg.inv(np.eye(forward.D.shape[1]) - back.D @ forward.D)
    mixed = np.hstack([back.D @ forward.C, back.C])
    left = np.block([[forward.A, np.zeros((forward.order, back.order))], [back.B @ forward.C, back.A]])
    into = np.vstack([forward.B, back.B @ forward.D])
    A = left + into @ loop @ mixed
    own = np.hstack([forward.C, np.zeros((forward.C.shape[0], back.order))])
    return System(A, into @ loop, own + forward.D @ loop @ mixed, forward.D @ loop)


def observer_law(plant: System, F: np.ndarray, L: np.ndarray) -> System:
    """The law from y to u of gains F (2, n) and L (n, 2) about a sampled plant."""
    inner = np.eye(plant.order) - L @ plant.C
    closed = plant.A - plant.B @ F
    return System(closed @ inner, closed @ L, -F @ inner, -F @ L)


def transformed(system: System, scale: np.ndarray) -> System:
    """States x_i scale_i in place of x_i."""
    return System(system.A * scale[:, None] / scale, system.B * scale[:, None], system.C / scale, system.D)


def tustin(system: System, Ts: float) -> System:
    r"""The trapezoidal rule with states scaled by sqrt(Ts), as thesis eq. (3.11).

    .. math:: \Phi = (I - \tfrac{T_s}{2} A)^{-1}: \quad A_d = \Phi (I + \tfrac{T_s}{2} A),\; B_d = \sqrt{T_s} \Phi B,\;
              C_d = \sqrt{T_s} C \Phi,\; D_d = \tfrac{T_s}{2} C \Phi B + D
    """
    eye = np.eye(system.order)
    Phi = np.linalg.inv(eye - Ts / 2 * system.A)
    root = np.sqrt(Ts)
    return System(
        Phi @ (eye + Ts / 2 * system.A), root * Phi @ system.B, root * system.C @ Phi,
        Ts / 2 * system.C @ Phi @ system.B + system.D,
    )  # fmt: skip


def held(system: System, Ts: float) -> System:
    """The system behind a zero-order hold."""
    return System(*zero_order_hold(system.A, system.B, Ts), system.C, system.D)


def late(system: System) -> System:
    """A sampled system whose input arrives one sample later."""
    n, m = system.B.shape
    A = np.block([[system.A, system.B], [np.zeros((m, n + m))]])
    B = np.vstack([np.zeros((n, m)), np.eye(m)])
    return System(A, B, np.hstack([system.C, system.D]), np.zeros_like(system.D))


def response(system: System, points: np.ndarray) -> np.ndarray:
    """Transfer matrices (f, p, m) at complex points s, or z of a sampled system."""
    points = np.atleast_1d(points)
    if not system.order:
        return np.broadcast_to(system.D.astype(complex), (len(points), *system.D.shape)).copy()
    left = points[:, None, None] * np.eye(system.order) - system.A
    return system.C @ np.linalg.solve(left, np.broadcast_to(system.B, (len(points), *system.B.shape))) + system.D


def gramians(system: System) -> tuple[np.ndarray, np.ndarray]:
    """Controllability and observability Gramian of a stable continuous system."""
    Wc = solve_continuous_lyapunov(system.A, -system.B @ system.B.T)
    Wo = solve_continuous_lyapunov(system.A.T, -system.C.T @ system.C)
    return (Wc + Wc.T) / 2, (Wo + Wo.T) / 2


def stable(system: System) -> bool:
    """Whether every pole of a continuous system decays, by more than rounding."""
    return unstable_poles(system.A) == 0


def peak_gain(system: System, tolerance: float = 1e-6) -> float:
    """H-infinity norm of a continuous system, infinite if it is unstable (Bruinsma and Steinbuch 1990).

    The level at which no frequency answers more is found from below. Every eigenvalue of the level's Hamiltonian offers
    its frequency: which of them are imaginary is not asked.
    """
    if not stable(system):
        return float("inf")
    system = balanced_states(system)
    poles = np.linalg.eigvals(system.A)
    best = max(float(np.linalg.norm(system.D, 2)), gain_at(system, np.append(np.abs(poles), 0.0)))
    level = best * (1 + tolerance)
    while best > 0 and (best := gain_at(system, level_frequencies(system, level))) > level:
        level = best * (1 + tolerance)
    return level


def balanced_states(system: System) -> System:
    """The system in states scaled by powers of two that balance A."""
    _, (scale, _) = matrix_balance(system.A, permute=False, separate=True)
    return transformed(system, 1 / scale)


def normal(system: System, rounds: int = 6) -> System:
    """The system in balanced states with B and C in units in which they are as large as A: free of all units."""
    for _ in range(rounds):
        A, B, C, D = system
        size = max(float(np.linalg.norm(A)), 1e-300)
        B, C = (M * size / max(float(np.linalg.norm(M)), 1e-300) for M in (B, C))
        whole = np.block([[A, B], [C, np.zeros((C.shape[0], B.shape[1]))]])
        system = transformed(System(A, B, C, D), equalising(np.abs(whole), len(A)))
    return system


def equalising(size: np.ndarray, n: int) -> np.ndarray:
    """The diagonal scaling (n,) that equalises rows and columns of the n states in sizes of [A B; C 0], overwritten."""
    scale = np.ones(n)
    for _ in range(100):
        for i in range(n):
            row, column = size[i].sum() - size[i, i], size[:, i].sum() - size[i, i]
            if row > 0 and column > 0:
                factor = np.sqrt(column / row)
                size[i] *= factor
                size[:, i] /= factor
                scale[i] *= factor
    return scale


def gain_at(system: System, frequencies: np.ndarray) -> float:
    """Largest gain at the frequencies (f,)."""
    return float(largest(response(system, 1j * frequencies)).max(initial=0.0))


def largest(matrices: np.ndarray) -> np.ndarray:
    """Largest singular value of each matrix (..., p, m)."""
    return np.asarray(np.linalg.svd(matrices, compute_uv=False)[..., 0])


def level_frequencies(system: System, level: float) -> np.ndarray:
    """Frequencies at which a singular value may equal `level`, which exceeds that of D, and those half way between."""
    A, B, C, D = system
    R = level**2 * np.eye(B.shape[1]) - D.T @ D
    inner = np.linalg.solve(R, np.hstack([D.T @ C, B.T]))
    n = len(A)
    F, G = inner[:, :n], inner[:, n:]
    Acl = A + B @ F
    return with_middles(np.linalg.eigvals(np.block([[Acl, B @ G], [-C.T @ (C + D @ F), -Acl.T]])))


def with_middles(values: np.ndarray) -> np.ndarray:
    """Frequencies of complex eigenvalues, ascending from zero, each once, and those half way between."""
    at = np.unique(np.abs(np.append(values.imag, 0.0)))
    return np.sort(np.concatenate([at, (at[1:] + at[:-1]) / 2]))


def sampled_riccati(A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, fault: str) -> np.ndarray:
    """P (n, n); raises DesignError with the sentence `fault` where there is none or rounding hides it."""
    try:
        P = solve_discrete_are(A, B, Q, R)
        poles = np.linalg.eigvals(A - B @ np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(fault) from error
    if not decays(poles):
        raise DesignError(fault)
    return np.asarray(P)

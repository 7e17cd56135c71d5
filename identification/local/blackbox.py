r"""Black-box state-space models: subspace start (PO-MOESP) and output-error refinement.

Of the rows of block Hankel matrices of future inputs, past inputs and outputs, and future outputs, the triangular
factor's block (future outputs, past) spans the observability matrix; A and C follow from its shift, B from linear least
squares on the simulation. Source: Verhaegen and Verdult, Filtering and System Identification (2007), section 9.5. The
thesis' ssest refines by prediction unless set otherwise, as `method="pem"` does. D = 0: a reference acts on the next
sample at the earliest.

Cites: verhaegen_2007.
"""

from dataclasses import dataclass

import numpy as np

from identification.local.least_squares import Sampled
from identification.local.simulation import respond_with_sensitivities
from rotorsim.base.errors import UnfitError

ROWS = 25
"""Block rows of the Hankel matrices."""
ORDERS = (1, 20)


@dataclass(frozen=True)
class FullStateSpace:
    """Every element of A, B, C is a parameter, by rows; D is zero. Redundant by n^2 changes of basis."""

    n: int
    m: int
    p: int

    def pack(self, A: np.ndarray, B: np.ndarray, C: np.ndarray) -> np.ndarray:
        """Parameters of matrices."""
        return np.concatenate([A.ravel(), B.ravel(), C.ravel()])

    def sampled(self, theta: np.ndarray) -> Sampled:
        """A, B, C and D = 0."""
        n, m, p = self.n, self.m, self.p
        A, B, C = np.split(theta, [n * n, n * (n + m)])
        return A.reshape(n, n).copy(), B.reshape(n, m).copy(), C.reshape(p, n).copy(), np.zeros((p, m))

    def derivatives(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives: a one at the place of each parameter."""
        n, m, p = self.n, self.m, self.p
        dF, dH = np.zeros((n, n + m, len(theta))), np.zeros((p, n + m, len(theta)))
        i = np.arange(n * n)
        dF[i // n, i % n, i] = 1
        i = np.arange(n * m)
        dF[i // m, n + i % m, n * n + i] = 1
        i = np.arange(p * n)
        dH[i // n, i % n, n * (n + m) + i] = 1
        return dF, dH

    def admissible(self, theta: np.ndarray) -> bool:
        """Whether the parameters are finite."""
        return bool(np.all(np.isfinite(theta)))

    def directions(self, theta: np.ndarray) -> np.ndarray:
        """Complement of changes of basis (I + E): dA = A E - E A, dB = -E B, dC = C E (McKelvey, Helmersson and
        Ribarits 2004, data driven local coordinates)."""
        A, B, C, _ = self.sampled(theta)
        eye = np.eye(self.n)
        turns = np.vstack([
            np.kron(A, eye) - np.kron(eye, A.T), -np.kron(eye, B.T), np.kron(C, eye)
        ])  # fmt: skip
        left = np.linalg.qr(turns, mode="complete")[0]
        return np.ascontiguousarray(left[:, self.n**2 :])

    def share(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Share of a step that is taken: all of it."""
        return 1.0


def subspace(u: np.ndarray, y: np.ndarray, order: int, rows: int = ROWS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (n, n), B (n, m), C (p, n) of the sampled model from inputs u (k, m) and outputs y (k, p).

    Raises UnfitError if the order is not possible or the record too short for it.
    """
    p = y.shape[1]
    if not ORDERS[0] <= order <= min(ORDERS[1], p * (rows - 1)):
        raise UnfitError(f"blackbox: order {order}; choose one between {ORDERS[0]} and {ORDERS[1]}")
    return realised(*observable(u, y, rows), order, u, y)


def observable(u: np.ndarray, y: np.ndarray, rows: int = ROWS) -> tuple[np.ndarray, np.ndarray]:
    """Directions (rows p, rows p) of the observability matrix and their singular values, descending.

    Raises UnfitError if the record is too short.
    """
    m, p = u.shape[1], y.shape[1]
    k = len(u) - 2 * rows + 1
    if k < 4 * rows * (m + p):
        raise UnfitError(
            f"blackbox: {len(u)} samples; {2 * rows + 4 * rows * (m + p)} or more are needed, record longer"
        )
    past, future = slice(0, rows), slice(rows, 2 * rows)
    U, Y = (np.stack([v[i : i + k].T for i in range(2 * rows)]) for v in (u / np.std(u), y / np.std(y)))
    Z = np.vstack([U[future].reshape(-1, k), U[past].reshape(-1, k), Y[past].reshape(-1, k), Y[future].reshape(-1, k)])
    R = np.asarray(np.linalg.qr(Z.T, mode="r")).T
    first, second = rows * m, rows * (2 * m + p)
    left, values, _ = np.linalg.svd(R[second:, first:second], full_matrices=False)
    return left, values


def realised(
    left: np.ndarray, values: np.ndarray, order: int, u: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C of the first directions of `observable`; A and C by their shift, B by simulation."""
    p = y.shape[1]
    seen = left[:, :order] * np.sqrt(values[:order])
    A = stable(np.linalg.lstsq(seen[:-p], seen[p:], rcond=None)[0])
    C = seen[:p] * np.std(y)
    return A, _inputs(A, C, u, y), C


def _inputs(A: np.ndarray, C: np.ndarray, u: np.ndarray, y: np.ndarray) -> np.ndarray:
    """B (n, m) that simulates best."""
    n, m = len(A), u.shape[1]
    model = FullStateSpace(n, m, len(C))
    theta = model.pack(A, np.zeros((n, m)), C)
    F, G, H, E = model.sampled(theta)
    dF, dH = model.derivatives(theta)
    by_B = slice(n * n, n * (n + m))
    zero = np.zeros((n, n * m))
    dF, dH = (np.ascontiguousarray(d[..., by_B]) for d in (dF, dH))
    _, J = respond_with_sensitivities(F, G, H, E, dF, dH, np.zeros(n), zero, u)
    return np.linalg.lstsq(J.reshape(-1, n * m), y.ravel(), rcond=None)[0].reshape(n, m)


def stable(A: np.ndarray, most: float = 0.9995) -> np.ndarray:
    """A with eigenvalues outside the unit circle mirrored into it."""
    values, vectors = np.linalg.eig(A)
    size = np.abs(values)
    if np.all(size < most):
        return A
    values = np.where(size >= most, values / np.maximum(size, 1e-300) * np.minimum(1 / size, most), values)
    return np.asarray((vectors @ np.diag(values) @ np.linalg.inv(vectors)).real)


def balanced(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same stable sampled model in its balanced basis."""
    from scipy.linalg import solve_discrete_lyapunov

    P, Q = solve_discrete_lyapunov(A, B @ B.T), solve_discrete_lyapunov(A.T, C.T @ C)
    Lp, Lq = (_root((M + M.T) / 2) for M in (P, Q))
    U, s, Vt = np.linalg.svd(Lq.T @ Lp)
    s = np.maximum(s, 1e-12 * s[0])
    T = Lp @ Vt.T / np.sqrt(s)
    inverse = (U / np.sqrt(s)).T @ Lq.T
    return inverse @ A @ T, inverse @ B, C @ T


def _root(M: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(M)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 1e-14 * values.max())))

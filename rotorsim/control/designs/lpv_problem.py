r"""LMI problem of the LPV synthesis on a grid of operating points, with the controller variables eliminated.

.. math:: N_X^T \begin{bmatrix} \dot X + A^T X + X A & X B_1 & C_1^T\\ \cdot & -\gamma I & D_{11}^T\\
          \cdot & \cdot & -\gamma I \end{bmatrix} N_X \prec 0, \quad
          N_Y^T \begin{bmatrix} -\dot Y + A Y + Y A^T & Y C_1^T & B_1\\ \cdot & -\gamma I & D_{11}\\
          \cdot & \cdot & -\gamma I \end{bmatrix} N_Y \prec 0, \quad
          \begin{bmatrix} X & I\\ I & Y \end{bmatrix} \succeq 0

N_X spans what y does not see (C2, D21), N_Y what u does not move (B2, D12). X(q), Y(q) are polynomials in q; the
inequalities hold at the corners of the box of q's rates. With the controller's variables they are 30 x 30 and 1723
unknowns (thesis eq. E.18, where Y is constant and rates are neglected).
Source: Apkarian, Adams (1998); Gahinet, Apkarian (1994).

Cites: apkarian_1998, gahinet_1994, thesis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import null_space

from rotorsim.base.display import Report, silent
from rotorsim.control.designs.lmi import Inequality, minimise, symmetric_basis
from rotorsim.control.designs.lpv_controller import (
    Exponents,
    Polynomial,
    Solution,
    corners,
    derivatives,
    exponents,
    functions,
)
from rotorsim.control.designs.weighted_plant import Generalised

GAMMA_SLACK, TOLERANCE = 3e-3, 2e-3
"""Tolerance of the smallest gamma as a share of it, and of the inequalities by their eigenvalues."""
MARGIN_X, MARGIN_Y = 0.3, 0.01
"""Distances from zero that the inequalities of X and of Y keep per unit of `inside`; X Y >= (1 + inside)^2."""
KEPT = 0.5
"""Share of the margins that every grid point keeps."""


@dataclass(frozen=True, eq=False)
class SynthesisGrid:
    """Generalised plants at scaled points (k, 2) of [-1, 1]^2, in balanced states; largest rates (2,) [1/ms]."""

    points: np.ndarray
    plants: tuple[Generalised, ...]
    rates: np.ndarray = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True, eq=False)
class Side:
    """One projected inequality: T'MR + R'MT - gamma W'W in the corner, E next to it, -gamma I below; M' adds T'M'T."""

    T: np.ndarray
    R: np.ndarray
    W: np.ndarray
    E: np.ndarray

    def placed(self, corner: np.ndarray) -> np.ndarray:
        """Matrices (..., r, r) in the corner of (..., r + e, r + e)."""
        e = self.E.shape[1]
        return np.pad(corner, [(0, 0)] * (corner.ndim - 2) + [(0, e), (0, e)])

    def terms(self, basis: np.ndarray) -> np.ndarray:
        """Coefficients (k, r + e, r + e) of M's entries in minus the inequality's matrix."""
        product = np.einsum("ar,kab,bs->krs", self.T, basis, self.R, optimize=True)
        return -self.placed(product + product.transpose(0, 2, 1))

    def rate_terms(self, basis: np.ndarray) -> np.ndarray:
        """Coefficients (k, r + e, r + e) of the entries of M's time derivative, T'M'T."""
        return self.placed(np.einsum("ar,kab,bs->krs", self.T, basis, self.T, optimize=True))

    @property
    def of_gamma(self) -> np.ndarray:
        """Coefficient of gamma in minus the inequality's matrix."""
        made = self.placed(self.W.T @ self.W)
        r = self.T.shape[1]
        made[r:, r:] = np.eye(self.E.shape[1])
        return made

    @property
    def constant(self) -> np.ndarray:
        """The rest of minus the inequality's matrix."""
        r, e = self.E.shape
        return np.block([[np.zeros((r, r)), -self.E], [-self.E.T, np.zeros((e, e))]])


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


@dataclass(frozen=True)
class Sought:
    """Solution that is sought: orders of X(q) and Y(q), margin of their inequalities, bound on X and Y.

    eps : distance from zero that the inequalities keep, in the balanced states
    bound : X and Y stay below bound * I in the balanced states
    feedback_only : leave out every inequality of X; the gamma is then a lower bound, and the true one where y sees the
        disturbance through a square D21 and the plant is stable for some X(q)
    """

    order_X: int = 1
    order_Y: int = 2
    eps: float = 1e-6
    bound: float = 1e3
    feedback_only: bool = False


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Places of the unknowns: entries of X's and of Y's coefficients, then gamma, or how far inside they are."""

    powers_X: Exponents
    powers_Y: Exponents
    basis: np.ndarray

    @property
    def first_Y(self) -> int:
        """Place of Y's first entry."""
        return len(self.powers_X) * len(self.basis)

    @property
    def last(self) -> int:
        """Place of gamma or of the margin."""
        return self.first_Y + len(self.powers_Y) * len(self.basis)

    def of_X(self, weights: np.ndarray, matrices: np.ndarray) -> list[tuple[int, float, np.ndarray]]:
        """Terms of sum of weights * X_k, with the matrices of each entry."""
        return self._of(0, weights, matrices)

    def of_Y(self, weights: np.ndarray, matrices: np.ndarray) -> list[tuple[int, float, np.ndarray]]:
        """Terms of sum of weights * Y_k."""
        return self._of(self.first_Y, weights, matrices)

    def _of(self, first: int, weights: np.ndarray, matrices: np.ndarray) -> list[tuple[int, float, np.ndarray]]:
        m = len(self.basis)
        return [(first + k * m, float(w), matrices) for k, w in enumerate(weights) if w]

    def solution(self, x: np.ndarray, gamma: float | None, rates: np.ndarray) -> Solution:
        """The solution of a vector of unknowns."""
        m = len(self.basis)
        X = np.tensordot(x[: self.first_Y].reshape(-1, m), self.basis, 1)
        Y = np.tensordot(x[self.first_Y : self.last].reshape(-1, m), self.basis, 1)
        last = float(x[self.last])
        return Solution(
            Polynomial(self.powers_X, X), Polynomial(self.powers_Y, Y),
            last if gamma is None else gamma, rates, 0.0 if gamma is None else last,
        )  # fmt: skip


def synthesise(grid: SynthesisGrid, sought: Sought, gamma: float | None = None, progress: Report = silent) -> Solution:
    """Smallest gamma with which the inequalities hold; or, for a given gamma, X(q) and Y(q) furthest inside them.

    Raises
    ------
    DesignError
        If the solver has no solution.
    """
    moves = tuple(np.ptp(grid.points, axis=0) > 0)
    powers_X = () if sought.feedback_only else exponents(sought.order_X, moves)
    unknowns = Unknowns(powers_X, exponents(sought.order_Y, moves), symmetric_basis(grid.plants[0].order))
    every = list(inequalities_of(grid, sought, unknowns, gamma))
    cost = np.zeros(unknowns.last + 1)
    cost[-1] = 1.0 if gamma is None else -1.0
    slack, tolerance = (GAMMA_SLACK, TOLERANCE) if gamma is None else (KEPT - 1, 0.0)
    step = "smallest gamma" if gamma is None else f"most margin at gamma {gamma:.4g}"
    x = minimise(
        cost, every, first_imposed(grid, every), fault(sought, gamma), slack, tolerance,
        lambda counts: progress(f"{step}: {counts}"),
    )  # fmt: skip
    return unknowns.solution(x, gamma, grid.rates)


def first_imposed(grid: SynthesisGrid, every: list[Inequality]) -> list[int]:
    """Those at up to nine points spread over the grid, each at two opposite corners of the rates."""
    targets = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)])
    spread = {int(np.argmin(np.linalg.norm(grid.points - target, axis=1))) for target in targets}
    own: dict[tuple[str, int], list[int]] = {}
    for k, one in enumerate(every):
        if one.place in spread:
            own.setdefault((one.kind, one.place), []).append(k)
    return sorted({k for group in own.values() for k in (group[0], group[-1])})


def inequalities_of(
    grid: SynthesisGrid, sought: Sought, unknowns: Unknowns, gamma: float | None
) -> Iterator[Inequality]:
    """All inequalities at all points and corners of the rates."""
    for place, (point, P) in enumerate(zip(grid.points, grid.plants, strict=True)):
        yield from _side(grid, sought, unknowns, gamma, place, feedback_side(P), +1)
        if not sought.feedback_only:
            yield from _side(grid, sought, unknowns, gamma, place, estimation_side(P), -1)
        yield from _limits(sought, unknowns, gamma, place, point)


def _side(
    grid: SynthesisGrid, sought: Sought, unknowns: Unknowns, gamma: float | None, place: int, side: Side, sign: int
) -> Iterator[Inequality]:
    """The inequality of Y (sign +1) or of X (sign -1) at a point, at the corners of the rates."""
    point, of_Y = grid.points[place], sign > 0
    powers, terms_of = (unknowns.powers_Y, unknowns.of_Y) if of_Y else (unknowns.powers_X, unknowns.of_X)
    still, moving = side.terms(unknowns.basis), side.rate_terms(unknowns.basis)
    constant, common = side.constant, terms_of(functions(powers, point), still)
    if gamma is None:
        common.append((unknowns.last, 1.0, side.of_gamma[None]))
    else:
        constant = constant + gamma * side.of_gamma
        common.append((unknowns.last, -MARGIN_Y if of_Y else -MARGIN_X, np.eye(len(constant))[None]))
    for rate in corners(grid.rates) if len(powers) > 1 else np.zeros((1, 2)):
        terms = common + terms_of(sign * derivatives(powers, point, rate), moving)
        yield Inequality("Y" if of_Y else "X", place, constant, terms, sought.eps)


def _limits(
    sought: Sought, unknowns: Unknowns, gamma: float | None, place: int, point: np.ndarray
) -> Iterator[Inequality]:
    """X, Y below their bound, and [X I; I Y] >= 0; for Y alone what X's bound asks of it."""
    basis, bound = unknowns.basis, sought.bound
    n, eye = basis.shape[1], np.eye(basis.shape[1])
    X, Y = functions(unknowns.powers_X, point) if unknowns.powers_X else None, functions(unknowns.powers_Y, point)
    yield Inequality("Y below", place, bound * eye, unknowns.of_Y(-Y, basis), 0.01 * bound)
    if X is None:
        yield Inequality("Y above", place, -eye / bound, unknowns.of_Y(Y, basis), 0.1 / bound)
        return
    yield Inequality("X below", place, bound * eye, unknowns.of_X(-X, basis), 0.01 * bound)
    coupling = np.kron([[0, 1], [1, 0]], eye)
    upper, lower = (np.pad(basis, [(0, 0), (a, n - a), (a, n - a)]) for a in (0, n))
    terms = unknowns.of_X(X, upper) + unknowns.of_Y(Y, lower)
    if gamma is not None:
        terms.append((unknowns.last, 1.0, coupling[None]))
    yield Inequality("coupling", place, coupling, terms, 0.1 / bound)


def fault(sought: Sought, gamma: float | None) -> str:
    """Message about conflicting requirements of a problem without solution."""
    bound = f"{sought.bound:.3g} I"
    if sought.feedback_only:
        limits = f"{1 / sought.bound:.3g} I <= Y <= {bound}"
        return (
            f"lpv: no Y(q) keeps its inequality (what references can reach) within {limits}; raise bound or lower eps"
        )
    if gamma is None:
        return f"lpv: no X(q), Y(q) below {bound} keep X Y >= 1 and their inequalities; raise bound or lower eps"
    return f"lpv: no X(q), Y(q) below {bound} keep their inequalities at gamma = {gamma:.4g}; raise backoff or bound"

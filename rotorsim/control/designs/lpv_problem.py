r"""Matrix inequalities of the LPV synthesis on a grid of operating points, and their solution by cutting planes.

.. math:: N_X^T \begin{bmatrix} \dot X + A^T X + X A & X B_1 & C_1^T\\ \cdot & -\gamma I & D_{11}^T\\
          \cdot & \cdot & -\gamma I \end{bmatrix} N_X \prec 0, \quad
          N_Y^T \begin{bmatrix} -\dot Y + A Y + Y A^T & Y C_1^T & B_1\\ \cdot & -\gamma I & D_{11}\\
          \cdot & \cdot & -\gamma I \end{bmatrix} N_Y \prec 0, \quad
          \begin{bmatrix} X & I\\ I & Y \end{bmatrix} \succeq 0

The controller's variables are eliminated: N_X spans what y does not see (C2, D21), N_Y what u does not move (B2, D12).
With them the inequalities are 30 x 30 and have 1723 unknowns (thesis eq. E.18, where Y is constant and rates are
neglected). The Lyapunov matrices X(q), Y(q) are polynomials in the scaled operating point:

.. math:: X(q) = \sum_k q_1^{i_k} q_2^{j_k} X_k, \qquad
          \dot X = \frac{\partial X}{\partial q_1} \dot q_1 + \frac{\partial X}{\partial q_2} \dot q_2

dX/dt is linear in the rate of q: what holds at the corners of a box of rates holds within.
Source: Apkarian, Adams (1998); Gahinet, Apkarian (1994).

Linear matrix inequalities in symmetric matrices, F_0 + sum_k x_k F_k >= 0, are assembled directly for the solver
Clarabel. Its status is not believed anywhere: who uses a solution checks it by eigenvalues. Many inequalities with a
margin are imposed as a solution of fewer breaks them (cutting planes). Each round solves the inequalities imposed so
far and imposes the worst that are broken by it; it ends when every inequality keeps half of its margin, up to a
tolerance. The optimum of each round bounds that of all inequalities.

Cites: apkarian_1998, boyd_1994, gahinet_1994, thesis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import null_space

from rotorsim.base.display import Report, silent
from rotorsim.base.errors import DesignError
from rotorsim.control.designs.hinf_synthesis import Generalised

GAMMA_SLACK, TOLERANCE = 3e-3, 2e-3
"""Tolerance of the smallest gamma as a share of it, and of the inequalities by their eigenvalues."""
MARGIN_X, MARGIN_Y = 0.3, 0.01
"""Distances from zero that the inequalities of X and of Y keep per unit of `inside`; X Y >= (1 + inside)^2."""
KEPT = 0.5
"""Share of the margins that every grid point keeps."""
GAP = 1e-4
"""Relative gap at which the solver stops: a gamma to four digits."""
MOST = 8
"""Inequalities of a kind that a round adds."""
Exponents = tuple[tuple[int, int], ...]


def exponents(order: int, moves: tuple[bool, bool] = (True, True)) -> Exponents:
    """Exponents of both scaled coordinates up to a total degree; (0, 0) alone for order 0.

    `moves` leaves out a coordinate that has one value in the range.
    """
    pairs = [(i, j) for i, j in product(range(order + 1), repeat=2) if i + j <= order]
    kept = [(i, j) for i, j in pairs if (moves[0] or not i) and (moves[1] or not j)]
    return tuple(sorted(kept, key=lambda pair: (sum(pair), pair[0] * pair[1], -pair[0])))


def scaled(low: np.ndarray, high: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Operating points (..., 2) of the range `low` to `high` (2,) scaled to [-1, 1]."""
    return np.asarray((points - (low + high) / 2) / np.where(high > low, (high - low) / 2, 1.0))


def functions(powers: Exponents, points: np.ndarray) -> np.ndarray:
    """Monomials (..., t) at scaled points (..., 2)."""
    return np.stack([points[..., 0] ** i * points[..., 1] ** j for i, j in powers], axis=-1)


def derivatives(powers: Exponents, points: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Time derivatives (..., t) of the monomials where the scaled point moves at `rate` (2,)."""
    x, y = points[..., 0], points[..., 1]
    found = [(i * x ** max(i - 1, 0) * y**j) * rate[0] + (j * x**i * y ** max(j - 1, 0)) * rate[1] for i, j in powers]
    return np.stack(found, axis=-1)


def corners(rates: np.ndarray) -> np.ndarray:
    """Corners (v, 2) of the box of rates -rates to rates; a rate of zero has one value."""
    return np.array(list(product(*[(-r, r) if r else (0.0,) for r in rates])))


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Symmetric matrix polynomial: coefficients (t, n, n) of t monomials."""

    powers: Exponents
    coefficients: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values (..., n, n) at scaled points (..., 2)."""
        return np.asarray(np.tensordot(functions(self.powers, points), self.coefficients, 1))

    def rate(self, points: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Time derivatives (..., n, n) at scaled points (..., 2) that move at `rate` (2,)."""
        return np.asarray(np.tensordot(derivatives(self.powers, points, rate), self.coefficients, 1))


@dataclass(frozen=True, eq=False)
class Solution:
    """X(q), Y(q), gamma, and the largest rates (2,) of the scaled point [1/ms] that they are made for.

    X Y >= (1 + inside)^2, which keeps I - X Y well conditioned; the inequalities keep a margin in proportion to it.
    """

    X: Polynomial
    Y: Polynomial
    gamma: float
    rates: np.ndarray
    inside: float = 0.0

    @property
    def corners(self) -> np.ndarray:
        """Corners (v, 2) of the box of rates; one, at rest, if neither matrix depends on q."""
        still = len(self.X.powers) == len(self.Y.powers) == 1
        return np.zeros((1, 2)) if still else corners(self.rates)


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

    Raises DesignError if the solver has no solution.
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


@dataclass
class LmiProblem:
    """Minimise c'x subject to matrix inequalities; `variables` is the length of x."""

    variables: int
    blocks: list[tuple[int, np.ndarray, sparse.csc_matrix]] = field(default_factory=list)

    def add(self, constant: np.ndarray, terms: list[tuple[int, np.ndarray]]) -> None:
        """constant + sum of terms >= 0; a term is the index of its first variable and matrices (k, n, n)."""
        rows = vector(constant)
        parts = [sparse.coo_matrix(vector(matrices).T) for _, matrices in terms]
        data = np.concatenate([part.data for part in parts])
        i = np.concatenate([part.row for part in parts])
        j = np.concatenate([part.col + first for part, (first, _) in zip(parts, terms, strict=True)])
        coefficients = sparse.csc_matrix((data, (i, j)), shape=(len(rows), self.variables))
        self.blocks.append((len(constant), rows, coefficients))

    def minimise(self, cost: np.ndarray, what: str) -> np.ndarray:
        """The solution x; raises DesignError, `what` and the solver's word, if it found none."""
        import clarabel

        A = -sparse.vstack([block for _, _, block in self.blocks], format="csc")
        b = np.concatenate([rows for _, rows, _ in self.blocks])
        cones = [clarabel.PSDTriangleConeT(n) for n, _, _ in self.blocks]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        settings.max_iter = 150
        settings.tol_gap_rel = settings.tol_gap_abs = GAP
        P = sparse.csc_matrix((self.variables, self.variables))
        found = clarabel.DefaultSolver(P, np.asarray(cost, float), A, b, cones, settings).solve()
        x = np.asarray(found.x)
        if "Infeasible" in str(found.status) or not np.all(np.isfinite(x)):
            raise DesignError(f"{what} ({found.status})")
        return x


def triangle(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and factors by which the upper triangle (column by column) becomes a vector with the same norm."""
    columns, rows = np.tril_indices(n)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


def vector(matrices: np.ndarray) -> np.ndarray:
    """Symmetric matrices (..., n, n) as vectors (..., n (n + 1)/2)."""
    rows, columns, factors = triangle(matrices.shape[-1])
    return np.asarray(matrices[..., rows, columns] * factors)


def symmetric_basis(n: int) -> np.ndarray:
    """Basis (n (n + 1)/2, n, n) of the symmetric matrices."""
    rows, columns, _ = triangle(n)
    made = np.zeros((len(rows), n, n))
    k = np.arange(len(rows))
    made[k, rows, columns] = made[k, columns, rows] = 1.0
    return made


class Inequality(NamedTuple):
    """One inequality: `kind` and `place` group it, terms are (first variable, factor, matrices (k, n, n))."""

    kind: str
    place: int
    constant: np.ndarray
    terms: list[tuple[int, float, np.ndarray]]
    margin: float

    def excess(self, x: np.ndarray) -> float:
        """Smallest eigenvalue at x less half the margin; negative where it is broken."""
        value = self.constant.copy()
        for first, factor, matrices in self.terms:
            value += factor * np.tensordot(x[first : first + len(matrices)], matrices, 1)
        return float(np.linalg.eigvalsh(value)[0] - self.margin / 2)

    def impose(self, problem: LmiProblem) -> None:
        """Add it to a problem with its margin."""
        merged: dict[int, np.ndarray] = {}
        for first, factor, matrices in self.terms:
            merged[first] = merged.get(first, 0.0) + factor * matrices
        problem.add(self.constant - self.margin * np.eye(len(self.constant)), list(merged.items()))


def minimise(
    cost: np.ndarray, inequalities: Sequence[Inequality], start: Sequence[int], what: str, slack: float,
    tolerance: float = 0.0, progress: Report = silent,
) -> np.ndarray:  # fmt: skip
    """The x of least cost'x that keeps all inequalities, first solved with those of the indices `start`.

    They are judged with the share `slack` of the last variable added to it, and up to `tolerance`. Raises DesignError,
    `what` and the solver's word, if there is no solution. `progress` is given the counts of each round.
    """
    imposed = set(start)
    while True:
        progress(f"{len(imposed)} of {len(inequalities)} inequalities")
        problem = LmiProblem(len(cost))
        for k in sorted(imposed):
            inequalities[k].impose(problem)
        x = problem.minimise(cost, what)
        judged = np.append(x[:-1], x[-1] * (1 + slack))
        broken = [(one.excess(judged), k) for k, one in enumerate(inequalities) if k not in imposed]
        worst = worst_of(inequalities, [pair for pair in broken if pair[0] < -tolerance])
        if not worst:
            return x
        imposed |= worst


def worst_of(inequalities: Sequence[Inequality], broken: list[tuple[float, int]]) -> set[int]:
    """The worst at each place, up to MOST of a kind."""
    places: dict[tuple[str, int], int] = {}
    for _, k in sorted(broken):
        places.setdefault((inequalities[k].kind, inequalities[k].place), k)
    found: dict[str, list[int]] = {}
    for (kind, _), k in places.items():
        found.setdefault(kind, []).append(k)
    return {k for own in found.values() for k in own[:MOST]}

r"""Linear matrix inequalities in symmetric matrices, assembled directly for the solver Clarabel.

.. math:: F_0 + \sum_k x_k F_k \succeq 0

A solver's status is not believed anywhere: who uses a solution checks it by eigenvalues.

Many inequalities with a margin are imposed as a solution of fewer breaks them (cutting planes). Each round solves the
inequalities imposed so far and imposes the worst that are broken by it; it ends when every inequality keeps half of its
margin, up to a tolerance. The optimum of each round bounds that of all inequalities.

Cites: boyd_1994.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy import sparse

from rotorsim.base.display import Report, silent
from rotorsim.control.errors import DesignError


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


GAP = 1e-4
"""Relative gap at which the solver stops: a gamma to four digits."""


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


MOST = 8
"""Inequalities of a kind that a round adds."""


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

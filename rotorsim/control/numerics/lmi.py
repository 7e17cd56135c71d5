r"""Linear matrix inequalities in symmetric matrices, assembled directly for the solver Clarabel.

.. math:: F_0 + \sum_k x_k F_k \succeq 0

A solver's status is not believed anywhere: who uses a solution checks it by eigenvalues.

Cites: boyd_1994.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

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

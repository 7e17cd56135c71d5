"""Linear screening: sensitivities of the candidates with the calibration's part projected out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotorsim.discrepancy.fit.least_squares import ParameterFit, prior_rows
from rotorsim.discrepancy.linear_algebra import NoAnswerError, answer
from rotorsim.discrepancy.search.candidates import Form


@dataclass(frozen=True, eq=False)
class Screening:
    """Forms with projected sensitivities, projected residual r (n + k,), and their scalar products."""

    forms: tuple[Form, ...]
    where: tuple[slice, ...]
    gram: np.ndarray
    products: np.ndarray
    one_sided: np.ndarray
    raw: np.ndarray

    def drop(self, *numbers: int) -> tuple[float, np.ndarray]:
        """By how much a set of forms together lowers the sum of squares, and at which values of their parameters."""
        columns = np.concatenate([np.arange(*self.where[i].indices(len(self.products))) for i in numbers])
        return self._drop(columns)

    def _drop(self, columns: np.ndarray) -> tuple[float, np.ndarray]:
        G, b = self.gram[np.ix_(columns, columns)], self.products[columns]
        # a column that the calibration imitates to a thousandth, or two that cancel, do not explain anything
        weak = np.diag(G) < 1e-5 * self.raw[columns]
        G = G + np.diag(np.where(weak, 1e300, 1e-9 * np.diag(G)))
        scale = np.sqrt(np.diag(G))
        try:
            if len(columns) > 1 and answer(np.linalg.cond, G / scale[:, None] / scale) > 1e4:
                return 0.0, np.zeros(len(columns))
            values = answer(np.linalg.solve, G, b)
        except NoAnswerError:
            return 0.0, np.zeros(len(columns))
        if np.any(self.one_sided[columns] & (values < 0)):
            return 0.0, np.zeros(len(columns))
        return float(b @ values), values

    def likeness(self, i: int, j: int) -> float:
        """Largest cosine between what two forms can add to the data after re-calibration."""
        a, b = self.where[i], self.where[j]
        A, B = self.gram[a, a], self.gram[b, b]
        floor_a, floor_b = 1e-12 * np.trace(A) + 1e-300, 1e-12 * np.trace(B) + 1e-300
        La = answer(np.linalg.cholesky, A + floor_a * np.eye(len(A)))
        Lb = answer(np.linalg.cholesky, B + floor_b * np.eye(len(B)))
        middle = answer(np.linalg.solve, La, answer(np.linalg.solve, Lb, self.gram[a, b].T).T)
        return float(min(answer(np.linalg.svd, middle, compute_uv=False).max(), 1.0))

    def survives(self, i: int) -> float:
        """Share of a form's signature that re-calibration cannot imitate."""
        own = self.where[i]
        return float(np.sqrt(np.trace(self.gram[own, own]) / max(self.raw[own].sum(), 1e-300)))

    def size(self, i: int) -> float:
        """Norm of a form's projected signature for one step of its parameters."""
        return float(np.sqrt(np.trace(self.gram[self.where[i], self.where[i]])))


def screen(base: ParameterFit, forms: Sequence[Form], columns: Sequence[np.ndarray]) -> Screening:
    """Project sensitivities [(n, m) each, per unit parameter] off a fit's Jacobian; columns scaled to steps."""
    p = prior_rows(base.parameters)
    A = np.vstack([base.J, np.diag(p)])
    size = np.linalg.norm(A, axis=0)
    U, s, _ = answer(np.linalg.svd, A / np.where(size > 0, size, 1.0), full_matrices=False)
    Q = U[:, s > 1e-9 * s[0]]
    steps = [np.array([k.step for k in f.parameters]) for f in forms]
    S = np.concatenate([c * d for c, d in zip(columns, steps, strict=True)], axis=1)
    raw = np.sum(S**2, axis=0)
    r = np.concatenate([base.residual, -p * base.vector])
    S = np.vstack([S, np.zeros((len(p), S.shape[1]))])
    S = S - Q @ (Q.T @ S)
    r = r - Q @ (Q.T @ r)
    ends = np.cumsum([0] + [c.shape[1] for c in columns])
    where = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    one_sided = np.array([k.low == 0.0 for f in forms for k in f.parameters])
    return Screening(tuple(forms), where, S.T @ S, S.T @ r, one_sided, raw)

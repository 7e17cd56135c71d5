r"""Many linear matrix inequalities at once, by imposing those that a solution of fewer breaks (cutting planes).

.. math:: F_0 + \sum_k x_k F_k \succeq \mathrm{margin} \cdot I

Each round solves the inequalities imposed so far and imposes the worst that are broken by it; it ends when every
inequality keeps half of its margin, up to a tolerance. The optimum of each round bounds that of all inequalities.

Cites: boyd_1994.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotorsim.base.progress import Report, silent
from rotorsim.control.numerics.lmi import LmiProblem

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

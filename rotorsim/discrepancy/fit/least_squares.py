r"""Damped least squares with line search: linearised step, nonlinear residual.

.. math:: \min_v \; |r(v)|^2 + |(v - v_0)/s|^2

The Jacobian J of a chord step is kept and corrected after each step by Broyden's rank-one update; residuals
always come from the plant. Source: Nocedal & Wright (2006), chapter 10 and section 11.1.

Cites: nocedal_2006.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.fit.parameters import FitParameter, within
from rotorsim.discrepancy.linear_algebra import NoAnswerError, answer
from rotorsim.discrepancy.residuals.comparison import ParameterPoint, TwinComparison

MOST_STEPS, MOST_DAMPING = 8, 1e4
ENOUGH = 1.0
"""A step that lowers the sum of squares by less than this ends a fit (or by a thousandth of it)."""


@dataclass(frozen=True, eq=False)
class ParameterFit:
    """Result of a fit: point, whitened residual (n,), Jacobian (n, k) there, sum of squares with priors."""

    parameters: tuple[FitParameter, ...]
    point: ParameterPoint
    residual: np.ndarray
    J: np.ndarray
    cost: float

    @property
    def chi2(self) -> float:
        """Sum of squared residuals without priors."""
        return float(self.residual @ self.residual)

    @property
    def vector(self) -> np.ndarray:
        """Values (k,) of the parameters."""
        return np.array([self.point.values.get(k, 0.0) for k in self.parameters])


def prior_rows(parameters: Sequence[FitParameter]) -> np.ndarray:
    """Square-root weights 1 / sd (k,) of the priors."""
    return np.array([1 / k.sd for k in parameters])


def cost_of(residual: np.ndarray, v: np.ndarray, p: np.ndarray) -> float:
    """Sum of squares with priors."""
    return float(residual @ residual + np.sum((v * p) ** 2))


def step_of(J: np.ndarray, r: np.ndarray, v: np.ndarray, p: np.ndarray, damping: float) -> np.ndarray:
    """Damped Gauss-Newton step (k,) for a residual r = measured - simulated."""
    H = J.T @ J + np.diag(p**2)
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    A = H / scale[:, None] / scale + damping * np.eye(len(v))
    g = (J.T @ r - p**2 * v) / scale
    return np.asarray(answer(np.linalg.lstsq, A, g, rcond=1e-12)[0] / scale)


def fit(
    comparison: TwinComparison,
    point: ParameterPoint,
    parameters: Sequence[FitParameter],
    J: np.ndarray,
    residual: np.ndarray | None = None,
    steps: int = MOST_STEPS,
    progress: Callable[[], None] | None = None,
) -> ParameterFit:
    """Fit parameters from the start `point` with the Jacobian J (n, k) there; ends where a step has no answer."""
    parameters, J = tuple(parameters), J.copy()
    p = prior_rows(parameters)
    r = comparison.residual(point) if residual is None else residual
    v = np.array([point.values.get(k, 0.0) for k in parameters])
    cost, damping = cost_of(r, v, p), 1e-6
    for _ in range(steps):
        try:
            change = within(parameters, v + step_of(J, r, v, p, damping)) - v
        except NoAnswerError:
            break
        share, done = 1.0, False
        while share > 0.1:
            there = point.moved(parameters, share * change)
            new = comparison.residual(there)
            if progress is not None:
                progress()
            if (found := cost_of(new, v + share * change, p)) < cost:
                break
            share *= 0.35
        else:
            # no length of the step helps: turn it towards the steepest descent
            damping = max(1e3 * damping, 1e-3)
            if damping > MOST_DAMPING:
                break
            continue
        moved = share * change
        miss = (r - new) - J @ moved
        weight = moved * np.sum(J**2, axis=0)
        J += np.outer(miss, weight) / max(float(weight @ moved), 1e-300)
        done = cost - found < max(ENOUGH, 1e-3 * found)
        point, r, v, cost = there, new, v + moved, found
        damping = damping * 0.3 if share == 1.0 else damping * 10
        if done:
            break
    return ParameterFit(parameters, point, r, J, cost)


def singular_directions(
    J: np.ndarray, parameters: Sequence[FitParameter], limit: float = 1e-2
) -> list[dict[str, float]]:
    """Null vectors of a calibration, with singular values below `limit` times the next one.

    Columns are scaled to unit length; each vector is a dictionary of the parameters that take part in it.
    """
    size = np.linalg.norm(J, axis=0)
    seen = size > 1e-9 * size.max()
    _, s, V = answer(np.linalg.svd, J[:, seen] / size[seen], full_matrices=False)
    names = [k.name for k, ok in zip(parameters, seen, strict=True) if ok]
    found = []
    for i in range(1, len(s)):
        if s[i] < limit * s[i - 1]:
            found += [{n: float(x) for n, x in zip(names, row, strict=True) if abs(x) > 0.2} for row in V[i:]]
            break
    return found

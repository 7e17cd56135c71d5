r"""Fit over several stretches: shared parameters, an initial state for each, regressors of any of them.

The sums of `Problem.normal_equations` run stretch by stretch; the states stand behind each other in x0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.local.fit import Fit, Parametrised, Problem
from identification.local.simulation import normal_matrices, respond_with_sensitivities
from identification.local.steps import Box
from identification.local.uncertainty.confidence import sandwich
from identification.records.stretches import parts_of, regressors_of
from rotorsim.base.rounding import normal_root


@dataclass(frozen=True, eq=False)
class Joint(Problem):
    """A problem whose data are several stretches, which begin at sample 0 and at `breaks`."""

    breaks: tuple[int, ...] = ()

    def states(self, theta: np.ndarray) -> int:
        """Number of initial states, of all stretches."""
        return super().states(theta) * (len(self.breaks) + 1)

    def normal_equations(
        self, theta: np.ndarray, x0: np.ndarray, V: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """J'J, J'r and r'r over all stretches; infinite cost where the simulation overflows."""
        F, G, H, E, dF, dH, dx0 = self._sensitive(theta, V)
        n, q, p = len(F), dF.shape[2] - len(F), self.y.shape[1]
        size = q + len(x0)
        N, g, cost = np.zeros((size, size)), np.zeros(size), 0.0
        QJ, Qr = np.zeros((p, self.Q.shape[1], size)), np.zeros((p, self.Q.shape[1]))
        for k, at in enumerate(parts_of(self.breaks, len(self.y))):
            own = np.r_[0:q, q + k * n : q + (k + 1) * n]
            Q, shown = regressors_of(self.Q, at)
            some = normal_matrices(F, G, H, E, dF, dH, x0[k * n : (k + 1) * n], dx0, self.w[at], self.y[at], Q)
            N[np.ix_(own, own)] += some[0]
            g[own] += some[1]
            QJ[:, shown[:, None], own] += some[2]
            Qr[:, shown] += some[3]
            cost += some[4]
        for axis in range(p):
            N -= QJ[axis].T @ QJ[axis]
            g -= QJ[axis].T @ Qr[axis]
            cost -= float(Qr[axis] @ Qr[axis])
        return N, g, cost if np.isfinite(cost) else np.inf

    def scores(self, theta: np.ndarray, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n, p) and its negative derivative (n, p, q) by the parameters, the initial states eliminated."""
        F, G, H, E, dF, dH, dx0 = self._sensitive(theta)
        n, q = len(F), len(theta)
        N = self.normal_equations(theta, x0)[0]
        root = normal_root(N[q:, q:])
        known = root @ (root.T @ N[q:, :q])
        y, J = np.empty_like(self.y), np.empty((*self.y.shape, q))
        for k, at in enumerate(parts_of(self.breaks, len(self.y))):
            own = slice(k * n, (k + 1) * n)
            y[at], both = respond_with_sensitivities(F, G, H, E, dF, dH, x0[own], dx0, self.w[at])
            J[at] = both[..., :q] - both[..., q:] @ known[own]
        return self.project(self.y - y), self.project(J)


def problem_of(
    model: Parametrised, w: np.ndarray, y: np.ndarray, Q: np.ndarray, breaks: tuple[int, ...], box: Box = None
) -> Problem | Joint:
    """The problem of one stretch, or of several."""
    return Joint(model, w, y, Q, box, breaks=breaks) if breaks else Problem(model, w, y, Q, box)


def ahead_of(problem: Problem, predictor: Parametrised) -> Problem:
    """The problem of one-step prediction: the measured outputs are inputs too."""
    return replace(problem, model=predictor, w=np.ascontiguousarray(np.hstack([problem.w, problem.y])))


def covariance_of(problem: Problem, fitted: Fit, q: int, Ts: float) -> np.ndarray:
    """Covariance (q, q) of the first parameters of a fit."""
    return sandwich(*scores_of(problem, fitted.theta, fitted.x0), Ts)[:q, :q]


def scores_of(problem: Problem, theta: np.ndarray, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual and negative derivative by parameters and initial state, of several stretches by parameters alone.

    The residual is that of the problem's judge, where it has one.
    """
    residual, J = problem.scores(theta, x0) if isinstance(problem, Joint) else problem.residual(theta, x0)
    if problem.judge is not None:
        q = len(theta)
        N, g, _ = problem.judge.normal_equations(theta, x0)
        root = normal_root(N[q:, q:])
        residual = scores_of(problem.judge, theta, x0 + root @ (root.T @ g[q:]))[0]
    return residual, J

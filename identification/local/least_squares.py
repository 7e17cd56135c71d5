r"""Least squares of output-error and prediction-error fits by Levenberg and Marquardt with exact sensitivities.

.. math:: \min_{\theta, x_0, c} \sum_k \| y_k - \hat y_k(\theta, x_0) - c\,\phi_k \|^2

The output-error model simulates; the prediction-error model (thesis, eqs. C.6 and C.14) corrects its state by
K (y - y^) at every sample. Regressors phi that are linear (offsets, harmonics of the shaft angle) are projected out, so
their coefficients c never enter the iteration. Source: Ljung, System Identification (1999), sections 7.2, 10.2.

The parameters take steps with or without bounds. The iteration is an own one, because kernels sum the normal equations
sample by sample, with initial states and regressors eliminated, where SciPy's solvers ask for the whole Jacobian.

.. math:: (N + \lambda\,\mathrm{diag} N)\, \Delta = g, \qquad \theta_{low} \le \theta + \Delta \le \theta_{high}

Elements that pass a bound stop there and the others are solved for again (active set). Source: Nocedal and Wright
(2006), chapters 10 and 16.

A fit over several stretches has shared parameters, an initial state for each stretch and regressors of any.

Cites: ljung_1999, nocedal_2006, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.linalg import block_diag

from identification.local.confidence import sandwich
from identification.local.simulation import (
    normal_matrices,
    respond_with_sensitivities,
    sampled,
    sampled_with_derivatives,
)
from identification.local.structures import Structure
from identification.records.prefilter import parts_of, regressors_of
from rotorsim.base.rounding import normal_root

Box = tuple[np.ndarray, np.ndarray] | None
"""Lowest and highest parameters, None where there are no bounds."""


def within(box: Box, theta: np.ndarray) -> np.ndarray:
    """Parameters without what rounding added beyond a bound."""
    return theta if box is None else np.clip(theta, *box)


def reach(box: Box, theta: np.ndarray, size: int) -> Box:
    """Least and largest step (size,) of the parameters and of the state, which has no bounds."""
    if box is None:
        return None
    free = np.full(size - len(theta), np.inf)
    return np.concatenate([box[0] - theta, -free]), np.concatenate([box[1] - theta, free])


def damped_step(N: np.ndarray, g: np.ndarray, damping: float, room: Box = None) -> tuple[np.ndarray, float]:
    """Damped step and the fall of the cost that it promises; what would leave its room stops there, the rest adapts."""
    scale = np.sqrt(np.maximum(np.diag(N), 1e-300))
    M, s = N / np.outer(scale, scale), g / scale
    damped = M + damping * np.eye(len(M))
    step = np.linalg.solve(damped, s)
    if room is not None:
        step = _stopped(damped, s, step, room[0] * scale, room[1] * scale)
    return step / scale, float(2 * step @ s - step @ M @ step)


def _stopped(M: np.ndarray, s: np.ndarray, step: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Solution of M step = s in what is free; elements that pass a bound are held at it, one set after another."""
    held = np.zeros(len(s), bool)
    while np.any(beyond := ~held & ((step < low) | (step > high))):
        held |= beyond
        step, free = np.where(held, np.clip(step, low, high), step), ~held
        if free.any():
            step[free] = np.linalg.solve(M[np.ix_(free, free)], s[free] - M[np.ix_(free, held)] @ step[held])
    return step


ITERATIONS, TOLERANCE = 60, 1e-9
"""Most steps; end of the iteration."""
MOST_DAMPING = 1e8
REACH = 0.5
"""Largest relative change of a positive parameter in one step."""
Sampled = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Parametrised(Protocol):
    """A sampled model F, G, H, E of parameters theta, with its derivatives."""

    def sampled(self, theta: np.ndarray) -> Sampled:
        """F (n, n), G (n, m), H (p, n), E (p, m)."""

    def derivatives(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of [F G], (n, n + m, q), and of [H E], (p, n + m, q)."""

    def admissible(self, theta: np.ndarray) -> bool:
        """Whether the parameters make sense."""

    def directions(self, theta: np.ndarray) -> np.ndarray | None:
        """Orthonormal directions (q, d) that change the model, of redundant parameters; None if all of them do."""

    def share(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Share of a step that may be taken at once, 1 if all of it."""


@dataclass(frozen=True)
class GreyBox:
    """A continuous structure, sampled with period Ts [s] behind a hold of order zero or first."""

    structure: Structure
    Ts: float
    hold: str = "zero"

    def sampled(self, theta: np.ndarray) -> Sampled:
        """F, G, H, E; raises no error."""
        A, B, C, D = self.structure.matrices(theta)
        FG = sampled(A, B, self.Ts, self.hold)
        n = len(A)
        E = np.zeros((len(C), FG.shape[1] - n))
        E[:, : D.shape[1]] = D
        return np.ascontiguousarray(FG[:, :n]), np.ascontiguousarray(FG[:, n:]), C, E

    def derivatives(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of [F G] and [H E]."""
        A, B, _, D = self.structure.matrices(theta)
        dA, dB, dC, dD = self.structure.derivatives(theta)
        _, dF = sampled_with_derivatives(A, B, dA, dB, self.Ts, self.hold)
        n, (p, m) = len(A), D.shape
        dH = np.zeros((p, *dF.shape[1:]))
        dH[:, :n], dH[:, n : n + m] = np.moveaxis(dC, 0, -1), np.moveaxis(dD, 0, -1)
        return dF, dH

    def admissible(self, theta: np.ndarray) -> bool:
        """Whether positive parameters are positive."""
        return self.structure.admissible(theta)

    def directions(self, theta: np.ndarray) -> None:
        """None: no parameter is redundant."""

    def share(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Share of a step that changes no positive parameter by more than REACH: their effect fades as they grow."""
        at = self.structure.positive_places
        return float(min(1.0, REACH / max(np.abs(step[at] / theta[at]).max(initial=0.0), 1e-300)))


@dataclass(frozen=True)
class Predictor:
    """One-step predictor of a model: F - K H with inputs (u, y); theta is the model's and then K (n, p) by rows."""

    inner: Parametrised
    n: int
    p: int

    def _split(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        cut = len(theta) - self.n * self.p
        return theta[:cut], theta[cut:].reshape(self.n, self.p)

    def sampled(self, theta: np.ndarray) -> Sampled:
        """F - K H, [G - K E, K], H, [E, 0]."""
        own, K = self._split(theta)
        F, G, H, E = self.inner.sampled(own)
        return (
            np.ascontiguousarray(F - K @ H), np.hstack([G - K @ E, K]), H, np.hstack([E, np.zeros((self.p, self.p))])
        )  # fmt: skip

    def derivatives(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives by the model's parameters and by the elements of K."""
        own, K = self._split(theta)
        dF, dH = self.inner.derivatives(own)
        _, _, H, E = self.inner.sampled(own)
        q, width = dF.shape[2], dF.shape[1]
        out = np.zeros((self.n, width + self.p, q + K.size))
        out[:, :width, :q] = dF - np.einsum("np,pwq->nwq", K, dH)
        seen = np.hstack([H, E])
        for r in range(self.n):
            for c in range(self.p):
                out[r, :width, q + r * self.p + c] = -seen[c]
                out[r, width + c, q + r * self.p + c] = 1.0
        outputs = np.zeros((self.p, width + self.p, q + K.size))
        outputs[:, :width, :q] = dH
        return out, outputs

    def admissible(self, theta: np.ndarray) -> bool:
        """Whether the model's parameters make sense."""
        return self.inner.admissible(self._split(theta)[0])

    def directions(self, theta: np.ndarray) -> np.ndarray | None:
        """Directions of the model, and every element of K."""
        own, K = self._split(theta)
        V = self.inner.directions(own)
        return None if V is None else np.asarray(block_diag(V, np.eye(K.size)))

    def share(self, theta: np.ndarray, step: np.ndarray) -> float:
        """Share of a step that the model's parameters allow."""
        return self.inner.share(self._split(theta)[0], self._split(step)[0])


@dataclass(frozen=True, eq=False)
class FitProblem:
    """Inputs w (n, m), outputs y (n, p), orthonormal regressors Q (n, h) that are projected out.

    box: lowest and highest parameters (q,), where they have bounds. breaks: samples at which later stretches begin,
    each with an initial state; these stand behind each other in x0. judge: the same model with the inputs and outputs
    whose residual is the error that the covariance is made of, where these are not the problem's own.
    """

    model: Parametrised
    w: np.ndarray
    y: np.ndarray
    Q: np.ndarray
    box: Box = None
    breaks: tuple[int, ...] = ()
    judge: FitProblem | None = None

    def project(self, values: np.ndarray) -> np.ndarray:
        """Component of values (n, ...) orthogonal to the regressors."""
        flat = values.reshape(len(values), -1)
        return np.asarray((flat - self.Q @ (self.Q.T @ flat)).reshape(values.shape))

    def states(self, theta: np.ndarray) -> int:
        """Number of initial states, of all stretches."""
        return len(self.model.sampled(theta)[0]) * (len(self.breaks) + 1)

    def _sensitive(self, theta: np.ndarray, V: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """Matrices and derivatives by theta, or along the directions V, and by x0, as the kernels take them."""
        F, G, H, E = self.model.sampled(theta)
        dF, dH = self.model.derivatives(theta) if V is None else (d @ V for d in self.model.derivatives(theta))
        q, n = dF.shape[2], len(F)
        more = ((0, 0), (0, 0), (0, n))
        return F, G, H, E, np.pad(dF, more), np.pad(dH, more), np.hstack([np.zeros((n, q)), np.eye(n)])

    def residual(self, theta: np.ndarray, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n, p) = y - y^ and its negative derivative (n, p, q + n_x) by theta and x0.

        With several stretches the derivative (n, p, q) is that by theta, the initial states eliminated.
        """
        F, G, H, E, dF, dH, dx0 = self._sensitive(theta)
        if not self.breaks:
            y, J = respond_with_sensitivities(F, G, H, E, dF, dH, x0, dx0, self.w)
            return self.project(self.y - y), self.project(J)
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

    def normal_equations(
        self, theta: np.ndarray, x0: np.ndarray, V: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """J'J, J'r and r'r of all stretches, without the arrays J and r; infinite cost where the simulation overflows.

        J is by the parameters or along directions V (q, d) of them, and by the initial states.
        """
        F, G, H, E, dF, dH, dx0 = self._sensitive(theta, V)
        n, q, (samples, p), h = len(F), dF.shape[2] - len(F), self.y.shape, self.Q.shape[1]
        size = q + len(x0)
        N, g, cost = np.zeros((size, size)), np.zeros(size), 0.0
        QJ, Qr = np.zeros((p, h, size)), np.zeros((p, h))
        for k, at in enumerate(parts_of(self.breaks, samples)):
            own = np.r_[0:q, q + k * n : q + (k + 1) * n]
            Q, shown = regressors_of(self.Q, at) if self.breaks else (self.Q, np.arange(h))
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

    def usable(self, theta: np.ndarray) -> bool:
        """Whether the parameters make sense and the simulation does not grow beyond bounds."""
        if not self.model.admissible(theta):
            return False
        F = self.model.sampled(theta)[0]
        return bool(np.all(np.isfinite(F)) and np.abs(np.linalg.eigvals(F)).max() < 1 + 1 / len(self.w))


class Minimised(Protocol):
    """Problem that `solve` minimises: a sum of squares over parameters and a state, which may have no elements."""

    @property
    def model(self) -> Parametrised:
        """The parametrised model."""

    @property
    def box(self) -> Box:
        """Lowest and highest parameters, where they have bounds."""

    def states(self, theta: np.ndarray) -> int:
        """Number of states that the fit finds besides the parameters."""

    def normal_equations(
        self, theta: np.ndarray, x0: np.ndarray, V: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """J'J, J'r and r'r."""

    def usable(self, theta: np.ndarray) -> bool:
        """Whether the parameters make sense."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """End of an iteration: parameters (q,), state (n,), normal matrix (d + n, d + n), cost, history.

    d is q but for redundant parameters: then it is the number of directions that change the model.
    """

    theta: np.ndarray
    x0: np.ndarray
    N: np.ndarray
    cost: float
    iterations: int
    converged: bool


@np.errstate(over="ignore", invalid="ignore")  # a step too far, which is not taken
def solve(problem: Minimised, theta: np.ndarray, iterations: int = ITERATIONS, tolerance: float = TOLERANCE) -> Minimum:
    """Fit from a usable start `theta` (q,): stable, admissible, within the bounds; the state starts at zero.

    It stops when a step promises less than `tolerance` of the cost. The best point reached is returned; `converged`
    states whether the last step was negligible.
    """
    x0, damping, converged, number = np.zeros(problem.states(theta)), 1e-3, False, 0
    V = problem.model.directions(theta)
    N, g, cost = problem.normal_equations(theta, x0, V)
    while number < iterations and not converged:
        number += 1
        while damping < MOST_DAMPING:
            step, promised = damped_step(N, g, damping, reach(problem.box, theta, len(g)))
            converged = promised < tolerance * cost
            move, start = np.split(step, [len(step) - len(x0)])
            move = move if V is None else V @ move
            share = problem.model.share(theta, move)
            trial, state = within(problem.box, theta + share * move), x0 + share * start
            wanted = not converged and problem.usable(trial)
            ahead = problem.model.directions(trial) if wanted else None
            found = problem.normal_equations(trial, state, ahead) if wanted else None
            if converged or (found is not None and found[2] < cost):
                break
            damping = max(damping, 1e-9) * 8
        if converged or found is None or not found[2] < cost:
            break
        damping = max(damping / 10, 1e-12) if cost - found[2] > 0.25 * promised else damping
        theta, x0, V, (N, g, cost) = trial, state, ahead, found
    return Minimum(theta, x0, N, cost, number, converged or damping >= MOST_DAMPING)


def predicted(problem: FitProblem, fitted: Minimum, tolerance: float = TOLERANCE) -> tuple[FitProblem, Minimum]:
    """The problem of one-step prediction, whose inputs are the measured outputs too, and its fit from another's end."""
    n, p = len(problem.model.sampled(fitted.theta)[0]), problem.y.shape[1]
    free = np.full(n * p, np.inf)
    box = problem.box and (np.concatenate([problem.box[0], -free]), np.concatenate([problem.box[1], free]))
    w = np.ascontiguousarray(np.hstack([problem.w, problem.y]))
    ahead = replace(problem, model=Predictor(problem.model, n, p), w=w, box=box)
    return ahead, solve(ahead, np.concatenate([fitted.theta, np.zeros(n * p)]), tolerance=tolerance)


def covariance_of(problem: FitProblem, fitted: Minimum, q: int, Ts: float) -> np.ndarray:
    """Covariance (q, q) of the first parameters of a fit."""
    return sandwich(*scores_of(problem, fitted.theta, fitted.x0), Ts)[:q, :q]


def scores_of(problem: FitProblem, theta: np.ndarray, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual and negative derivative by parameters and initial state, of several stretches by parameters alone.

    The residual is that of the problem's judge, where it has one.
    """
    residual, J = problem.residual(theta, x0)
    if problem.judge is not None:
        q = len(theta)
        N, g, _ = problem.judge.normal_equations(theta, x0)
        root = normal_root(N[q:, q:])
        residual = scores_of(problem.judge, theta, x0 + root @ (root.T @ g[q:]))[0]
    return residual, J

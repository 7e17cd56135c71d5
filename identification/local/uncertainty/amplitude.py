r"""Change of stiffness and damping with the amplitude of motion, and the parameters at rest that follow from it.

A fit gives K and D at the amplitude of its record; the plant's linearisation is that of no amplitude. With the square
m_k of the simulated orbit's amplitude over its mean, parameters theta + beta m_k have the sensitivities

.. math:: s^i_{k+1} = F s^i_k + m_k (F_i x_k + G_i w_k)

to beta, as describing functions of odd nonlinearities do: a spring K (1 + h x^2) is one of stiffness K (1 + 3/4 h a^2)
at amplitude a. Least squares of the residual on the sensitivities to theta, and to beta of K and D, gives the change of
theta on the way to rest. It counts where beta differs from zero by Hotelling's test, with as many degrees of freedom as
the covariance has independent stretches: 3/2 of the record over the window of its correlations (Priestley 1981, 6.2).

Cites: gelb_1968, priestley_1981.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import f

from identification.local.fit import GreyBox, Problem
from identification.local.joint import Joint, scores_of
from identification.local.simulation import respond
from identification.local.uncertainty.confidence import WINDOW, sandwich
from identification.records.stretches import parts_of

MOVING = 8
"""K and D, the first parameters of every structure that moves, depend on the amplitude."""
CERTAIN = 0.99


class AtRest(NamedTuple):
    """Change (q,) of the parameters from the record's amplitude to none, its covariance (q, q), and the share of the
    distortion (residual less noise) that dependence on the amplitude explains."""

    change: np.ndarray
    covariance: np.ndarray
    share: float

    def first(self, count: int) -> AtRest:
        """Of the first parameters alone."""
        return AtRest(self.change[:count], self.covariance[:count, :count], self.share)

    def joined(self, count: int) -> AtRest:
        """With so many more parameters that do not change."""
        q = len(self.change)
        covariance = np.zeros((q + count, q + count))
        covariance[:q, :q] = self.covariance
        return AtRest(np.concatenate([self.change, np.zeros(count)]), covariance, self.share)


def nothing(count: int) -> AtRest:
    """No change of so many parameters."""
    return AtRest(np.zeros(count), np.zeros((count, count)), 0.0)


def at_rest(problem: Problem, theta: np.ndarray, x0: np.ndarray, Ts: float, noise: np.ndarray) -> AtRest:
    """Parameters at no amplitude, less those of an output-error fit that ended at theta (q,), x0; noise (2,) [m]."""
    residual, J = scores_of(problem, theta, x0)
    columns = np.concatenate([J, _modulated(problem, theta, x0)], axis=-1)
    flat = columns.reshape(-1, columns.shape[-1])
    scale = np.sqrt(np.maximum(np.sum(flat**2, axis=0), 1e-300))
    flat = flat / scale
    step = np.linalg.pinv(flat.T @ flat, rcond=1e-12, hermitian=True) @ (flat.T @ residual.ravel())
    left = residual - (flat @ step).reshape(residual.shape)
    covariance = sandwich(left, columns / scale, Ts)
    beta, q = slice(-MOVING, None), len(theta)
    size = float(step[beta] @ np.linalg.pinv(covariance[beta, beta], hermitian=True) @ step[beta])
    if not size > _limit(len(residual) * Ts):
        return nothing(q)
    distortion = np.sum(residual**2) - len(residual) * np.sum(noise**2)
    explained = np.sum(residual**2) - np.sum(left**2)
    share = min(float(explained / distortion), 1.0) if distortion > explained else 1.0
    return AtRest((step / scale)[:q], (covariance / np.outer(scale, scale))[:q, :q], share)


def _limit(lasting: float) -> float:
    """What the squared size of beta exceeds by chance in 1 % of records of so many seconds."""
    free = 1.5 * lasting / WINDOW
    rest = free - MOVING + 1
    return float(MOVING * free / rest * f.ppf(CERTAIN, MOVING, rest)) if rest > 1 else np.inf


def _modulated(problem: Problem, theta: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """Sensitivities (n, p, MOVING) to changes of K and D that follow the square of the amplitude."""
    F, G, H, _ = problem.model.sampled(theta)
    slopes = problem.model.derivatives(theta)[0]
    n, p = len(F), len(H)
    parts = list(parts_of(problem.breaks if isinstance(problem, Joint) else (), len(problem.w)))
    through, begin = np.zeros((n, problem.w.shape[1])), x0.reshape(-1, n)
    states = np.vstack([respond(F, G, np.eye(n), through, begin[k], problem.w[at]) for k, at in enumerate(parts)])
    x, v = states[:, :2], _velocity(problem, theta, states)
    frequency = np.linalg.norm(v) / max(float(np.linalg.norm(x)), 1e-300)
    square = np.sum(x**2 + (v / frequency) ** 2, axis=1)
    square = square / max(float(square.mean()), 1e-300)
    both, none, zero = np.hstack([states, problem.w]), np.zeros((p, n)), np.zeros(n)
    found = []
    for i in range(MOVING):
        push = np.ascontiguousarray((both @ slopes[:, :, i].T) * square[:, None])
        moved = [respond(F, np.eye(n), H, none, zero, push[at]) for at in parts]
        found.append(problem.project(np.vstack(moved)))
    return np.stack(found, axis=-1)


def _velocity(problem: Problem, theta: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Velocity x' (n, 2): the states v, and what the inputs add to them at once as the rates of the pins do."""
    assert isinstance(problem.model, GreyBox)
    B = problem.model.structure.matrices(theta)[1]
    return np.asarray(states[:, 2:4] + problem.w[:, : B.shape[1]] @ B[:2].T)

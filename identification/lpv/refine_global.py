r"""Refinement of surfaces by the output error over all records at once.

.. math:: \min_{c, x_{0j}} \sum_j \sum_k \| y_{jk} - \hat y_{jk}(\theta(q_j; c), x_{0j}) \|^2 / \|y_j\|^2

Each record's normal equations for its own parameters, initial state eliminated, are spread over the coefficients by the
basis functions at its operating point. One record is in memory at a time.

Cites: ljung_1999.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identification.errors import UnfitError
from identification.local.fit import GreyBox
from identification.local.goodness import project
from identification.local.greybox import DELAYED, STRUCTURES
from identification.local.joint import problem_of
from identification.lpv.model import LpvModel
from identification.lpv.refine_frequency import minimise
from identification.records.stretches import Signals

ITERATIONS = 6


def refine_global(model: LpvModel, signals: Sequence[Callable[[], Signals]]) -> LpvModel:
    """Refined surfaces of Model 1 or 3; `signals` are functions that return prefiltered records."""
    if model.kind not in ("1", "3", DELAYED):
        raise UnfitError(f"fit_lpv.refine: 'global' does not do model {model.kind}; take model 1 or 3, or 'frequency'")
    structure, states = STRUCTURES[model.kind], [np.zeros(0) for _ in signals]

    def normal(c: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        N, g, cost = np.zeros((c.size, c.size)), np.zeros(c.size), 0.0
        for j, load in enumerate(signals):
            one = load()
            phi = model.basis.at(np.array([[one.speed, one.pressure]]))[0]
            y = project(one.y, one.Q)
            problem = problem_of(GreyBox(structure, one.Ts), np.ascontiguousarray(one.u), y, one.Q, one.breaks)
            states[j] = states[j] if len(states[j]) else np.zeros(problem.states(c @ phi))
            if not problem.usable(c @ phi):
                return N, g, np.inf
            own, slope, part = problem.normal_equations(c @ phi, states[j])
            q, weight = len(c), 1 / float(np.sum(y**2))
            link = own[:q, q:] @ np.linalg.inv(own[q:, q:])
            states[j] = states[j] + np.linalg.solve(own[q:, q:], slope[q:])
            N += weight * np.kron(own[:q, :q] - link @ own[q:, :q], np.outer(phi, phi))
            g += weight * np.kron(slope[:q] - link @ slope[q:], phi)
            cost += weight * part
        return N, g, cost

    return replace(model, coefficients=minimise(normal, model.coefficients, ITERATIONS), refined="global")

"""Fit of a black-box model: subspace start, refined by output error or prediction error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.local.blackbox import FullStateSpace, balanced, subspace
from identification.local.closed_loop import acted_of
from identification.local.fit import Predictor, solve
from identification.local.goodness import project
from identification.local.grey_fits import result_of
from identification.local.joint import ahead_of, covariance_of, problem_of
from identification.local.models import LinearModel
from identification.local.result import Identification
from identification.local.uncertainty.confidence import propagate
from identification.records.checks import suspicious_gains
from identification.records.stretches import Signals, longest_part

REDUNDANT = 1e-6
"""Where a black-box fit ends: what is left moves along directions that the data hardly know, and no fit any more."""


def black_box(signals: Signals, order: int, method: str) -> Identification:
    """A black-box model of an order, from the subspace method on."""
    y = project(signals.y, signals.Q)
    full = FullStateSpace(order, 2, 2)
    scale = float(np.std(y))  # matrices of like size make the redundant fit well conditioned
    at = longest_part(signals)
    A, B, C = balanced(*subspace(signals.u[at], y[at] / scale, order))
    problem = problem_of(full, np.ascontiguousarray(signals.u), y / scale, signals.Q, signals.breaks)
    if (acted := acted_of(signals)) is not None:
        problem = replace(problem, judge=replace(problem, w=acted.u))
    fitted = solve(problem, full.pack(A, B, C), tolerance=REDUNDANT)
    if method == "pem":
        problem = ahead_of(problem, Predictor(full, order, 2))
        fitted = solve(problem, np.concatenate([fitted.theta, np.zeros(2 * order)]), tolerance=REDUNDANT)
    q = order * (order + 4)
    theta = fitted.theta[:q]
    covariance = covariance_of(problem, fitted, q, signals.Ts)
    model = _black_model(full, theta, scale, signals)
    wn, zeta = model.wn, model.zeta

    def properties(values: np.ndarray) -> np.ndarray:
        other = _black_model(full, values, scale, signals)
        same = len(other.wn) == len(wn)
        return np.concatenate([other.wn if same else wn, other.zeta if same else zeta, other.static_gain.ravel()])

    sds = propagate(properties, theta, covariance)
    n = len(wn)
    return result_of(
        "blackbox", method, model, {}, theta, covariance, signals, fitted,
        modes_found=(wn, zeta, sds[:n], sds[n : 2 * n]),
        gains=(model.static_gain, sds[2 * n :].reshape(2, 2)), lags=(np.full(2, np.nan), np.full(2, np.nan)),
        information=np.zeros((0, 0)), warnings=suspicious_gains(model.static_gain),
    )  # fmt: skip


def _black_model(full: FullStateSpace, theta: np.ndarray, scale: float, signals: Signals) -> LinearModel:
    A, B, C, D = full.sampled(theta)
    return LinearModel(A, B, C * scale, D, signals.Ts, speed=signals.speed, pressure=signals.pressure)

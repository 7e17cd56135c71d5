r"""Reduction of a controller, stable or not, judged by the change of the loop's sensitivity S.

The Hankel values of a controller predict little of its loop; the order here is the smallest whose S differs from the
full one's, relative to the peak of the latter, by less than a tolerance, and whose loop is stable.

A stable controller is truncated in balanced coordinates. One that is unstable, or whose truncation changes S too much,
begins as the truncation of its normalised coprime factors, K = N M^-1, which are stable whatever K is, and is fitted:

.. math:: \min_{K_r} \sum_k \| S_r(z_k) - S(z_k) \|_F^2

over frequencies up to Nyquist, with a penalty on poles of the loop outside `SAFE`.

Cites: zhou_1996.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov
from scipy.optimize import least_squares

from rotorsim.base.rounding import EPS, decays
from rotorsim.control.errors import DesignError
from rotorsim.control.sampled_loop import FREQUENCIES, Loop, closed_poles, frequency_axis, loop_of
from rotorsim.control.systems import System, balanced_states, gramians, largest, response, stable, transformed

SAFE, PENALTY = 0.9985, 1e3
"""Radius of the loop's poles beyond which a fit is penalised, and by how much."""
LINES, PASSES = 160, 60
"""Frequencies of a fit and its most steps."""


def balanced(system: System) -> tuple[System, np.ndarray]:
    """The system in balanced coordinates and its Hankel singular values; raises DesignError if it is unstable."""
    if not stable(system):
        raise DesignError("reduction: the controller is unstable and has no Gramians; keep its full order")
    system = _of_like_size(system)
    R, L = (_root(W) for W in gramians(system))
    U, hankel, Vt = np.linalg.svd(L.T @ R)
    alive = hankel > system.order * EPS * hankel[0]
    root = np.sqrt(hankel[alive])
    T, left = R @ Vt[alive].T / root, (L @ U[:, alive] / root).T
    return System(left @ system.A @ T, left @ system.B, system.C @ T, system.D), hankel[alive]


def _of_like_size(system: System) -> System:
    """The system in states that inputs move about as far as one another, so that none is lost next to larger ones."""
    system = balanced_states(system)
    size = np.sqrt(np.maximum(np.diag(gramians(system)[0]), 0.0))
    return transformed(system, 2.0 ** -np.round(np.log2(np.where(size > 0, size, 1.0))))


def _root(W: np.ndarray) -> np.ndarray:
    """R with R R' = W, which is positive semi-definite but for rounding."""
    values, vectors = np.linalg.eigh(W)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def truncated(system: System, order: int) -> System:
    """The first `order` balanced states, whatever they are worth."""
    full, _ = balanced(system)
    return System(full.A[:order, :order], full.B[:order], full.C[:, :order], full.D)


def coprime_truncated(system: System, order: int) -> System:
    """Truncation of the balanced normalised coprime factors N, M with K = N M^-1; K may be unstable.

    Raises
    ------
    DesignError
        If the Riccati equation of the factors has no solution.
    """
    A, B, C, D = balanced_states(system)
    R, S = np.eye(B.shape[1]) + D.T @ D, np.eye(C.shape[0]) + D @ D.T
    try:
        X = solve_continuous_are(A - B @ np.linalg.solve(R, D.T @ C), B, C.T @ np.linalg.solve(S, C), R)
        F = -np.linalg.solve(R, B.T @ X + D.T @ C)
        W = solve_continuous_lyapunov(A + B @ F, -B @ np.linalg.solve(R, B.T))
    except np.linalg.LinAlgError as error:
        raise DesignError(f"reduction: the controller has no coprime factors ({error}); keep its full order") from error
    right, left = _root((W + W.T) / 2), _root((X + X.T) / 2)
    U, values, Vt = np.linalg.svd(left.T @ right)
    order = min(order, int(np.count_nonzero(values > len(A) * EPS * values[0])))
    root = np.sqrt(values[:order])
    T, into = right @ Vt[:order].T / root, (left @ U[:, :order] / root).T
    return System(into @ A @ T, into @ B, C @ T, D)


def fitted(start: System, full: Loop, plant: System, make: Callable[[System], System], Ts: float) -> System:
    """The controller of `start`'s order whose loop comes closest to the S of `full`; D stays.

    Parameters
    ----------
    start : continuous controller, which may leave the loop unstable
    full : the loop to come close to, at its own frequencies
    plant : its sampled plant
    make : continuous controller -> sampled controller
    Ts : sampling time [s]
    """
    n, m, D = start.order, start.B.shape[1], start.D
    ends = np.cumsum([n * n, n * m])
    z, eye = np.exp(2j * np.pi * full.frequency * Ts), np.eye(len(full.So[0]))

    def system(x: np.ndarray) -> System:
        A, B, C = np.split(x, ends)
        return System(A.reshape(n, n), B.reshape(n, m), C.reshape(-1, n), D)

    def residual(x: np.ndarray) -> np.ndarray:
        try:
            made = make(system(x))
        except DesignError:  # a pole too fast for the samples
            return np.full(2 * full.So.size + 1, PENALTY)
        S = np.linalg.inv(eye - full.G @ response(made, z))
        error = (S - full.So).ravel()
        outside = max(float(np.abs(closed_poles(plant, made)).max()) - SAFE, 0.0)
        return np.concatenate([error.real, error.imag, [PENALTY * outside]])

    begin = np.concatenate([start.A.ravel(), start.B.ravel(), start.C.ravel()])
    return system(least_squares(residual, begin, x_scale="jac", max_nfev=PASSES).x)


def reduced(
    system: System,
    plant: System,
    make: Callable[[System], System],
    Ts: float,
    order: int | None,
    tolerance: float,
    accept: Callable[[System], bool] = lambda small: True,
) -> tuple[System, float]:
    """Reduced controller and the largest change of S, relative to its peak.

    Parameters
    ----------
    system : continuous controller
    plant : sampled plant of the loop that judges
    make : continuous controller -> sampled controller
    Ts : sampling time [s]
    order : order, or None for the smallest within the tolerance
    tolerance : largest change of S over its peak
    accept : whether a reduced continuous controller will do otherwise

    Raises
    ------
    DesignError
        If no order (or not the one asked for) gives a stable loop.
    """  # fmt: skip
    full = loop_of(plant, make(system), Ts)
    for n in range(1, system.order + 1) if order is None else [order]:
        best: tuple[System, float] | None = None
        for small in _candidates(system, n, plant, make, Ts, order is not None):
            made = make(small)
            if not decays(closed_poles(plant, made)) or not accept(small):
                continue
            change = float(largest(loop_of(plant, made, Ts).So - full.So).max() / full.peak)
            if change < tolerance:
                return small, change
            if best is None or change < best[1]:
                best = small, change
        if order is not None and best is not None:
            return best
    raise DesignError(f"reduction: order {order} makes the loop unstable; allow more states")


def _candidates(
    system: System, order: int, plant: System, make: Callable[[System], System], Ts: float, asked: bool
) -> Iterator[System]:
    """Controllers of an order, the cheapest first; no more than that of a stable one where no order is `asked` for."""
    if stable(system):
        yield truncated(system, order)
        if not asked:
            return
    axis = frequency_axis(Ts)[:: max(1, FREQUENCIES // LINES)]
    yield fitted(coprime_truncated(system, order), loop_of(plant, make(system), Ts, axis), plant, make, Ts)

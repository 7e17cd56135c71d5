r"""H-infinity mixed sensitivity at one operating point (thesis Papers B, E, F; eqs. E.13 to E.15, E.25).

.. math:: \min_K \left\| \begin{bmatrix} W_p S\\ W_u K S \end{bmatrix} \right\|_\infty

The optimal controller has poles far beyond the sampling rate; `backoff` times the optimal gamma is taken. Default
weights are the thesis'; see `rotorsim.control.designs.hinf_synthesis` for `force`.

The loop can be asked to stand a relative error of the model at the plant's input:

.. math:: u_{plant} = (I + \varepsilon \Delta) u, \quad \|\Delta\|_\infty \le 1, \qquad
          z_\Delta = \frac{\varepsilon}{d} u, \quad u_{plant} = u + d\, w_\Delta

A loop stands every such error while the norm of epsilon T_I is below one, T_I = K G (I - K G)^-1 (small gain). With the
scale d, which is the same at all frequencies, the norm of both blocks together is an upper bound of the structured
singular value: where it is gamma, the weights are met within gamma for errors up to epsilon/gamma.

The controller, stable or not, can be reduced. Its Hankel values predict little of its loop; the order is the smallest
whose S differs from the full one's, relative to the peak of the latter, by less than a tolerance, and whose loop is
stable.

A stable controller is truncated in balanced coordinates. One that is unstable, or whose truncation changes S too much,
begins as the truncation of its normalised coprime factors, K = N M^-1, which are stable whatever K is, and is fitted:

.. math:: \min_{K_r} \sum_k \| S_r(z_k) - S(z_k) \|_F^2

over frequencies up to Nyquist, with a penalty on poles of the loop outside `SAFE`.

Cites: doyle_1982, skogestad_2005, thesis, zhou_1996.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov
from scipy.optimize import least_squares, minimize_scalar

from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import EPS, decays
from rotorsim.base.units import KRPM, MPA
from rotorsim.control.designs.hinf_synthesis import (
    MILD,
    RIG,
    Bounds,
    Generalised,
    Weights,
    bounds,
    closed,
    controller,
    mixed_sensitivity,
)
from rotorsim.control.designs.specification import (
    Specification,
    count,
    delay_of,
    loop_delay,
    number,
    register,
    sampling_time,
    shaft_speed,
    supply_pressure,
)
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import discrete, proved_law
from rotorsim.control.plants import Model, axis_modes, check_modes, design_plant, point_text, sampled_plant
from rotorsim.control.sampled_loop import FREQUENCIES, Loop, closed_poles, frequency_axis, loop_of
from rotorsim.control.systems import (
    System,
    balanced_states,
    gramians,
    largest,
    peak_gain,
    response,
    stable,
    transformed,
)


@dataclass(frozen=True)
class HinfSpec(Specification):
    """Operating point, weights, order."""

    speed: float = shaft_speed(3 * KRPM)
    pressure: float = supply_pressure(0.5 * MPA)
    weights: Weights = field(default_factory=Weights)
    backoff: float = number(1.02, "1", "Factor on the optimal gamma; the optimum itself cannot be run.", low=1.001)
    delay: float | None = loop_delay(0.0)
    order: int | None = count(0, "Order of the reduced law; 0 keeps all states, None is judged by S.", low=0)
    tolerance: float = number(0.1, "1", "Change of S that a reduction may make.")
    uncertainty: float = number(
        0.0, "1", "Relative error of the model at its input that the loop stands; 0 for none.", low=0, high=0.99,
        example=0.3,
    )  # fmt: skip
    Ts: float = sampling_time()


Spec = HinfSpec
PRESETS = {"thesis": HinfSpec(), "rig": HinfSpec(weights=RIG, delay=None), "mild": HinfSpec(weights=MILD)}
"""'rig' and 'mild' are for the virtual rig and Model 2; see `rotorsim.control.designs.hinf_synthesis`."""
SCALES = (-3.0, 2.0)
"""Decades in which d [V] is sought."""
NEAR = (0.5, 1.5)
"""Frequencies over those of the modes between which models are compared."""
SAFE, PENALTY = 0.9985, 1e3
"""Radius of the loop's poles beyond which a fit is penalised, and by how much."""
LINES, PASSES = 160, 60
"""Frequencies of a fit and its most steps."""


@register("H-infinity mixed sensitivity at one operating point (B, E, F)")
def design(model: Model, spec: HinfSpec | None = None) -> Law:
    """The law, with `gamma` the norm that its controller was made for.

    Raises
    ------
    DesignError
        If no controller meets the weights (the message names the condition), the loop of the one found does not
        keep its gamma, a pole is too fast for Ts, or a mode cannot be moved or seen.
    """
    spec = spec or HinfSpec()
    plant = design_plant(model, spec.speed, spec.pressure, delay_of(spec))
    check_modes(plant, "hinf")
    P = mixed_sensitivity(plant, spec.weights)
    scale = None
    if spec.uncertainty:
        P, best, scale = scaled(P, plant, spec.uncertainty)
    else:
        best = bounds(P)
    gamma = spec.backoff * best.high
    K = controller(P, gamma)
    about = {"optimal_gamma": best.high, "reached": peak_gain(closed(P, K))}
    if scale is not None:
        about |= {"scale": scale, "norm_of_uncertain_loop": uncertain_loop_norm(plant, K, spec.uncertainty)}
        check_robust(about["norm_of_uncertain_loop"], spec.uncertainty)
    if best.high > 1.001 * best.low:
        about["optimal_gamma_at_least"] = best.low
    if spec.order != 0:
        sampled = sampled_plant(model, spec.speed, spec.pressure, spec.Ts)
        K, change = reduced(
            K, sampled, lambda k: discrete(k, spec.Ts), spec.Ts, spec.order, spec.tolerance,
            lambda k: isfinite(peak_gain(closed(P, k))),
        )  # fmt: skip
        about |= {"order": K.order, "change_of_S": change, "reached": peak_gain(closed(P, K))}
    return proved_law("hinf", model, discrete(K, spec.Ts), spec, gamma, about=about)


def uncertain(P: Generalised, plant: System, error: float, scale: float) -> Generalised:
    """The generalised plant with an error at the input of `plant`, whose states come first; its block comes first."""
    n, nw, nz = P.order, P.B1.shape[1], P.C1.shape[0]
    B = np.zeros((n, 2))
    B[: plant.order] = scale * plant.B
    return Generalised(
        P.A, np.hstack([B, P.B1]), P.B2, np.vstack([np.zeros((2, n)), P.C1]), P.C2,
        np.block([[np.zeros((2, 2 + nw))], [np.zeros((nz, 2)), P.D11]]),
        np.vstack([error / scale * np.eye(2), P.D12]), np.hstack([np.zeros((2, 2)), P.D21]),
    )  # fmt: skip


def scaled(P: Generalised, plant: System, error: float) -> tuple[Generalised, Bounds, float]:
    """The generalised plant at the scale with the smallest gamma, that gamma and the scale [V]."""

    def gamma(decade: float) -> float:
        return bounds(uncertain(P, plant, error, 10**decade), 1e-4).high

    found = minimize_scalar(gamma, bounds=SCALES, method="bounded", options={"xatol": 0.02})
    made = uncertain(P, plant, error, 10**found.x)
    return made, bounds(made), float(10**found.x)


def uncertain_loop_norm(plant: System, K: System, error: float) -> float:
    """Norm of epsilon T_I of a continuous loop with u = K y: below one it stands the error."""
    A = np.block([[plant.A + plant.B @ K.D @ plant.C, plant.B @ K.C], [K.B @ plant.C, K.A]])
    B = np.vstack([plant.B, np.zeros((K.order, 2))])
    C = np.hstack([K.D @ plant.C, K.C])
    return error * peak_gain(System(A, B, C, np.zeros((2, 2))))


def check_robust(norm: float, error: float) -> None:
    """Raise DesignError unless the norm of epsilon T_I is below one, which proves stability for every such error."""
    if not norm < 1:
        raise DesignError(
            f"hinf.uncertainty = {error:g}: the loop found stands {error / norm:.3g}; an uncertainty that is larger "
            "than what the model knows leaves nothing to control by: allow less, or weights that ask for less",
            argument="uncertainty",
            value=error,
        )


def uncertainty_between(model: Model, point: tuple[float, float], others: Any, delay: float = 0.0) -> float:
    """Largest relative error at the input, about the modes, of the model at a point as one for others.

    Parameters
    ----------
    model : LpvModel
        Identified model.
    point, others : (speed, pressure) and a sequence of such
        [rad/s], [Pa, gauge].
    delay : float
        Of the loop [s].

    Returns
    -------
    float
        Largest singular value of G^-1 (G_other - G) at 200 frequencies, half the lower to 1.5 times the higher mode.

    Examples
    --------
    >>> import rotorsim as rs
    >>> model = rs.load_model("model.json")
    >>> rs.control.uncertainty_between(model, (300.0, 0.5e6), [(300.0, 0.5e6)])
    0.0
    """
    speed, pressure = point
    here = design_plant(model, speed, pressure, delay)
    modes = axis_modes(here)
    omega = np.linspace(NEAR[0] * modes.min(), NEAR[1] * modes.max(), 200)
    G, worst = response(here, 1j * omega), 0.0
    for w, p in others:
        try:
            off = np.linalg.solve(G, response(design_plant(model, w, p, delay), 1j * omega) - G)
        except np.linalg.LinAlgError as error:
            raise DesignError(f"model: has no inverse about its modes at {point_text(*point)}") from error
        worst = max(worst, float(np.linalg.norm(off, 2, axis=(1, 2)).max()))
    return worst


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

    Raises DesignError if the Riccati equation of the factors has no solution.
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
    """The controller of `start`'s order whose loop with the sampled plant comes closest to the S of `full`; D stays.

    `start` may leave the loop unstable; `make` samples a continuous controller.
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
    """Reduced controller and the largest change of S, relative to its peak, in the loop with a sampled plant.

    `make` samples a controller; `order` None takes the smallest within the `tolerance` of that change; `accept` states
    whether a reduced controller will do otherwise. Raises DesignError if no order (or not the one asked for) gives a
    stable loop.
    """
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
    raise DesignError(
        f"reduction: order {order} makes the loop unstable; allow more states", argument="order", value=order
    )


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

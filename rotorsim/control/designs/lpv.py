r"""Grid-based LPV synthesis over speed and pressure (thesis Paper E), discretised by the trapezoidal rule (3.11).

Smallest gamma over the design grid first, from the inequality of Y alone, which is all that binds where X(q) exists,
else from both. Then, at `backoff` times it, the X(q), Y(q) that keep the largest margin in all inequalities, for what
lies between grid points; the controller follows from them by formula. Both matrices may depend on q, and
their rates are in the inequalities, at the corners of the box of `speed_rate` and `pressure_rate`; the controller is
not given them. The solver's word counts for nothing: the thesis' inequalities T1, T2 of the controller as it is built,
rates included, are checked by their eigenvalues on a fine grid, which also gives the gamma that is reported: while q
moves no faster, no disturbance is amplified by more. Gamma depends on `eps` and on the bound on X and Y, in the
balanced states.

The controller of a solution (X(q), Y(q), gamma) has D_K = 0; the two rows that hold B^ and C^ are stationary where

.. math:: \begin{bmatrix} 0 & D_{21} & 0\\ D_{21}^T & -\gamma I & D_{11}^T\\ 0 & D_{11} & -\gamma I\end{bmatrix}
          \begin{bmatrix} \hat B^T\\ *\\ * \end{bmatrix} = -\begin{bmatrix} C_2\\ B_1^T X\\ C_1 \end{bmatrix}, \quad
          \begin{bmatrix} 0 & D_{12}^T & 0\\ D_{12} & -\gamma I & D_{11}\\ 0 & D_{11}^T & -\gamma I\end{bmatrix}
          \begin{bmatrix} \hat C\\ *\\ * \end{bmatrix} = -\begin{bmatrix} B_2^T\\ C_1 Y\\ B_1^T \end{bmatrix}

and A^ cancels the (2, 1) block. Its states are those of the plant as estimated, N = -X and M' = Y - X^-1. It is not
given the rate of q: what it would add for that, X dY/dt + N dM'/dt, is -dX/dt X^-1 in these states, zero for a constant
X and small else (with M = I as in the thesis it is X dY/dt). T2 is checked with it.
Source: Gahinet (1996), explicit controller formulas for LMI-based synthesis; Apkarian, Adams (1998) for the rates.

Cites: apkarian_1998, gahinet_1996, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from rotorsim.base.display import Report, silent
from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import definite
from rotorsim.base.units import KRPM, MPA
from rotorsim.control.designs.hinf_synthesis import (
    MILD,
    RIG,
    Generalised,
    Weights,
    balance,
    mixed_sensitivity,
    rescaled,
)
from rotorsim.control.designs.lpv_problem import Solution, Sought, SynthesisGrid, scaled, synthesise
from rotorsim.control.designs.specification import (
    Specification,
    count,
    delay_of,
    loop_delay,
    number,
    register,
    sampling_time,
)
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import discrete, make_law, over_grid, table_axes
from rotorsim.control.plants import MILLI, Model, design_plant, point_text
from rotorsim.control.sampled_loop import check_loop
from rotorsim.control.systems import System


@dataclass(frozen=True)
class LpvSpec(Specification):
    """Thesis section E.3: weights, design grid; see the module for the rest.

    `order_X=2, order_Y=0` is the thesis' form: X(q) of second order, Y constant.
    """

    weights: Weights = field(default_factory=Weights)
    grid: tuple[int, int] = count((8, 8), "Speeds and pressures of the design grid, of those the model has.", low=2)
    order_X: int = count(
        1, "Order in speed and pressure of the Lyapunov matrix X(q) of estimation; 0: constant.", low=0
    )
    order_Y: int = count(2, "Order in speed and pressure of the Lyapunov matrix Y(q) of feedback; 0: constant.", low=0)
    speed_rate: float = number(60 * KRPM, "rad/s^2", "Largest rate of the speed that gamma is proved for.", above=0)
    pressure_rate: float = number(2 * MPA, "Pa/s", "Largest rate of the pressure that gamma is proved for.", above=0)
    backoff: float = number(1.03, "1", "Factor on the optimal gamma; the optimum itself cannot be run.", above=1)
    eps: float = number(1e-6, "1", "Margin by which the inequalities are strict.")
    bound: float = number(1e3, "1", "Bound on X and Y.")
    delay: float | None = loop_delay(0.0)
    validation: tuple[int, int] = count((17, 17), "Speeds and pressures of the check.", low=2)
    table: tuple[int, int] = count((13, 9), "Speeds and pressures of the law's table.", low=2)
    refresh: float = number(0.01, "s", "How often the law reads its table (the rig: 0.1 s).", above=0)
    Ts: float = sampling_time()


Spec = LpvSpec


class Designed(NamedTuple):
    """Result of a synthesis: the solution, the states' scale, the range of q, the smallest gamma."""

    solution: Solution
    scale: np.ndarray
    low: np.ndarray
    high: np.ndarray
    optimal: float


PRESETS = {"thesis": LpvSpec(), "rig": LpvSpec(weights=RIG, delay=None, backoff=1.02), "mild": LpvSpec(weights=MILD)}
"""'rig' and 'mild' are for the virtual rig and Model 2; see `rotorsim.control.designs.hinf_synthesis`."""


@register("LPV synthesis over speed and pressure (E)")
def design(model: Model, spec: LpvSpec | None = None, progress: Report = silent) -> Law:
    """The law, with `gamma` proved on the validation grid; `progress` is called with each step before it starts.

    Raises
    ------
    DesignError
        If the inequalities have no solution, the solution does not keep them on the validation grid (whatever the
        solver reported), a pole is too fast for Ts, or the sampled loop is unstable somewhere.
    """
    spec = spec or LpvSpec()
    speeds, pressures = table_axes(model, spec.table)
    made = synthesis(model, spec, progress)
    progress("proof on the validation grid")
    gamma = validated(model, spec, made, spec.validation)

    def at(speed: float, pressure: float) -> Generalised:
        return scaled_plant(model, spec, speed, pressure, made.scale)

    progress("table")
    grid = over_grid(speeds, pressures, lambda w, p: discrete(
        controller_at(at(w, p), made.solution, scaled(made.low, made.high, np.array([w, p]))), spec.Ts))  # fmt: skip
    about = {"optimal_gamma": made.optimal, "eps": spec.eps, "bound": spec.bound, "inside": made.solution.inside,
             "speed_rate": spec.speed_rate, "pressure_rate": spec.pressure_rate}  # fmt: skip
    law = make_law(
        "lpv", model, grid, speeds, pressures, spec, gamma, about=about, refresh=max(round(spec.refresh / spec.Ts), 1)
    )
    progress("stability over the range")
    check_loop(law, model, [(w, p) for w in made_axis(made, 0, 13) for p in made_axis(made, 1, 9)])
    return law


def synthesis(model: Model, spec: LpvSpec, progress: Report = silent) -> Designed:
    """Solve the inequalities over the design grid."""
    speeds, pressures = table_axes(model, spec.grid)
    check_grid(spec, len(speeds), len(pressures))
    points = [(w, p) for w in speeds for p in pressures]
    plants = [generalised(model, spec, w, p) for w, p in points]
    scale = balance(plants)
    low, high = np.array([speeds[0], pressures[0]]), np.array([speeds[-1], pressures[-1]])
    scaled_points = scaled(low, high, np.array(points))
    grid = SynthesisGrid(scaled_points, tuple(rescaled(P, scale) for P in plants), scaled_rates(spec, low, high))
    sought = Sought(spec.order_X, spec.order_Y, spec.eps, spec.bound)
    made = None
    if plants[0].D21.shape[0] == plants[0].D21.shape[1]:  # y shows all disturbances: Y's inequality binds alone
        best = synthesise(grid, replace(sought, feedback_only=True), progress=progress).gamma
        made = synthesise(grid, sought, spec.backoff * best, progress)
    if made is None or made.inside <= 0:  # the inequality of X binds too
        best = synthesise(grid, sought, progress=progress).gamma
        made = synthesise(grid, sought, spec.backoff * best, progress)
    if made.inside <= 0:
        raise DesignError(
            f"lpv: no X(q), Y(q) keep their inequalities at gamma = {made.gamma:.4g}; raise backoff or bound"
        )
    return Designed(made, scale, low, high, best)


def check_grid(spec: LpvSpec, *counts: int) -> None:
    """Raise DesignError if the design grid is one point, or has too few values for the order of X(q) and Y(q)."""
    if max(counts) == 1:
        raise DesignError(
            "lpv: the model holds for one operating point; take hinf there, or a model of several points",
            argument="model",
        )
    order = max(spec.order_X, spec.order_Y)
    for have, word in zip(counts, ("speeds", "pressures"), strict=True):
        if 1 < have <= order:
            raise DesignError(
                f"lpv.grid: {have} {word} do not determine an X(q) or Y(q) of order {order}; take {order + 1} or more, "
                "or lower order_X and order_Y",
                argument="grid",
                value=have,
            )


def scaled_rates(spec: LpvSpec, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Largest rates (2,) of q in [-1, 1]^2 per ms; zero for a coordinate with one value."""
    rates = np.array([spec.speed_rate, spec.pressure_rate]) / MILLI
    return np.where(high > low, rates / np.where(high > low, (high - low) / 2, 1.0), 0.0)


def validated(model: Model, spec: LpvSpec, made: Designed, size: tuple[int, int]) -> float:
    """Gamma that holds on a grid while q moves, by eigenvalues of T1 and T2; raises DesignError if none near does.

    The inequalities of a solution are kept for its gamma or, between the points it was made on, one a little higher.
    """
    speeds, pressures = made_axis(made, 0, size[0]), made_axis(made, 1, size[1])
    points = np.array([(w, p) for w in speeds for p in pressures])
    at = scaled(made.low, made.high, points)
    plants = [scaled_plant(model, spec, float(w), float(p), made.scale) for w, p in points]
    stacked = Generalised(*(np.array([getattr(P, name) for P in plants]) for name in Generalised._fields))
    T1 = separation(made.solution, at)
    if np.all(definite(T1)):
        for factor in (1.0, 1.001, 1.005, 1.02, 1.05):
            solution = replace(made.solution, gamma=made.solution.gamma * factor)
            if all(np.all(definite(-performance(stacked, solution, at, rate))) for rate in solution.corners):
                return solution.gamma
    T2 = [np.linalg.eigvalsh(performance(stacked, made.solution, at, rate))[:, -1] for rate in made.solution.corners]
    low, high = np.linalg.eigvalsh(T1)[:, 0], np.max(T2, axis=0)
    k = int(np.argmax(np.maximum(-low, high)))
    raise DesignError(
        f"lpv: the solver's solution breaks its inequalities at {point_text(*points[k])} "
        f"(T1 {low[k]:.2g}, T2 {high[k]:.2g}); take a finer grid, a larger backoff, lower rates or another bound",
        argument="rates",
        value=tuple(made.solution.rates),
    )


def generalised(model: Model, spec: LpvSpec, speed: float, pressure: float) -> Generalised:
    """The generalised plant at an operating point."""
    return mixed_sensitivity(design_plant(model, speed, pressure, delay_of(spec)), spec.weights)


def scaled_plant(model: Model, spec: LpvSpec, speed: float, pressure: float, scale: np.ndarray) -> Generalised:
    """The same in the balanced states."""
    return rescaled(generalised(model, spec, speed, pressure), scale)


def made_axis(made: Designed, index: int, count: int) -> np.ndarray:
    """Speeds (0) or pressures (1) over the range of the design."""
    return np.linspace(made.low[index], made.high[index], count)


class Hats(NamedTuple):
    """A^, B^, C^ of thesis eq. (E.18); D_K is zero."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray


def _t(M: np.ndarray) -> np.ndarray:
    return np.swapaxes(M, -1, -2)


def _like(M: np.ndarray, many: tuple[int, ...]) -> np.ndarray:
    """A constant matrix for each of many points."""
    return np.broadcast_to(M, (*many, *M.shape[-2:]))


def hats(P: Generalised, X: np.ndarray, Y: np.ndarray, gamma: float) -> Hats:
    """A^, B^, C^ at one operating point, or at many if the matrices of P and X are stacked (..., n, n)."""
    B = _t(_row(P.D21, P.D11, gamma, P.C2, _t(P.B1) @ X, P.C1))
    C = _row(_t(P.D12), _t(P.D11), gamma, _t(P.B2), P.C1 @ Y, _t(P.B1))
    low = np.concatenate([_t(X @ P.B1 + B @ P.D21), P.C1], axis=-2)
    right = np.concatenate([_t(P.B1), P.C1 @ Y + P.D12 @ C], axis=-2)
    nw, nz, many = P.B1.shape[-1], P.C1.shape[-2], P.A.shape[:-2]
    Delta = np.block(
        [[_like(gamma * np.eye(nw), many), -_t(P.D11)], [-P.D11, _like(gamma * np.eye(nz), many)]]
    )  # fmt: skip
    A = -(_t(P.A) + _t(low) @ np.linalg.solve(Delta, right))
    return Hats(A, B, C)


def _row(D: np.ndarray, D11: np.ndarray, gamma: float, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """First rows of the solution of one of the two systems."""
    k, m = D.shape[-2:]
    p, many = D11.shape[-2], D.shape[:-2]
    left = np.block(
        [
            [_like(np.zeros((k, k)), many), D, _like(np.zeros((k, p)), many)],
            [_t(D), _like(-gamma * np.eye(m), many), _t(D11)],
            [_like(np.zeros((p, k)), many), D11, _like(-gamma * np.eye(p), many)],
        ]
    )
    return np.asarray(-np.linalg.solve(left, np.concatenate([a, b, c], axis=-2))[..., :k, :])


def controller_at(P: Generalised, solution: Solution, point: np.ndarray) -> System:
    """The controller at a scaled operating point (thesis eq. E.24), in the states of the plant."""
    X, Y = solution.X.at(point), solution.Y.at(point)
    hat = hats(P, X, Y, solution.gamma)
    inner = hat.A - X @ P.A @ Y - hat.B @ P.C2 @ Y - X @ P.B2 @ hat.C
    right = np.vstack([inner, hat.C]) @ np.linalg.solve(X @ Y - np.eye(P.order), X)  # M'^-1 = (X Y - I)^-1 X
    n = P.order
    left = -np.linalg.solve(X, np.hstack([right[:n], hat.B]))
    return System(left[:, :n], left[:, n:], right[n:], np.zeros((P.B2.shape[1], P.C2.shape[0])))


def separation(solution: Solution, points: np.ndarray) -> np.ndarray:
    """T1 (k, ., .) of thesis eq. (E.18), positive definite where I - X Y is regular, at scaled points (k, 2)."""
    X, Y = solution.X.at(points), solution.Y.at(points)
    eye = _like(np.eye(X.shape[-1]), X.shape[:-2])
    return np.block([[X, eye], [eye, Y]])


def performance(P: Generalised, solution: Solution, points: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """T2 (k, ., .) of thesis eq. (E.18) with the rates of X and Y, negative definite where the loop keeps gamma.

    Of the controller that `controller_at` builds, at scaled points (k, 2) that move at `rate` (2,) [1/ms]. The matrices
    of P are stacked over the points, (k, n, n) and so on.
    """
    X, Y, g = solution.X.at(points), solution.Y.at(points), solution.gamma
    dX, dY = solution.X.rate(points, rate), solution.Y.rate(points, rate)
    hat = hats(P, X, Y, g)
    many = P.A.shape[:-2]
    a, b = X @ P.A + hat.B @ P.C2, P.A @ Y + P.B2 @ hat.C
    c, d = _t(X @ P.B1 + hat.B @ P.D21), P.C1 @ Y + P.D12 @ hat.C
    nw, nz = P.B1.shape[-1], P.C1.shape[-2]
    cross = _t(hat.A) + P.A + np.linalg.solve(X, dX)  # the last is what the controller does not add
    return np.block(
        [
            [a + _t(a) + dX, _t(cross), _t(c), _t(P.C1)],
            [cross, b + _t(b) - dY, P.B1, _t(d)],
            [c, _t(P.B1), _like(-g * np.eye(nw), many), _t(P.D11)],
            [P.C1, d, P.D11, _like(-g * np.eye(nz), many)],
        ]
    )

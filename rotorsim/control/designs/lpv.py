r"""Grid-based LPV synthesis over speed and pressure (thesis Paper E), discretised by the trapezoidal rule (3.11).

Smallest gamma over the design grid first, from the inequality of Y alone, which is all that binds where X(q) exists,
else from both. Then, at `backoff` times it, the X(q), Y(q) that keep the largest margin in all inequalities, for what
lies between grid points; the controller follows from them by formula. Both matrices may depend on q, and
their rates are in the inequalities, at the corners of the box of `speed_rate` and `pressure_rate`; the controller is
not given them. The solver's word counts for nothing: the thesis' inequalities T1, T2 of the controller as it is built,
rates included, are checked by their eigenvalues on a fine grid, which also gives the gamma that is reported: while q
moves no faster, no disturbance is amplified by more. Gamma depends on `eps` and on the bound on X and Y, in the
balanced states.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from rotorsim.base.constants import KRPM, MPA
from rotorsim.base.display import Report, silent
from rotorsim.base.rounding import definite
from rotorsim.control.designs.hinf_synthesis import balance, rescaled
from rotorsim.control.designs.lpv_controller import Solution, controller_at, performance, separation
from rotorsim.control.designs.lpv_problem import Sought, SynthesisGrid, synthesise
from rotorsim.control.designs.specification import (
    Specification,
    count,
    delay_of,
    loop_delay,
    number,
    register,
    sampling_time,
)
from rotorsim.control.designs.weighted_plant import MILD, RIG, Generalised, Weights, mixed_sensitivity
from rotorsim.control.errors import DesignError
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import discrete, make_law, over_grid, table_axes
from rotorsim.control.plants import MILLI, Model, design_plant, point_text
from rotorsim.control.sampled_loop import check_loop


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


PRESETS = {
    "thesis": LpvSpec(),
    "rig": LpvSpec(weights=RIG, delay=None, backoff=1.02),
    "mild": LpvSpec(weights=MILD),
}
"""'rig' and 'mild' are for the virtual rig and Model 2; see `rotorsim.control.designs.weighted_plant`."""


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
        controller_at(at(w, p), made.solution, scaled_point(made, w, p)), spec.Ts))  # fmt: skip
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
    scaled = np.array([_scaled(low, high, w, p) for w, p in points])
    grid = SynthesisGrid(scaled, tuple(rescaled(P, scale) for P in plants), scaled_rates(spec, low, high))
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
        raise DesignError("lpv: the model holds for one operating point; take hinf there, or a model of several points")
    order = max(spec.order_X, spec.order_Y)
    for have, word in zip(counts, ("speeds", "pressures"), strict=True):
        if 1 < have <= order:
            raise DesignError(
                f"lpv.grid: {have} {word} do not determine an X(q) or Y(q) of order {order}; take {order + 1} or more, "
                "or lower order_X and order_Y"
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
    scaled = np.array([scaled_point(made, *q) for q in points])
    plants = [scaled_plant(model, spec, float(w), float(p), made.scale) for w, p in points]
    stacked = Generalised(*(np.array([getattr(P, name) for P in plants]) for name in Generalised._fields))
    T1 = separation(made.solution, scaled)
    if np.all(definite(T1)):
        for factor in (1.0, 1.001, 1.005, 1.02, 1.05):
            solution = replace(made.solution, gamma=made.solution.gamma * factor)
            if all(np.all(definite(-performance(stacked, solution, scaled, rate))) for rate in solution.corners):
                return solution.gamma
    T2 = [
        np.linalg.eigvalsh(performance(stacked, made.solution, scaled, rate))[:, -1] for rate in made.solution.corners
    ]
    low, high = np.linalg.eigvalsh(T1)[:, 0], np.max(T2, axis=0)
    k = int(np.argmax(np.maximum(-low, high)))
    raise DesignError(
        f"lpv: the solver's solution breaks its inequalities at {point_text(*points[k])} "
        f"(T1 {low[k]:.2g}, T2 {high[k]:.2g}); take a finer grid, a larger backoff, lower rates or another bound"
    )


def generalised(model: Model, spec: LpvSpec, speed: float, pressure: float) -> Generalised:
    """The generalised plant at an operating point."""
    return mixed_sensitivity(design_plant(model, speed, pressure, delay_of(spec)), spec.weights)


def scaled_plant(model: Model, spec: LpvSpec, speed: float, pressure: float, scale: np.ndarray) -> Generalised:
    """The same in the balanced states."""
    return rescaled(generalised(model, spec, speed, pressure), scale)


def scaled_point(made: Designed, speed: float, pressure: float) -> np.ndarray:
    """q in [-1, 1]^2."""
    return _scaled(made.low, made.high, speed, pressure)


def made_axis(made: Designed, index: int, count: int) -> np.ndarray:
    """Speeds (0) or pressures (1) over the range of the design."""
    return np.linspace(made.low[index], made.high[index], count)


def _scaled(low: np.ndarray, high: np.ndarray, speed: float, pressure: float) -> np.ndarray:
    half = np.where(high > low, (high - low) / 2, 1.0)
    return (np.array([speed, pressure]) - (low + high) / 2) / half


__all__ = ["Spec", "Weights", "design", "synthesis", "validated"]

r"""Plausibility limits and predictors of a law from the model that it was designed on.

Predictors are Kalman filters of the sampled model with a position at rest that drifts.

Cites: astrom_1997.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.errors import ModelError
from identification.lpv.model import LpvModel
from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.control.designs.plants import Model, frozen, second_order, short_held_plant
from rotorsim.control.errors import DesignError
from rotorsim.control.numerics.systems import System
from rotorsim.control.plausibility import Plausibility, Predictors
from rotorsim.control.riccati import sampled_riccati

FORCE, NOISE, DRIFT = 0.3, 0.33, 0.02
"""Standard deviations that the predictors expect, a sample: disturbance of the velocities [um/ms], noise of the sensors
[um], drift of the position [um]."""
POINTS = 3
"""Speeds and pressures of the predictors' table over the range of a model."""
BEYOND = (1000 * np.pi / 30, 0.1e6)
"""Speed [rad/s] and pressure [Pa] beyond those of a model up to which it is believed at least."""
FASTEST = 2.0
"""A rotor swings at most at so many times its highest mode."""


def plausibility_of(model: Model, Ts: float = RIG_SAMPLE, limit: float = 5.0, scheduled: bool = False) -> Plausibility:
    """Limits and predictors from an identified model.

    The range is twice what a reference of `limit` [V] moves the disc at rest, the jump what a swing of that amplitude
    at twice the highest mode makes in a sample. Speed and pressure (of a `scheduled` law) may be half the model's range
    outside it; a speed may jump as far, a pressure over the whole range. The predictors are believed a quarter of the
    range beyond it, 1000 rpm and 0.1 MPa at least. A model of another kind than designs take gives no limits.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.plausibility_of(rs.load_model("model.json")).predictors.order
    8
    """
    point = _range(model)[0]
    low, high = np.nan_to_num(_range(model))
    speeds, pressures = _axis(low[0], high[0]), _axis(low[1], high[1])
    try:
        plants = [[short_held_plant(model, w, p, Ts) for p in pressures] for w in speeds]
    except (DesignError, ModelError):
        return Plausibility()
    flat = [plant for row in plants for plant in row]
    reach = 2 * limit * 1e-6 * max(float(np.linalg.norm(_at_rest(plant), 2)) for plant in flat)
    swing = 2 * np.sin(min(FASTEST * max(_highest(plant) for plant in flat) / 2, np.pi / 2))
    half = (high - low) / 2
    limits: dict[str, Any] = {"range": reach, "jump": float(reach * swing)}
    for k, name in enumerate(("speed", "pressure")):
        if half[k] > 0 and scheduled:
            limits |= {name: (low[k] - half[k], high[k] + half[k]), f"{name}_jump": 1.1 * (1 + k) * half[k]}
        if np.isfinite(point[k]):
            beyond = max(half[k] / 2, BEYOND[k])
            limits |= {f"model_{name}": (low[k] - beyond, high[k] + beyond)}
    return Plausibility(**limits, predictors=_predictors(model, plants, speeds, pressures))


def _range(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest (2,) speed and pressure of a model; NaN where it does not know its point."""
    if isinstance(model, LpvModel):
        return np.array(model.low, float), np.array(model.high, float)
    point = np.array([model.speed, model.pressure], float)
    return point, point


def _axis(low: float, high: float) -> np.ndarray:
    return np.linspace(low, high, POINTS) if high > low else np.array([low])


def _at_rest(plant: System) -> np.ndarray:
    return np.asarray(plant.C @ np.linalg.solve(np.eye(plant.order) - plant.A, plant.B))


def _highest(plant: System) -> float:
    """Angle [rad a sample] of the fastest oscillating pole that is not strongly damped."""
    poles = np.linalg.eigvals(plant.A).astype(complex)
    poles = np.log(poles[np.abs(poles) > 1e-9])
    modes = poles[(poles.imag > 0) & (-poles.real < 0.6 * np.abs(poles))]
    return float(np.abs(modes).max(initial=0.1))


def _predictors(model: Model, plants: Any, speeds: np.ndarray, pressures: np.ndarray) -> Predictors | None:
    velocities = second_order(frozen(model, float(speeds[0]), float(pressures[0])).A)
    try:
        rows = [[_predictor(plant, velocities) for plant in row] for row in plants]
    except DesignError:
        return None
    A, B, C, gain, weights = (np.array([[one[k] for one in row] for row in rows]) for k in range(5))
    return Predictors(A, B, C, gain, weights, speeds, pressures)


def _predictor(plant: System, velocities: bool) -> tuple[np.ndarray, ...]:
    """A, B, C, gain and weights of the Kalman predictor of a sampled plant [um, V] with a drifting position."""
    n = plant.order
    A, B = np.eye(n + 2), np.vstack([plant.B, np.zeros((2, 2))])
    A[:n, :n] = plant.A
    C = np.hstack([plant.C, np.eye(2)])
    Q = 1e-9 * np.eye(n + 2)
    if velocities:
        Q[2:4, 2:4] += FORCE**2 * np.eye(2)
    else:
        Q[:n, :n] += plant.B @ plant.B.T
    Q[n:, n:] += DRIFT**2 * np.eye(2)
    noise = NOISE**2 * np.eye(2)
    P = sampled_riccati(A.T, C.T, Q, noise, "plausibility: the model has no Kalman predictor")
    S = C @ P @ C.T + noise
    inverse = np.linalg.inv(S)
    return A, B, C, A @ P @ C.T @ inverse, np.array([inverse[0, 0], inverse[0, 1], inverse[1, 1]])

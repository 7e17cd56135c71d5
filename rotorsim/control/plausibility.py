"""Plausibility limits and predictors of a law: as its file holds them, and from the model that it was designed on.

Predictors are Kalman filters of the sampled model with a position at rest that drifts.

Cites: astrom_1997.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np

from identification.lpv_model import LpvModel
from rotorsim.base.errors import DesignError, LawError, ModelError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.guard import LIMITS
from rotorsim.control.plants import Model, frozen, second_order, short_held_plant
from rotorsim.control.systems import System, sampled_riccati

PAIRS = ("speed", "pressure", "model_speed", "model_pressure")
"""Limits with two ends."""
NONE = 1e300
"""A limit that nothing exceeds."""


@dataclass(frozen=True, eq=False)
class Predictors:
    """Kalman predictors of the displacement [um] from the output [V], over speeds and pressures.

    A (s, p, n, n), B (s, p, n, 2), C (s, p, 2, n), gain (s, p, n, 2), weights (s, p, 3): xx, xy, yy of the inverse
    covariance of the prediction error [1/um^2]; the last two states are the position at rest. speeds (s,) [rad/s],
    pressures (p,) [Pa, gauge].

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.control.plausibility_of(rs.load_model("model.json")).predictors
    >>> isinstance(found, rs.control.Predictors)
    True
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    gain: np.ndarray
    weights: np.ndarray
    speeds: np.ndarray
    pressures: np.ndarray

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.A.shape[-1])

    @property
    def table(self) -> np.ndarray:
        """All numbers as one flat array, block after block."""
        s, p = len(self.speeds), len(self.pressures)
        parts = [np.reshape(getattr(self, name), (s, p, -1)) for name in ("A", "B", "C", "gain", "weights")]
        return np.concatenate(parts, axis=2).ravel()


@dataclass(frozen=True, eq=False)
class Plausibility:
    """Limits beyond which a law takes a sample for bad.

    Parameters
    ----------
    jump : float
        Largest change of the displacement from one sample to the next [m].
    range : float
        Largest displacement from the centre along x or y [m].
    stuck : int
        So many samples of exactly one value are a frozen sensor, if it had noise when the law began.
    speed, pressure : (float, float)
        Smallest and largest, of a law that is scheduled over it [rad/s], [Pa, gauge].
    speed_jump, pressure_jump : float
        Largest change from one sample to the next [rad/s], [Pa].
    evidence : float
        Likelihood ratio, of Student's t without its power, at which sensors are taken for reversed or swapped.
    model_speed, model_pressure : (float, float)
        Where the predictors' model holds: elsewhere nothing counts as evidence [rad/s], [Pa, gauge].
    predictors : Predictors or None
        Without them reversed and swapped sensors are found by jump and range alone.

    Raises
    ------
    LawError
        For limits that are not positive, or ranges that do not ascend.

    Examples
    --------
    >>> from rotorsim.control import Plausibility
    >>> Plausibility(range=20e-6).range
    2e-05
    """

    jump: float = float("inf")
    range: float = float("inf")
    stuck: int = 100
    speed: tuple[float, float] = (-float("inf"), float("inf"))
    speed_jump: float = float("inf")
    pressure: tuple[float, float] = (-float("inf"), float("inf"))
    pressure_jump: float = float("inf")
    evidence: float = 1e10
    model_speed: tuple[float, float] = (-float("inf"), float("inf"))
    model_pressure: tuple[float, float] = (-float("inf"), float("inf"))
    predictors: Predictors | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in ("jump", "range", "stuck", "speed_jump", "pressure_jump"):
            if not getattr(self, name) > 0:
                raise LawError(f"law: plausibility {name} = {getattr(self, name)}; give a positive limit")
        if not self.evidence > 1:
            raise LawError(f"law: plausibility evidence = {self.evidence}; give a ratio above 1, e.g. 1e10")
        for name in PAIRS:
            low, high = getattr(self, name)
            if not low < high:
                raise LawError(f"law: plausibility {name} = {low:g} to {high:g}; give the lower limit first")

    @property
    def limits(self) -> np.ndarray:
        """Limits in the order of the table; 1e300 for none."""
        values = asdict(replace(self, predictors=None))
        for name in PAIRS:
            values[f"{name}_low"], values[f"{name}_high"] = getattr(self, name)
        return np.clip([float(values[name]) for name in LIMITS], -NONE, NONE)

    @property
    def text(self) -> str:
        """Limits of the displacement in readable form."""
        signs = "" if self.predictors is None else ", signs of the sensors"
        return f"within {self.range * 1e6:.3g} um of the centre, {self.jump * 1e6:.3g} um a sample{signs}"

    @property
    def table(self) -> np.ndarray:
        """Limits, then the predictors' blocks."""
        return self.limits if self.predictors is None else np.concatenate([self.limits, self.predictors.table])

    @property
    def axes(self) -> np.ndarray:
        """Speeds and pressures of the predictors' table."""
        return np.zeros(0) if self.predictors is None else np.concatenate([
            self.predictors.speeds, self.predictors.pressures])  # fmt: skip

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Order, speeds and pressures of the predictors."""
        found = self.predictors
        return (0, 1, 1) if found is None else (found.order, len(found.speeds), len(found.pressures))

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for JSON; None for no limit."""
        data = asdict(self)
        for name, value in data.items():
            if name in PAIRS:
                data[name] = [number if np.isfinite(number) else None for number in value]
            elif name != "predictors" and not np.isfinite(value):
                data[name] = None
        if self.predictors is not None:
            data["predictors"] = {key: np.asarray(value).tolist() for key, value in data["predictors"].items()}
        return data

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Plausibility:
        """The limits of `to_dict`; raises LawError for unknown names and for limits that are not numbers."""
        if not isinstance(data, dict):
            raise LawError(f"law: plausibility = {data!r}; give limits by name, or null for none")
        known = {one.name for one in fields(cls)}
        if unknown := sorted(set(data) - known):
            raise LawError(f"law: plausibility has no '{unknown[0]}'; it knows {', '.join(sorted(known))}")
        given: dict[str, Any] = {key: _limit(key, value) for key, value in data.items() if key != "predictors"}
        if data.get("predictors"):
            given["predictors"] = Predictors(**{k: np.array(v, float) for k, v in data["predictors"].items()})
        return cls(**given)


def _limit(name: str, value: Any) -> float | tuple[float, float]:
    """A limit of a file, null for none; raises LawError unless it is one number, or a pair of them."""
    pair = name in PAIRS
    ends = [None, None] if pair and value is None else value if pair else [value]
    if not (isinstance(ends, (list, tuple)) and len(ends) == 1 + pair and all(map(_numeric, ends))):
        what = "two numbers" if pair else "a number"
        raise LawError(f"law: plausibility {name} = {value!r}; give {what} in SI units, or null for no limit")
    found = [
        sign * np.inf if end is None else float(end) for end, sign in zip(ends, (-1, 1)[-len(ends) :], strict=True)
    ]
    return (found[0], found[1]) if pair else found[0]


def _numeric(value: Any) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


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
    at_rest = [plant.C @ np.linalg.solve(np.eye(plant.order) - plant.A, plant.B) for plant in flat]
    reach = 2 * limit * 1e-6 * max(float(np.linalg.norm(gain, 2)) for gain in at_rest)
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

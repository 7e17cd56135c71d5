"""Plausibility limits of a law and predictors of the displacement, as its file holds them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np

from rotorsim.control.errors import LawError
from rotorsim.control.runtime.plausibility import LIMITS

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
        """Limits of the displacement for people."""
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

"""Scalar results of an operating point as calibration targets; modes assigned to x or y by their motion."""

from __future__ import annotations

from functools import lru_cache

from rotorsim.analysis.lift_off import lift_off
from rotorsim.analysis.point import operating_point
from rotorsim.analysis.whirl_onset import whirl_onset
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant

AXES = ("x", "y")
UNITS = (
    {f"wn_{a}": "rad/s" for a in AXES}
    | {f"zeta_{a}": "1" for a in AXES}
    | {f"delay_{a}": "s" for a in AXES}
    | {f"gain_{a}{b}": "m/V" for a in AXES for b in AXES}
    | {"eccentricity_ratio": "1", "h_min": "m", "mass_flow": "kg/s", "lift_off": "Pa", "whirl_onset": "rad/s"}
)
"""Quantities with their SI units; gain_xy is disc x per volt of reference y."""
BARE = ("lift_off", "whirl_onset")
"""Figures of no single operating point: lift-off of the speed, whirl onset of the pressure."""


def axis_modes(model: LinearPlant) -> tuple[int, int]:
    """Number of the mode that moves x and of the one that moves y; in order of frequency when both are one."""
    first = model.mode_of_axis(0), model.mode_of_axis(1)
    return first if first[0] != first[1] else (0, 1)


def figures(plant: Plant, speed: float, pressure: float) -> dict[str, float]:
    """All figures of an operating point, those of modes NaN where a mode may be missing; raises NoLiftOffError."""
    point = operating_point(plant, speed, pressure, (0.0,))
    model, found = point.model, {}
    for axis, mode in zip(AXES, axis_modes(model), strict=True):
        wn, zeta = (float(each[mode]) if model.proven else float("nan") for each in (model.wn, model.zeta))
        found |= {f"wn_{axis}": wn, f"zeta_{axis}": zeta}
    for i, a in enumerate(AXES):
        found[f"delay_{a}"] = float(model.delay[i])
        found |= {f"gain_{a}{b}": float(model.static_gain[i, j]) for j, b in enumerate(AXES)}
    rest = point.equilibrium
    return found | {
        "eccentricity_ratio": rest.eccentricity_ratio,
        "h_min": rest.h_min,
        "mass_flow": float(rest.mass_flow.sum()),
    }


@lru_cache(maxsize=64)
def bare(plant: Plant, quantity: str, speed: float, pressure: float) -> float:
    """A figure of no single operating point."""
    if quantity == "lift_off":
        return float(lift_off(plant, [speed])[0])
    return float(whirl_onset(plant, [pressure])["onset_speed"][0])

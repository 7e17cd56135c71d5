"""Analysis of one operating point: equilibrium, modes, static gains, delays, film coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsim.base.errors import NoLiftOffError
from rotorsim.plant import Plant
from rotorsim.plant.equilibrium import Equilibrium, describe, settle
from rotorsim.plant.linearise import LinearPlant, linearise

MODES = 4
"""Modes that are kept: those next to the first critical speeds."""
AT = ("static", "mode 1", "mode 2")
"""Where K(omega) and C(omega) are read when no frequencies are given."""


@dataclass(frozen=True, eq=False)
class Point:
    """Equilibrium, linear model, and K, C (n, 2, 2) [N/m, N s/m] of the film at the whirl frequencies `at` [rad/s]."""

    equilibrium: Equilibrium
    model: LinearPlant
    at: np.ndarray
    K: np.ndarray
    C: np.ndarray


def operating_point(plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None = None) -> Point:
    """The machine at `speed` [rad/s] and gauge `pressure` [Pa]; frequencies [rad/s] default to 0 and the two modes.

    Raises NoLiftOffError where the film does not carry the rotor.

    Examples
    --------
    >>> import rotorsim as rs
    >>> point = rs.analysis.operating_point(plant, 300.0, 0.5e6)
    """
    a = plant.assembly
    w = settle(a, speed, pressure)
    model = linearise(a, w, speed)
    at = np.array([0.0, *model.wn[:2]] if frequencies is None else frequencies, float)
    if a.film_model is None:
        K = C = np.full((len(at), 2, 2), np.nan)
    else:
        K, C = (np.stack(part) for part in zip(*(model.response.coefficients(float(o)) for o in at), strict=True))
    return Point(describe(a, w), model, at, K, C)


def numbers(plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None) -> dict[str, np.ndarray]:
    """Values of a map at one point; without lift-off only `lifted` = 0."""
    try:
        point = operating_point(plant, speed, pressure, frequencies)
    except NoLiftOffError:
        return {"lifted": np.array(0.0)}
    rest, model = point.equilibrium, point.model
    return {
        "lifted": np.array(1.0),
        "eccentricity_ratio": np.array(rest.eccentricity_ratio),
        "h_min": np.array(rest.h_min),
        "journal": rest.journal,
        "disc": rest.disc,
        "film_force": rest.force,
        "mass_flow": rest.mass_flow,
        "wn": padded(model.wn),
        "zeta": padded(model.zeta),
        "whirl_ratio": padded(model.whirl_ratio),
        "zeta_least": np.array(model.zeta.min() if model.zeta.size else np.nan),
        "static_gain": model.static_gain,
        "delay": model.delay,
        "film_frequency": point.at,
        "film_stiffness": point.K,
        "film_damping": point.C,
    }


def padded(values: np.ndarray) -> np.ndarray:
    """The first `MODES` values; NaN where there are fewer."""
    out = np.full(MODES, np.nan)
    out[: min(len(values), MODES)] = values[:MODES]
    return out

"""Analysis of one operating point: equilibrium, modes, static gains, delays, film coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsim.base.display import Card, Shown, several
from rotorsim.base.errors import NoLiftOffError
from rotorsim.plant import Plant
from rotorsim.plant.equilibrium import Equilibrium, describe, settle
from rotorsim.plant.linearise import LinearPlant, linearise

MODES = 4
"""Modes that are kept: the lowest."""
AT = ("static", "mode 1", "mode 2")
"""Frequencies at which K(omega) and C(omega) are read when none are given."""


@dataclass(frozen=True, eq=False, repr=False)
class OperatingPoint(Shown):
    """Equilibrium, linear model, and K, C (n, 2, 2) [N/m, N s/m] of the film at the whirl frequencies `at` [rad/s].

    Of several films (n, 2 films, 2 films), one after the other.
    """

    equilibrium: Equilibrium
    model: LinearPlant
    at: np.ndarray
    K: np.ndarray
    C: np.ndarray

    def card(self) -> Card:
        """Modes, then what the equilibrium shows."""
        rest = self.equilibrium.card()
        rows = [(f"modes [Hz]{'' if self.model.proven else ', perhaps not all'}",
                 several(self.model.wn, scale=1 / (2 * np.pi))),
                ("damping ratios", several(self.model.zeta, ".3g")), *rest.rows]  # fmt: skip
        return Card(rest.title.replace("Equilibrium", "Operating point"), rows)


def operating_point(
    plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None = None
) -> OperatingPoint:
    """The machine at `speed` [rad/s] and gauge `pressure` [Pa]; frequencies [rad/s] default to 0 and the two modes.

    Raises NoLiftOffError where the film does not carry the rotor.

    Examples
    --------
    >>> import rotorsim as rs
    >>> point = rs.analysis.operating_point(plant, 300.0, 0.5e6)
    """
    return _point(plant, speed, pressure, frequencies, None)


def _point(
    plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None, model: LinearPlant | None
) -> OperatingPoint:
    """The point with its linear model, where that is known already."""
    a = plant.assembly
    w = settle(a, speed, pressure)
    model = model or linearise(a, w, speed)
    at = np.array([0.0, *model.wn[:2]] if frequencies is None else frequencies, float)
    if a.film_model is None:
        K = C = np.full((len(at), 2, 2), np.nan)
    else:
        K, C = (np.stack(part) for part in zip(*(model.response.coefficients(float(o)) for o in at), strict=True))
    return OperatingPoint(describe(a, w), model, at, K, C)


def numbers(
    plant: Plant,
    speed: float,
    pressure: float,
    frequencies: Sequence[float] | None,
    model: LinearPlant | None,
) -> dict[str, np.ndarray]:
    """Values of a map at one point; without lift-off only `lifted` = 0."""
    try:
        point = _point(plant, speed, pressure, frequencies, model)
    except NoLiftOffError:
        return {"lifted": np.array(0.0)}
    rest, model = point.equilibrium, point.model
    several = len(rest.journals) > 1
    ratio = rest.eccentricity_ratios.max() if several else rest.eccentricity_ratio
    return {
        "lifted": np.array(1.0),
        "eccentricity_ratio": np.array(ratio),
        "h_min": np.array(rest.h_min),
        "journal": rest.journals if several else rest.journal,
        "disc": rest.disc,
        "film_force": rest.forces if several else rest.force,
        "mass_flow": rest.mass_flow,
        "wn": padded(model.wn),
        "zeta": padded(model.zeta),
        "whirl_ratio": padded(model.whirl_ratio),
        "proven": np.array(float(model.proven)),
        "static_gain": model.static_gain,
        "delay": model.delay,
        "film_frequency": point.at,
        "film_stiffness": by_film(point.K) if several else point.K,
        "film_damping": by_film(point.C) if several else point.C,
    }


def by_film(values: np.ndarray) -> np.ndarray:
    """Coefficients (n, films, 2, 2) of each film out of those of all (n, 2 films, 2 films); films do not couple."""
    return np.stack([values[:, k : k + 2, k : k + 2] for k in range(0, values.shape[1], 2)], axis=1)


def padded(values: np.ndarray) -> np.ndarray:
    """The first `MODES` values; NaN where there are fewer."""
    out = np.full(MODES, np.nan)
    out[: min(len(values), MODES)] = values[:MODES]
    return out

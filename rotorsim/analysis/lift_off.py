"""The lowest supply pressure at which the film carries the rotor, at each speed, by bisection of the equilibrium."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorsim.analysis.axes import checked
from rotorsim.errors import DataError, NoLiftOffError
from rotorsim.plant import Plant

HIGHEST = 2e6
"""Gauge pressure [Pa] up to which is looked."""
EXACT = 0.5e3
"""Width [Pa] of the last bracket."""


def lift_off(
    plant: Plant, speeds: Sequence[float] | np.ndarray, highest: float = HIGHEST, least_film: float = 0.0
) -> np.ndarray:
    """Lift-off pressures (n_speed,) [Pa, gauge]; 0 where speed alone carries, NaN where `highest` does not.

    Carried is a rotor with an equilibrium and at least `least_film` [m] left; a turning shaft rides on very thin films.
    Takes it that more pressure carries more. Raises DataError for a machine without injectors.
    """
    if not plant.machine.injectors:
        raise DataError("lift-off: the machine has no injectors, so no pressure lifts it; vary the speed instead")
    return np.array([_at(plant, float(s), highest, least_film) for s in checked("lift-off: speeds [rad/s]", speeds)])


def _at(plant: Plant, speed: float, highest: float, film: float) -> float:
    if carries(plant, speed, 0.0, film):
        return 0.0
    low, high = 0.0, min(0.1e6, highest)
    while not carries(plant, speed, high, film):
        low, high = high, 2 * high
        if low >= highest:
            return float("nan")
    while high - low > EXACT:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if carries(plant, speed, middle, film) else (middle, high)
    return high


def carries(plant: Plant, speed: float, pressure: float, least_film: float = 0.0) -> bool:
    """Whether there is an equilibrium with so much film [m]."""
    try:
        return plant.equilibrium(speed, pressure).h_min >= least_film
    except NoLiftOffError:
        return False

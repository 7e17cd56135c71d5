"""Lift-off pressure over speed: lowest supply pressure at which the film carries the rotor, by bisection."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rotorsim.analysis.axes import checked
from rotorsim.base.errors import DataError, NoLiftOffError
from rotorsim.plant import Plant

HIGHEST = 2e6
"""Gauge pressure [Pa] up to which is looked."""
EXACT = 0.5e3
"""Width [Pa] of the last bracket."""
BELOW = (0.97, 0.9, 0.75, 0.5)
"""Shares of the highest pressure refused at which the refusal is put to the test."""


def lift_off(
    plant: Plant, speeds: Sequence[float] | np.ndarray, highest: float = HIGHEST, least_film: float = 0.0
) -> np.ndarray:
    """Lift-off pressures (n_speed,) [Pa, gauge]; 0 where speed alone carries, NaN where `highest` does not.

    Carried is a rotor with an equilibrium and at least `least_film` [m] left; a turning shaft rides on very thin films.
    More pressure carries more. Raises DataError for a machine without injectors.

    Examples
    --------
    >>> import rotorsim as rs
    >>> bool(rs.analysis.lift_off(plant, [0.0])[0] > 0)
    True
    """
    if not plant.machine.fed:
        raise DataError("lift-off: the machine has no injectors, so no pressure lifts it; vary the speed instead")
    return np.array([_at(plant, float(s), highest, least_film) for s in checked("lift-off: speeds [rad/s]", speeds)])


def _at(plant: Plant, speed: float, highest: float, film: float) -> float:
    return lowest(lambda pressure: carries(plant, speed, pressure, film), highest)


def lowest(carried: Callable[[float], bool], highest: float) -> float:
    """Lowest pressure [Pa] at which the rotor is carried; NaN where `highest` does not.

    A search for an equilibrium can fail where there is one: pressures below those refused are tried too, and one that
    carries is the start of a new bisection.
    """
    if carried(0.0):
        return 0.0
    low, high = 0.0, min(0.1e6, highest)
    while not carried(high):
        low, high = high, 2 * high
        if low >= highest:
            return float("nan")
    while True:
        low, high = _narrowed(carried, low, high)
        below = next((low * share for share in BELOW if low * share > EXACT and carried(low * share)), None)
        if below is None:
            return high
        low, high = 0.0, below


def _narrowed(carried: Callable[[float], bool], low: float, high: float) -> tuple[float, float]:
    while high - low > EXACT:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if carried(middle) else (middle, high)
    return low, high


def carries(plant: Plant, speed: float, pressure: float, least_film: float = 0.0) -> bool:
    """Whether there is an equilibrium with so much film [m]."""
    try:
        return plant.equilibrium(speed, pressure).h_min >= least_film
    except NoLiftOffError:
        return False

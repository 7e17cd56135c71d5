"""Whirl onset over supply pressure: lowest speed at which a mode of film and rotor loses its damping."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.analysis.axes import checked
from rotorsim.base.constants import RPM
from rotorsim.base.errors import DataError, NoLiftOffError
from rotorsim.base.rounding import DAMPED, falls_below_zero
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

HIGHEST, STEP = 40e3 * RPM, 1e3 * RPM
"""Speed [rad/s] up to which is looked, and in which steps."""


def whirl_onset(
    plant: Plant, pressures: Sequence[float] | np.ndarray, highest: float = HIGHEST, step: float = STEP
) -> xr.Dataset:
    """Onset speed and whirl frequency [rad/s] and their ratio over the pressures [Pa]; NaN where there is none.

    Scans up in steps until the least damping ratio is negative, then Brent's method on it. Raises DataError for a
    machine without a film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.whirl_onset(plant, [0.5e6])
    """
    import xarray as xr

    if plant.machine.film is None:
        raise DataError("whirl onset: the machine has no gas film; use fe_shaft's run_stability")
    pressures = checked("whirl onset: pressures [Pa]", pressures)
    found = np.array([_at(plant, float(p), highest, step) for p in pressures])
    over = ("pressure",)
    return xr.Dataset(
        {
            "onset_speed": (over, found[:, 0], {"units": "rad/s", "long_name": "whirl onset"}),
            "onset_frequency": (over, found[:, 1], {"units": "rad/s", "long_name": "whirl frequency at the onset"}),
            "onset_ratio": (over, found[:, 1] / found[:, 0], {"units": "1", "long_name": "whirl over speed"}),
        },
        {"pressure": (over, pressures, {"units": "Pa", "long_name": "supply pressure, gauge"})},
    )


def _at(plant: Plant, pressure: float, highest: float, step: float) -> tuple[float, float]:
    def zeta(speed: float) -> float:
        try:
            return least(plant, speed, pressure)[0]
        except NoLiftOffError:
            return float("nan")

    onset = first_growth(zeta, np.arange(0.0, highest + step / 2, step))
    return (onset, least(plant, onset, pressure)[1]) if np.isfinite(onset) else (onset, onset)


def first_growth(zeta: Callable[[float], float], speeds: np.ndarray) -> float:
    """Lowest speed at which a damping ratio (NaN: not carried) is negative by more than rounding; NaN where none is.

    Between the first such one of the speeds (n,) and the one before it, or at it where the rotor is not carried before.
    """

    def margin(speed: float) -> float:
        value = zeta(speed)
        return 1.0 if np.isnan(value) else value + DAMPED

    low = float("nan")
    for speed in speeds.tolist():
        value = zeta(speed)
        if value < -DAMPED:
            return speed if np.isnan(low) else falls_below_zero(margin, low, speed, xtol=1e-6, rtol=1e-8)
        low = float("nan") if np.isnan(value) else speed
    return float("nan")


def least(plant: Plant, speed: float, pressure: float) -> tuple[float, float]:
    """Least damping ratio of the modes near the first critical speeds (inf: none oscillates), its frequency [rad/s]."""
    model = plant.linearise(speed, pressure)
    if not model.zeta.size:
        return float("inf"), float("nan")
    k = int(model.zeta.argmin())
    return float(model.zeta[k]), float(model.wn[k])

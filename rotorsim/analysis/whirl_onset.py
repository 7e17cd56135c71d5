"""Whirl onset: the lowest speed at which a mode of film and rotor is no longer damped, at each supply pressure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from rotorsim.analysis.axes import checked
from rotorsim.errors import DataError, NoLiftOffError
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

HIGHEST, STEP = 40e3 * np.pi / 30, 1e3 * np.pi / 30
"""Speed [rad/s] up to which is looked, and in which steps."""


def whirl_onset(
    plant: Plant, pressures: Sequence[float] | np.ndarray, highest: float = HIGHEST, step: float = STEP
) -> xr.Dataset:
    """Onset speed and whirl frequency [rad/s] and their ratio over the pressures [Pa]; NaN where there is none.

    Scans up in steps until the least damping ratio is negative, then Brent's method on it. Raises DataError for a
    machine without a film.
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
    low = None
    for speed in np.arange(0.0, highest + step / 2, step):
        try:
            zeta = least(plant, float(speed), pressure)[0]
        except NoLiftOffError:
            continue
        if zeta < 0:
            if low is None:
                return float(speed), least(plant, float(speed), pressure)[1]
            onset = brentq(lambda s: least(plant, s, pressure)[0], low, float(speed), xtol=1e-6, rtol=1e-8)
            return float(onset), least(plant, float(onset), pressure)[1]
        low = float(speed)
    return float("nan"), float("nan")


def least(plant: Plant, speed: float, pressure: float) -> tuple[float, float]:
    """Least damping ratio of the modes near the first critical speeds, and that mode's frequency [rad/s]."""
    model = plant.linearise(speed, pressure)
    k = int(model.zeta.argmin())
    return float(model.zeta[k]), float(model.wn[k])

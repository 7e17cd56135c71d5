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
"""Least speed [rad/s] up to which is looked, and the steps of the search up to there."""
ABOVE = 4.0
"""Speed up to which is looked, over the rotor's first natural frequency on its nominal bearings."""
WIDEST, NARROWEST = 8, 40
"""Longest and shortest step of `stability_limit`: the range over these numbers."""


def whirl_onset(
    plant: Plant,
    pressures: Sequence[float] | np.ndarray,
    highest: float | None = None,
    step: float | None = None,
) -> xr.Dataset:
    """Onset speed and whirl frequency [rad/s] and their ratio over the pressures [Pa]; NaN where there is none.

    Scans up in steps until the least damping ratio is negative, then Brent's method on it. `highest` is by default
    40000 rpm, or four times the rotor's first natural frequency where that is more; `step` a fortieth of it. Raises
    DataError for a machine without a film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.whirl_onset(plant, [0.5e6])
    """
    import xarray as xr

    if plant.machine.film is None:
        raise DataError("whirl onset: the machine has no gas film; use fe_shaft's run_stability")
    pressures = checked("whirl onset: pressures [Pa]", pressures)
    highest = highest_speed(plant) if highest is None else highest
    step = STEP * highest / HIGHEST if step is None else step
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


def highest_speed(plant: Plant) -> float:
    """Speed [rad/s] up to which the onset of whirl is looked for when none is given."""
    return max(HIGHEST, ABOVE * float(plant.assembly.mesh.reduced.frequencies.min()))


def stability_limit(plant: Plant, pressure: float, highest: float, accuracy: float = 1e-5) -> float:
    """Onset of whirl [rad/s] at a gauge pressure [Pa] to a relative `accuracy`, with few linear models; NaN for none.

    Steps up by nine tenths of the way to where the secant through the last two damping ratios meets zero, within an
    eighth and a fortieth of the range, then Brent's method. Raises NoLiftOffError where no speed carries the rotor.
    """
    known: dict[float, float] = {}

    def margin(speed: float) -> float:
        if speed not in known:
            known[speed] = least(plant, speed, pressure)[0] + DAMPED
        return known[speed]

    before: float | None = None
    speed, carried, refused = 0.0, False, None
    while speed <= highest:
        try:
            value, carried = margin(speed), True
        except NoLiftOffError as error:
            before, refused = None, error
            speed += highest / WIDEST
            continue
        if value < 0:
            return speed if before is None else falls_below_zero(margin, before, speed, xtol=1e-6, rtol=accuracy)
        before, speed = speed, speed + _step(known, before, speed, highest) if speed < highest else np.inf
    if refused is not None and not carried:
        raise refused
    return float("nan")


def _step(known: dict[float, float], before: float | None, speed: float, highest: float) -> float:
    """Length of the next step, which does not lead past the highest speed."""
    ahead = np.inf
    if before is not None and known[speed] < known[before]:
        ahead = 0.9 * known[speed] * (speed - before) / (known[before] - known[speed])
    return min(float(np.clip(ahead, highest / NARROWEST, highest / WIDEST)), highest - speed)


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

"""Critical speeds of the coupled machine: crossings of an order line with a natural frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorsim.analysis.point import operating_point
from rotorsim.base.errors import NoLiftOffError
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

MODES = 2
PASSES = 12


def critical_speeds(plant: Plant, pressures: np.ndarray, orders: tuple[int, ...] = (1, 2, 3)) -> xr.Dataset:
    """Speeds [rad/s] at which `order` times the speed is the natural frequency of one of the two lowest modes.

    Found by secant steps on wn(Omega) / order = Omega; NaN where the rotor is not carried. The damping ratio there is
    given too: an unbalance's peak lies about zeta^2 above the crossing.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.critical_speeds(plant, [0.5e6], orders=(1,))
    >>> found["critical_speed"].dims[0]
    'pressure'
    """
    import xarray as xr

    shape = (len(pressures), len(orders), MODES)
    speed, zeta = np.full(shape, np.nan), np.full(shape, np.nan)
    for i, pressure in enumerate(pressures):
        for j, order in enumerate(orders):
            for k in range(MODES):
                speed[i, j, k], zeta[i, j, k] = _crossing(plant, float(pressure), order, k)
    over = ("pressure", "order", "mode")
    return xr.Dataset(
        {
            "critical_speed": (over, speed, {"units": "rad/s", "long_name": "critical speed"}),
            "critical_zeta": (over, zeta, {"units": "1", "long_name": "damping ratio at the critical speed"}),
        },
        {
            "pressure": ("pressure", pressures, {"units": "Pa", "long_name": "supply pressure, gauge"}),
            "order": ("order", list(orders), {"units": "1", "long_name": "order of the speed"}),
            "mode": ("mode", np.arange(1, MODES + 1), {"long_name": "mode, by frequency"}),
        },
    )


def _crossing(plant: Plant, pressure: float, order: int, mode: int) -> tuple[float, float]:
    try:
        wn = operating_point(plant, 0.0, pressure, (0.0,)).model.wn
    except NoLiftOffError:
        wn = np.full(MODES, np.nan)
    speed = wn[mode] / order if np.isfinite(wn).all() and len(wn) > mode else np.nan
    before: tuple[float, float] | None = None
    for _ in range(PASSES):
        if not np.isfinite(speed):
            break
        try:
            model = operating_point(plant, speed, pressure, (0.0,)).model
        except NoLiftOffError:
            break
        gap = model.wn[mode] / order - speed
        if abs(gap) < 1e-7 * speed:
            return float(speed), float(model.zeta[mode])
        slope = -1.0 if before is None else (gap - before[1]) / (speed - before[0])
        before, speed = (speed, gap), speed - gap / slope
    return float("nan"), float("nan")


def interpolated(speeds: np.ndarray, wn: np.ndarray) -> float:
    """First crossing of wn (n,) with the speeds (n,) by linear interpolation; extrapolated by a fifth at most."""
    gap = wn - speeds
    good = np.isfinite(gap)
    if good.sum() < 2:
        return float("nan")
    s, g = speeds[good], gap[good]
    change = np.flatnonzero((g[:-1] > 0) & (g[1:] <= 0))
    k = int(change[0]) if change.size else len(s) - 2
    if not change.size and (g[-1] <= 0 or g[-1] > 0.2 * s[-1]):
        return float("nan")
    return float(s[k] - g[k] * (s[k + 1] - s[k]) / (g[k + 1] - g[k]))

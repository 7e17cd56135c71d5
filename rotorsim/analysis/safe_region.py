"""Safe operating region: lifted, stable, and at least 15 % away from a critical speed (thesis)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorsim.base.rounding import DAMPED

if TYPE_CHECKING:
    import xarray as xr

MARGIN = 0.15
MODES = 2


def safe_region(found: xr.Dataset, margin: float = MARGIN) -> xr.Dataset:
    """`critical_speed` (..., mode) [rad/s], interpolated in the map, and `safe` (..., speed) added to a map.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.safe_region(rs.analysis.operating_map(plant, [300.0], [0.5e6], workers=1))
    >>> found["safe"].shape
    (1, 1)
    """
    if "wn" not in found:
        return found.assign(safe=found["lifted"].copy() * 0.0)
    order = [d for d in found["lifted"].dims if d != "speed"]
    wn = found["wn"].transpose(*order, "mode", "speed").values[..., :MODES, :]
    speeds = found["speed"].values
    critical = np.apply_along_axis(lambda row: interpolated(speeds, row), -1, wn)
    with np.errstate(invalid="ignore"):
        near = np.abs(speeds / critical[..., None] - 1) < margin
        stable = found["zeta_least"].transpose(*order, "speed").values > DAMPED
    lifted = found["lifted"].transpose(*order, "speed").values == 1
    safe = lifted & stable & ~near.any(axis=-2)
    text = f"lifted, stable and not within {100 * margin:g} % of a critical speed"
    return found.assign(
        critical_speed=((*order, "mode_critical"), critical, {"units": "rad/s", "long_name": "critical speed"}),
        safe=((*order, "speed"), safe.astype(float), {"units": "1", "long_name": text}),
    ).assign_attrs(safe_margin=margin)


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

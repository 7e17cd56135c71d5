"""Values that suggest a wrong unit; only reported, never corrected."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

_LIMITS = {
    "m": (
        1e-9,
        1e-2,
        "a displacement of a rotor",
        "um or mm taken for m, or V taken for a length",
        "m taken for mm or um",
    ),
    "rad/s": (1e-1, 2e4, "a shaft speed", "rpm or deg/s taken for rad/s", "krpm or Hz taken for rpm or rad/s"),
    "Pa": (1e3, 5e7, "a supply pressure", "Pa or kPa taken for MPa or GPa", "bar or MPa taken for Pa"),
    "V": (1e-4, 2e3, "an actuator voltage", "mV taken for V", "V taken for mV"),
}
"""By unit: the largest absolute value should lie between, or be zero; what it would be; what the mistake may be
where it is too large, and where too small."""
_RATES = (20.0, 2e6)
_SLOPES = {
    "the speed seems to be in rpm": pi / 30,
    "the speed seems to be in Hz": 2 * pi,
    "the angle seems to be in deg": 180 / pi,
}
"""True over stated speed: what the angle's slope divided by the speed is, by the mistake."""


def suspicions(record: xr.Dataset, rate: float) -> list[str]:
    """Sentences about a record sampled at `rate` [Hz]; empty if nothing looks odd."""
    found = [text for name in record.data_vars if (text := _size(record, str(name)))]
    if np.isfinite(rate) and not _RATES[0] <= rate <= _RATES[1]:
        found.append(f"time: {rate:.4g} samples a second; perhaps ms or us taken for s, or s for ms")
    return found + _angle(record)


def _size(record: xr.Dataset, name: str) -> str:
    limits = _LIMITS.get(record[name].attrs.get("units", ""))
    if limits is None or name == "h_min" or record[name].dtype.kind not in "fiu":
        return ""
    values = np.abs(np.asarray(record[name].values, float))
    largest = float(values[np.isfinite(values)].max(initial=0.0))
    if largest == 0:
        return ""
    low, high, thing, large, small = limits
    if low <= largest <= high:
        return ""
    size, mistake = ("large", large) if largest > high else ("small", small)
    return f"{name}: up to {largest:.4g} {record[name].attrs['units']} is {size} for {thing}; perhaps {mistake}"


def _angle(record: xr.Dataset) -> list[str]:
    """Whether the angle runs on, and as fast as the speed signal."""
    names = [name for name in ("angle_measured", "angle") if name in record]
    if not names or record.sizes["time"] < 3:
        return []
    angle, time = (np.asarray(record[name].values, float) for name in (names[0], "time"))
    steps = np.diff(angle)
    if np.any(np.abs(steps) > pi) and np.median(np.abs(steps)) < pi / 2:
        return [f"{names[0]}: jumps by more than half a turn from sample to sample; if it wraps, unwrap it"]
    speed = next((record[name].values for name in ("speed_measured", "speed") if name in record), None)
    if speed is None or not np.all(np.isfinite(speed)) or not np.mean(speed) or not time[-1] > time[0]:
        return []
    ratio = abs(float((angle[-1] - angle[0]) / (time[-1] - time[0]) / np.mean(speed)))
    hits = [text for text, expected in _SLOPES.items() if abs(ratio / expected - 1) < 0.02]
    if hits:
        return [f"{names[0]}: turns {ratio:.4g} times as fast as the speed signal; {hits[0]}"]
    if abs(ratio - 1) > 0.05:
        return [f"{names[0]}: turns {ratio:.4g} times as fast as the speed signal; check both units"]
    return []

"""Values that suggest a wrong unit; only reported, never corrected.

What no rotor does makes a record unfit; what few rigs do is a warning alone.
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


class Suspicion(NamedTuple):
    """A sentence, and whether the record is unfit because of it."""

    text: str
    unfit: bool = True


class Range(NamedTuple):
    """What the largest absolute value lies between unless it is 0, what it is, and the mistake above and below."""

    low: float
    high: float
    thing: str
    large: str
    small: str


_LIMITS = {
    "m": Range(1e-9, 1e-2, "a displacement of a rotor", "um or mm taken for m, or V taken for a length",
               "m taken for mm or um"),
    "rad/s": Range(1e-1, 2e4, "a shaft speed", "rpm or deg/s taken for rad/s", "krpm or Hz taken for rpm or rad/s"),
    "Pa": Range(1e3, 5e7, "a supply pressure", "Pa or kPa taken for MPa or GPa", "bar or MPa taken for Pa"),
    "V": Range(1e-4, 2e3, "an actuator voltage", "mV taken for V", "V taken for mV"),
}  # fmt: skip
"""By unit: what no rig leaves."""
_USUAL = {
    "m": Range(1e-7, 1e-3, "a displacement of a rotor (films are 5 to 200 um thick, probes resolve some 50 nm)",
               "um taken for mm or mil, or V taken for a length", "um taken for nm, or mm taken for um"),
    "rad/s": Range(0.0, 6.3e3, "a shaft speed (above 60000 rpm turn only shafts of less than some 20 mm)",
                   "rpm taken for Hz or rad/s", ""),
    "Pa": Range(0.0, 2e6, "a supply pressure (bearings are fed with 0.2 to 1 MPa, networks hold 2 MPa at most)",
                "bar or psi taken for MPa", ""),
    "V": Range(0.0, 200.0, "an actuator voltage (amplifiers take 10 V, most piezo stacks 200 V)", "mV taken for V", ""),
}  # fmt: skip
"""By unit: what few rigs leave."""
_RATES = (20.0, 2e6)
_SLOPES = {
    "the speed seems to be in rpm": pi / 30,
    "the speed seems to be in Hz": 2 * pi,
    "the angle seems to be in deg": 180 / pi,
}
"""True over stated speed: what the angle's slope divided by the speed is, by the mistake."""


def suspicions(record: xr.Dataset, rate: float) -> list[Suspicion]:
    """Suspicions about a record sampled at `rate` [Hz]; empty if nothing looks odd."""
    found = [one for name in record.data_vars if (one := _size(record, str(name)))]
    if np.isfinite(rate) and not _RATES[0] <= rate <= _RATES[1]:
        found.append(Suspicion(f"time: {rate:.4g} samples a second; perhaps ms or us taken for s, or s for ms"))
    return found + _angle(record)


def _size(record: xr.Dataset, name: str) -> Suspicion | None:
    unit = record[name].attrs.get("units", "")
    if unit not in _LIMITS or name == "h_min" or record[name].dtype.kind not in "fiu":
        return None
    values = np.abs(np.asarray(record[name].values, float))
    largest = float(values[np.isfinite(values)].max(initial=0.0))
    for unfit, limits in ((True, _LIMITS[unit]), (False, _USUAL[unit])):
        if largest and not limits.low <= largest <= limits.high:
            size, mistake = ("large", limits.large) if largest > limits.high else ("small", limits.small)
            text = f"{name}: up to {largest:.4g} {unit} is {size} for {limits.thing}; perhaps {mistake}"
            return Suspicion(text, unfit)
    return None


def _angle(record: xr.Dataset) -> list[Suspicion]:
    """Whether the angle runs on, and as fast as the speed signal."""
    names = [name for name in ("angle_measured", "angle") if name in record]
    if not names or record.sizes["time"] < 3:
        return []
    angle, time = (np.asarray(record[name].values, float) for name in (names[0], "time"))
    steps = np.diff(angle)
    if np.any(np.abs(steps) > pi) and np.median(np.abs(steps)) < pi / 2:
        return [Suspicion(f"{names[0]}: jumps by more than half a turn from sample to sample; if it wraps, unwrap it")]
    speed = next((record[name].values for name in ("speed_measured", "speed") if name in record), None)
    if speed is None or not np.all(np.isfinite(speed)) or not np.mean(speed) or not time[-1] > time[0]:
        return []
    ratio = abs(float((angle[-1] - angle[0]) / (time[-1] - time[0]) / np.mean(speed)))
    hits = [text for text, expected in _SLOPES.items() if abs(ratio / expected - 1) < 0.02]
    if hits:
        return [Suspicion(f"{names[0]}: turns {ratio:.4g} times as fast as the speed signal; {hits[0]}")]
    if abs(ratio - 1) > 0.05:
        return [Suspicion(f"{names[0]}: turns {ratio:.4g} times as fast as the speed signal; check both units", False)]
    return []

"""Examination of a record: channels, faults, possible uses, values that suggest a mistake.

Values that suggest a wrong unit are only reported, never corrected. Values that no rotor
has make a record unfit; those of few rigs are a warning alone.

Hints that phases are leads or that axes are exchanged or mirrored are reported too. Unbalance whirls forward, and its
phase lag grows through a resonance. With complex amplitudes A of an order, :math:`|A_x + i A_y|/2` is its forward and
:math:`|A_x - i A_y|/2` its backward part. Phases that are leads conjugate the amplitudes: they turn both around.
Exchanged axes, or one of the wrong sign, turn the whirl alone. Split supports can whirl backward between two critical
speeds, hence a hint needs the whole table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from identification.records.columns import clipped, moves
from identification.records.prefilter import without_gaps
from identification.records.sampling import nominal_rate, problems
from identification.records.schema import VECTORS, measured, measured_name, named_axes, notes_of, validate
from rotorsim.base.errors import SchemaError
from rotorsim.base.units import TO_RPM

if TYPE_CHECKING:
    import xarray as xr


class Suspicion(NamedTuple):
    """A sentence, and whether the record is unfit because of it."""

    text: str
    unfit: bool = True


class ValueRange(NamedTuple):
    """Range of the largest absolute value of a quantity unless it is 0, its name, and the mistake above and below."""

    low: float
    high: float
    thing: str
    large: str
    small: str


_LIMITS = {
    "m": ValueRange(
        1e-9, 1e-2, "a displacement of a rotor", "um or mm taken for m, or V taken for a length", "m taken for mm or um"
    ),
    "rad/s": ValueRange(
        1e-1, 2e4, "a shaft speed", "rpm or deg/s taken for rad/s", "krpm or Hz taken for rpm or rad/s"
    ),
    "Pa": ValueRange(1e3, 5e7, "a supply pressure", "Pa or kPa taken for MPa or GPa", "bar or MPa taken for Pa"),
    "V": ValueRange(1e-4, 2e3, "an actuator voltage", "mV taken for V", "V taken for mV"),
}
"""Ranges by unit that no rig leaves."""
_USUAL = {
    "m": ValueRange(
        1e-7,
        1e-3,
        "a displacement of a rotor (films are 5 to 200 um thick, probes resolve some 50 nm)",
        "um taken for mm or mil, or V taken for a length",
        "um taken for nm, or mm taken for um",
    ),
    "rad/s": ValueRange(
        0.0,
        6.3e3,
        "a shaft speed (above 60000 rpm turn only shafts of less than some 20 mm)",
        "rpm taken for Hz or rad/s",
        "",
    ),
    "Pa": ValueRange(
        0.0,
        2e6,
        "a supply pressure (bearings are fed with 0.2 to 1 MPa, networks hold 2 MPa at most)",
        "bar or psi taken for MPa",
        "",
    ),
    "V": ValueRange(
        0.0, 200.0, "an actuator voltage (amplifiers take 10 V, most piezo stacks 200 V)", "mV taken for V", ""
    ),
}
"""Ranges by unit that few rigs leave."""
_RATES = (20.0, 2e6)
_SLOPES = {
    "the speed seems to be in rpm": pi / 30,
    "the speed seems to be in Hz": 2 * pi,
    "the angle seems to be in deg": 180 / pi,
}
"""Slope of the angle over the stated speed, by the mistake that makes it."""


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
    name = measured_name(record, "angle")
    if not name or record.sizes["time"] < 3:
        return []
    angle, time = (np.asarray(record[key].values, float) for key in (name, "time"))
    steps = np.diff(angle)
    if np.any(np.abs(steps) > pi) and np.median(np.abs(steps)) < pi / 2:
        return [Suspicion(f"{name}: jumps by more than half a turn from sample to sample; if it wraps, unwrap it")]
    speed = measured(record, "speed")
    if speed is None or not np.all(np.isfinite(speed)) or not np.mean(speed) or not time[-1] > time[0]:
        return []
    ratio = abs(float((angle[-1] - angle[0]) / (time[-1] - time[0]) / np.mean(speed)))
    hits = [text for text, expected in _SLOPES.items() if abs(ratio / expected - 1) < 0.02]
    if hits:
        return [Suspicion(f"{name}: turns {ratio:.4g} times as fast as the speed signal; {hits[0]}")]
    if abs(ratio - 1) > 0.05:
        return [Suspicion(f"{name}: turns {ratio:.4g} times as fast as the speed signal; check both units", False)]
    return []


BACKWARD = 2.0
"""Ratio of backward to forward amplitude from which whirl counts as backward."""
FALL = np.deg2rad(60.0)
"""Fall of a phase lag about a peak [rad] from which it is a lead."""
SOLID, EVERY = 0.5, 200_000
"""Share of the motion's power that must be 1X; most samples that are looked at."""
TINY = 1e-300
AXES_HINT = "the angles, signs and order of the probes, and the direction of rotation"


def vector_hints(vectors: xr.Dataset) -> list[str]:
    """Hints about run-up vectors."""
    if 1 not in vectors["order"].values:
        return []
    one = vectors.sel(order=1)
    amplitude = one["amplitude"].values * np.exp(-1j * one["phase"].values)
    if not np.isfinite(amplitude).all() or not np.abs(amplitude).max() > 0:
        return []
    single = amplitude.shape[1] < 2
    forward, backward = (float(np.linalg.norm(amplitude[:, 0] + s * amplitude[:, -1])) for s in (1j, -1j))
    turned = not single and backward > BACKWARD * forward
    falls = _fall(np.asarray(vectors["speed"].values, float), amplitude)
    if falls:
        forward_too = f" but 1X whirls forward, so that {AXES_HINT} are in doubt too"
        more = "" if single else " and 1X whirls backward" if turned else forward_too
        return [
            f"phase: the lag falls by {np.rad2deg(falls[0]):.0f} deg through the peak at {falls[1] * TO_RPM:.0f} rpm"
            f"{more}: are these leads (conjugated phasors)? write sign = -1 in every phase; nothing was changed"
        ]
    return [_backward(backward / max(forward, TINY))] if turned else []


def series_hints(record: xr.Dataset) -> list[str]:
    """Hints about a time series with an angle and x and y of the disc."""
    angle, disc = measured(record, "angle"), measured(record, "disc")
    if angle is None or disc is None or disc.ndim != 2 or disc.shape[1] != 2:
        return []
    step = max(1, disc.shape[0] // EVERY)
    motion, turned = disc[::step], angle[::step]
    whole = np.isfinite(motion).all(axis=1) & np.isfinite(turned)
    if np.count_nonzero(whole) < 100 or np.ptp(turned[whole]) < 8 * np.pi:
        return []
    z = (motion[whole, 0] - motion[whole, 0].mean()) + 1j * (motion[whole, 1] - motion[whole, 1].mean())
    forward, backward = (float(abs(np.mean(z * np.exp(-1j * s * turned[whole])))) for s in (1, -1))
    if forward**2 + backward**2 < SOLID * np.mean(np.abs(z) ** 2) or backward <= BACKWARD * forward:
        return []
    return [_backward(backward / max(forward, TINY))]


def _backward(ratio: float) -> str:
    return f"disc_measured: 1X whirls backward ({min(ratio, 999):.3g} times as much as forward): check {AXES_HINT}"


def _fall(speed: np.ndarray, amplitude: np.ndarray) -> tuple[float, float] | None:
    """Fall of the phase lag [rad] between the half-amplitude points of the largest peak, and its speed [rad/s]."""
    order = np.argsort(speed)
    speed, amplitude = speed[order], amplitude[order]
    found = []
    for column in amplitude.T:
        size = np.abs(column)
        top = int(np.argmax(size))
        low = size[: top + 1][::-1] < 0.5 * size[top]
        high = size[top:] < 0.5 * size[top]
        if not low.any() or not high.any():
            return None
        lag = -np.unwrap(np.angle(column))
        found.append((lag[top - int(np.argmax(low))] - lag[top + int(np.argmax(high))], speed[top]))
    least = min(found)
    return (float(least[0]), float(least[1])) if least[0] > FALL else None


USES: dict[str, tuple[tuple[str, ...], ...]] = {
    "identification": (("reference",), ("disc_measured", "disc")),
    "runout filter": (("disc_measured", "disc"), ("angle_measured", "angle")),
    "run-up analysis": (("disc_measured", "disc"), ("angle_measured", "angle", "speed_measured", "speed")),
    "diagnosis": (("disc_measured", "disc"), ("angle_measured", "angle", "speed_measured", "speed")),
    "scheduled models": (
        *(("reference",), ("disc_measured", "disc")),
        *(("speed_measured", "speed"), ("pressure_measured", "pressure")),
    ),
}
"""Variables that each use needs: at least one of every group, and always time."""
TURNING = ("run-up analysis", "diagnosis")
"""Uses that a lone probe or a table of vectors serves."""
MOTION = " or ".join(USES["run-up analysis"][0])
"""Variables of the disc's motion, as a lack states them."""
FITS = ("identification", "scheduled models")
"""Uses that leave gaps out."""
CLIPPED = ("disc_measured", "journal", "pin", "pin_measured", "pressure_measured")
"""Channels of sensors; commands may well rest at their limits."""
PARTS, SWEPT = 8, 0.02
"""Parts of a record whose mean speeds are compared, and the share by which those of a run-up differ at least."""
_STEADY = ("speed", "speed_measured", "pressure", "pressure_measured", "reference", "contact", "disc_force")
_DRIVEN = {"pin": ("reference",), "pin_measured": ("reference",), "angle": ("speed_measured", "speed"),
           "angle_measured": ("speed_measured", "speed")}  # fmt: skip
"""Channels that stand still where what drives them does, which is no fault of their sensor."""
LEAST_TURNS = 2.0
"""Revolutions that a runout filter needs."""


@dataclass(frozen=True)
class Channel:
    """One column of a variable: SI unit, range of the finite values, and remarks on its values.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.examine(record).channels[0].units
    'm'
    """

    name: str
    units: str
    minimum: float
    maximum: float
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Examination:
    """`kind` is 'time series' or 'run-up vectors'; `uses` maps each use to the variables that it lacks.

    `refused` are the sentences with which a use refuses a record that has its variables.

    `problems` make the record unfit for any use, as do those of the `warnings` that are `doubts`: values in a unit that
    must be wrong. `left_out` states the part that identification leaves out of a record whose problems are gaps alone.
    Rate [Hz] and duration [s] are NaN without a time.
    """

    kind: str
    samples: int
    sample_rate: float
    duration: float
    channels: tuple[Channel, ...]
    problems: tuple[str, ...]
    warnings: tuple[str, ...]
    uses: dict[str, str]
    doubts: tuple[str, ...] = ()
    left_out: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        """Whether the record is sound and has the variables of at least one use, which may refuse what it shows."""
        return any(self._sound(use) for use in self.uses)

    def fit(self, use: str) -> bool:
        """Whether the record is fit for a use; gaps do not hinder identification.

        Examples
        --------
        >>> import rotorsim as rs
        >>> rs.identification.examine(record).fit("scheduled models")
        True
        """
        return self._sound(use) and use not in self.refused

    def _sound(self, use: str) -> bool:
        whole = not self.problems or (bool(self.left_out) and use in FITS)
        return whole and not self.doubts and not self.uses[use]


def examine(record: xr.Dataset) -> Examination:
    """Examination of a record or of run-up vectors, whether they fit the schema or not.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.examine(record).samples == record.sizes["time"]
    True
    """
    record = named_axes(record)
    with np.errstate(all="ignore"):  # a damaged file may hold any number
        return _vectors(record) if "speed" in record.dims else _series(record)


def _series(record: xr.Dataset) -> Examination:
    timed = "time" in record.coords and record["time"].dims == ("time",) and record["time"].dtype.kind in "fiu"
    time = np.asarray(record["time"].values, float) if timed else np.empty(0)
    steps = np.diff(time)
    step = float(np.median(steps)) if steps.size else np.nan
    rate = 1 / step if step > 0 else np.nan
    rate = nominal_rate(time) if timed and not problems(time) else rate
    channels = _channels(record)
    found = [f"time: {text}" for text in problems(time)] if timed else []
    limits = record.attrs.get("clipped", [])
    found += [f"clipped: {text}; widen its range" for text in ([limits] if isinstance(limits, str) else limits)]
    bad = [f"{c.name}: {remark}; cut the record there" for c in channels for remark in c.remarks if "NaN" in remark]
    found += bad or ([] if found else _misfit(record))
    warnings = [f"{c.name}: {remark}" for c in channels for remark in c.remarks if "NaN" not in remark]
    duration = float(time[-1] - time[0]) + step if time.size > 1 else np.nan
    closed, left_out = _closed(record) if found and timed and not limits else (record, "")
    suspected = suspicions(closed, rate) if timed else []
    warnings += [*notes_of(record), *(one.text for one in suspected), *(series_hints(record) if timed else [])]
    uses = {
        use: ", ".join(" or ".join(group) for group in groups if not any(name in record for name in group))
        for use, groups in USES.items()
    }
    if "probe_measured" in record and "m" in record["probe_unit"].values.tolist():  # vectors of a lone probe will do
        uses |= {use: ", ".join(part for part in uses[use].split(", ") if part and part != MOTION) for use in TURNING}
    refused = {}
    if (angle := measured(record, "angle")) is not None and (turns := _turns(angle)) < LEAST_TURNS * (1 - 1e-3):
        refused["runout filter"] = f"the shaft turns {turns:.2g} times, the filter needs {LEAST_TURNS:g}; record longer"
    uses["run-up analysis"] = uses["run-up analysis"] or ("" if _swept(record) else "a speed that rises or falls")
    rest = (tuple(found), tuple(warnings), uses, _doubts(suspected), left_out, refused)
    return Examination("time series", time.size, rate, duration, channels, *rest)


def _turns(angle: np.ndarray) -> float:
    finite = angle[np.isfinite(angle)]
    return float(np.ptp(finite)) / (2 * pi) if finite.size else 0.0


def _swept(record: xr.Dataset) -> bool:
    """Whether the mean speed of some part of a record, measured or by its angle, differs from that of another."""
    speed = measured(record, "speed")
    angle = measured(record, "angle")
    if speed is None and angle is not None and "time" in record.coords:
        speed = np.gradient(angle, np.asarray(record["time"].values, float)) if angle.size > 1 else None
    if speed is None:
        return False
    means = np.array(
        [part[np.isfinite(part)].mean() for part in np.array_split(speed, PARTS) if np.isfinite(part).any()]
    )
    return bool(means.size) and float(np.ptp(means)) > SWEPT * float(np.abs(means).max())


def _vectors(vectors: xr.Dataset) -> Examination:
    found = _misfit(vectors)
    channels = []
    for name in VECTORS if not found else ():
        for order in vectors["order"].values:
            values = np.asarray(vectors[name].sel(order=order).values, float)
            channels.append(_channel(f"{name} {order}X", VECTORS[name].units, values.ravel(), False, False))
    uses = {use: "" if use in TURNING else "a time series" for use in USES}
    samples = vectors.sizes["speed"]
    suspected = suspicions(vectors[["amplitude"]], np.nan) if not found else []
    warnings = [*notes_of(vectors), *(one.text for one in suspected), *(vector_hints(vectors) if not found else [])]
    rest = (tuple(found), tuple(warnings), uses, _doubts(suspected))
    return Examination("run-up vectors", samples, np.nan, np.nan, tuple(channels), *rest)


def _doubts(found: list[Suspicion]) -> tuple[str, ...]:
    return tuple(one.text for one in found if one.unfit)


def _closed(record: xr.Dataset) -> tuple[xr.Dataset, str]:
    """A record without its gaps and the part that identification leaves out, or the record itself and ''."""
    try:
        closed, _, text = without_gaps(record)
        return validate(closed), text
    except SchemaError:
        return record, ""


def _channels(record: xr.Dataset) -> tuple[Channel, ...]:
    channels = []
    for name in map(str, record.data_vars):
        variable = record[name]
        if variable.dtype.kind not in "fiub" or variable.dims[:1] != ("time",) or variable.ndim > 2:
            continue
        units, values = variable.attrs.get("units", ""), np.asarray(variable.values, float)
        still = name in _STEADY or _undriven(record, name)
        if variable.ndim == 1:
            channels.append(_channel(name, units, values, name in CLIPPED, still))
            continue
        labels = variable[variable.dims[1]].values if variable.dims[1] in variable.coords else range(values.shape[1])
        own = variable.coords.get("probe_unit")
        for k, (label, column) in enumerate(zip(labels, values.T, strict=True)):
            unit = units if own is None else str(own.values[k])
            channels.append(_channel(f"{name} {label}", unit, column, name in CLIPPED, still))
    return tuple(channels)


def _undriven(record: xr.Dataset, name: str) -> bool:
    """Whether a record states what drives a channel, and that nothing of it moves: an angle at no speed."""
    there = [np.asarray(record[one].values, float) for one in _DRIVEN.get(name, ()) if one in record]
    at_rest = (not np.abs(one).max(initial=0.0) > 0 if name.startswith("angle") else not np.ptp(one, axis=0).any()
               for one in there[:1] if one.size)  # fmt: skip
    return any(at_rest)


def _channel(name: str, units: str, values: np.ndarray, sensor: bool, still: bool) -> Channel:
    """A column's range and remarks; one that may stand `still` is not remarked on for it."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return Channel(name, units, np.nan, np.nan, ("all NaN or infinite",))
    low, high = float(finite.min()), float(finite.max())
    remarks = []
    if finite.size < values.size:
        first = int(np.flatnonzero(~np.isfinite(values))[0]) + 1
        remarks.append(f"{values.size - finite.size} NaN or infinite, the first at sample {first}")
    if not moves(finite) and values.size > 1:
        if not still:
            remarks.append("flat; is the sensor connected?")
    elif sensor:
        remarks += [f"saturated at {at:.6g} {units}?" for at, _ in clipped(values)]
    return Channel(name, units, low, high, tuple(remarks))


def _misfit(record: xr.Dataset) -> list[str]:
    try:
        validate(record)
    except SchemaError as error:
        return [str(error)]
    return []

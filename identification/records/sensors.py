r"""Sensors of a laboratory: displacement probes at any angle, the keyphasor, runout and slow roll of the probes.

Two or more displacement probes at one plane give the motion in x and y there. A probe at the angle a reads r = g (x cos
a + y sin a), its gain g holding sensitivity and sense; two at different angles give x and y, more of them by least
squares.

A proximity probe gives volts round its gap voltage. DC-coupled, the gap voltage (or the mean) is taken off, so that
motion is measured from there; without either the reading stays as it is. AC-coupled, there is no mean to measure.

The runout of a run without excitation is estimated over the shaft angle.

.. math:: \hat y(\varphi) = \sum_{k=1}^{n} a_k \cos k\varphi + b_k \sin k\varphi \qquad\text{or a table over } \varphi

At a slow roll it is the sensors' runout; at the speed of the experiment it is runout and imbalance response together
(thesis, section 2.6.2). The thesis takes a look-up table of the mean at every angle. At speeds that divide the sampling
frequency a record visits few angles, 60 at 5000 rpm and 5 kHz, so the table is interpolated around the turn.

The slow roll, what probes show of a shaft that turns too slowly to move, is subtracted once.

.. math:: A_n - A_n^{slow} \qquad\text{or}\qquad d(t) - \sum_n \Re\{A_n^{slow} e^{i n \alpha(t)}\}

for run-up vectors and for time series, with the shaft angle from the same mark. It holds runout and the bow at low
speed alike. A record notes the subtraction in its attribute `slow_roll`, and a second one is refused.

Cites: api_670, thesis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.columns import amplitude_at, quantity_at
from identification.records.sampling import whole_slices
from identification.records.schema import AXES, measured, require, with_notes
from rotorsim.base.display import did_you_mean, quote
from rotorsim.base.errors import ReadError, SchemaError, UnfitError
from rotorsim.base.units import TO_RPM

if TYPE_CHECKING:
    import xarray as xr

WORST = 20.0
"""Largest condition number of the probes' directions: two probes about 6 degrees apart."""
SAME_PLACE = 1e-6
"""Probes nearer than this [m] are at one plane."""
DISPLACEMENTS = ("relative_displacement", "absolute_displacement")


def probe_outputs(record: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """The record with the motion that the probes `names` see as `disc_measured` (n, 2) [m], and without `disc`.

    Raises SchemaError for a name that is not there, a probe that measures no displacement, planes that differ and
    probes that do not see both x and y.
    """
    require(record, "probe_measured", use="the choice of probes")
    known = record["probe"].values.tolist()
    for name in names:
        if name not in known:
            raise SchemaError(f"probes: no '{name}' in the record; {did_you_mean(name, known)}")
    chosen = record["probe_measured"].isel(probe=[known.index(name) for name in names])
    _check_plane(chosen, names)
    gain, angle = (np.asarray(chosen[f"probe_{what}"].values, float) for what in ("gain", "angle"))
    seen = gain[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if len(set(names)) < 2 or np.linalg.cond(seen / np.abs(gain[:, None])) > WORST:
        raise SchemaError(f"probes {', '.join(names)}: do not see both x and y; choose two at different angles")
    motion = np.linalg.lstsq(seen, np.asarray(chosen.values, float).T, rcond=None)[0].T
    attrs = {"units": "m", "long_name": f"displacement seen by the probes {', '.join(names)}"}
    return record.drop_vars("disc", errors="ignore").assign(disc_measured=(("time", "axis"), motion, attrs))


def _check_plane(chosen: xr.DataArray, names: Sequence[str]) -> None:
    """Refuse probes that lack coordinates, measure no displacement or stand at different planes."""
    for what in ("quantity", "angle", "gain", "position"):
        if f"probe_{what}" not in chosen.coords:
            raise SchemaError(f"record: no coordinate 'probe_{what}'; it is needed to make x and y of probes")
    for name, quantity in zip(names, chosen["probe_quantity"].values.tolist(), strict=True):
        if quantity not in DISPLACEMENTS:
            raise SchemaError(f"probe {name}: measures {quantity}; choose displacement probes")
    if len(set(chosen["probe_quantity"].values.tolist())) > 1:
        raise SchemaError(f"probes {', '.join(names)}: measure relative and absolute displacement; choose one kind")
    place = np.asarray(chosen["probe_position"].values, float)
    if np.ptp(place) > SAME_PLACE:
        at = ", ".join(f"{1e3 * z:.6g}" for z in place)
        raise SchemaError(f"probes {', '.join(names)}: stand at {at} mm; choose probes of one plane")


MEAN = "mean"
OWN = ("angle", "position", "coupling", "gap")


@dataclass(frozen=True)
class LabProbe:
    """Angle [rad] from x towards y, position [m] along the shaft, coupling AC, DC or '', gap [V] or 'mean'."""

    angle: float
    position: float | None = None
    coupling: str = ""
    gap: float | str | None = None


@dataclass(frozen=True)
class LabHammer:
    """Direction [rad] of an impact hammer's force from x towards y, position [m] along the shaft, None at the disc."""

    angle: float
    position: float | None = None

    def along(self, force: np.ndarray) -> dict[str, np.ndarray]:
        """Parts (n,) of a force (n,) in x and y; none of round-off across an axis."""
        return {"x": force * round(float(np.cos(self.angle)), 15), "y": force * round(float(np.sin(self.angle)), 15)}


def split_probe(path: str, table: dict[str, Any]) -> tuple[dict[str, Any], LabProbe]:
    """The entry of a probe's column and the probe itself; raises ReadError for what is missing or contradictory."""
    if "angle" not in table:
        raise ReadError(f"{path}.angle: is missing; give the probe's angle from x towards y, e.g. angle = '45 deg'")
    own = {key: table[key] for key in OWN if key in table}
    coupling, gap = own.get("coupling", ""), own.get("gap")
    if coupling not in ("", "AC", "DC"):
        raise ReadError(f"{path}.coupling: {quote(coupling)}; write AC or DC")
    if coupling == "AC" and gap is not None:
        raise ReadError(f"{path}.gap: an AC-coupled probe has no gap voltage in its signal; remove gap")
    if gap is not None and gap != MEAN:
        gap = quantity_at(f"{path}.gap", gap, "V")
    position = quantity_at(f"{path}.position", own["position"], "m") if "position" in own else None
    probe = LabProbe(quantity_at(f"{path}.angle", own["angle"], "rad"), position, coupling, gap)
    return {key: value for key, value in table.items() if key not in OWN}, probe


def disc_plane(probes: dict[str, LabProbe], wanted: float | None) -> tuple[str, ...]:
    """Names of the probes at the disc's plane, the position `wanted` [m] or the only one."""
    places = {name: probe.position for name, probe in probes.items()}
    if wanted is not None:
        found = tuple(name for name, z in places.items() if z is not None and abs(z - wanted) <= SAME_PLACE)
        if not found:
            raise ReadError(f"disc.position: no probe at {1e3 * wanted:.6g} mm; give the position of a probe")
        return found
    known = [z for z in places.values() if z is not None]
    alike = {probe.angle: name for name, probe in probes.items()}
    if not known and 1 < len(alike) < len(probes):
        name = next(name for name, probe in probes.items() if alike[probe.angle] != name)
        other, degrees = alike[probes[name].angle], np.rad2deg(probes[name].angle)
        raise ReadError(
            f"probes {name} and {other}: both stand at {degrees:g} deg and state no position, so their planes are not "
            "known; state position = '150 mm' of each probe"
        )
    if known and (len(known) < len(places) or np.ptp(known) > SAME_PLACE):
        at = ", ".join(f"{name} {'nowhere' if z is None else f'{1e3 * z:.6g} mm'}" for name, z in places.items())
        raise ReadError(f"probes: stand at several planes ({at}); state the disc's: [disc] with position = '150 mm'")
    return tuple(places)


def in_plane(readings: dict[str, np.ndarray], probes: dict[str, LabProbe]) -> dict[str, np.ndarray] | None:
    """Motion in x and y [m] from readings (n,) [m] at one plane by least squares; None if they do not see both."""
    names = list(readings)
    if len({column.size for column in readings.values()}) > 1:
        raise ReadError(f"probes {', '.join(names)}: have different numbers of samples; take columns of one length")
    angles = np.array([probes[name].angle for name in names])
    seen = np.column_stack([np.cos(angles), np.sin(angles)])
    if len(names) < 2 or np.linalg.cond(seen) > WORST:
        return None
    x, y = np.linalg.lstsq(seen, np.array(list(readings.values())), rcond=None)[0]
    return {"x": x, "y": y}


def coordinates(probes: dict[str, LabProbe]) -> dict[str, Any]:
    """Coordinates of probes as a record keeps them; the position of one that states none is NaN."""
    return {
        "probe": list(probes),
        "probe_quantity": ["relative_displacement"] * len(probes),
        "probe_position": [np.nan if p.position is None else p.position for p in probes.values()],
        "probe_angle": [p.angle for p in probes.values()],
        "probe_gain": [1.0] * len(probes),
        "probe_unit": ["m"] * len(probes),
    }


HYSTERESIS = 0.2
"""Hysteresis without a given one, as a share of the signal's range."""
UNEVEN = 1.6
"""Factor between neighbouring intervals above which a pulse is missing or there is one too many."""
FEWEST = 4
OUTSIDE = 1.5
"""Intervals before the first pulse and after the last one over which the angle is extrapolated at their speed."""


@dataclass(frozen=True)
class Keyphasor:
    """Detection of pulses: level and hysteresis in the signal's unit, both from its range if None.

    `edge` is 'rising' or 'falling', `pulses` their number a turn; at the first the angle is 0.
    """

    level: float | None = None
    hysteresis: float | None = None
    edge: str = "falling"
    pulses: int = 1


def pulse_times(time: np.ndarray, signal: np.ndarray, how: Keyphasor) -> np.ndarray:
    """Times [s] at which the signal (n,) passes the level; each counts once it has left the hysteresis' band.

    Raises ReadError where there are too few pulses, or one is missing.
    """
    s = signal if how.edge == "rising" else -signal
    low, high = np.percentile(s, (1, 99)) if s.size else (0.0, 0.0)
    if s.size and s.max() - s.min() > 0 and not high - low > 0.5 * (s.max() - s.min()):
        low, high = s.min(), s.max()  # pulses shorter than a hundredth of a turn
    level = (0.5 * (low + high)) if how.level is None else how.level * (1 if how.edge == "rising" else -1)
    band = HYSTERESIS * (high - low) if how.hysteresis is None else how.hysteresis
    if not band > 0 or not low < level < high:
        raise ReadError(f"the signal runs from {signal.min():.4g} to {signal.max():.4g} and never passes its level")
    state = np.zeros(s.size, dtype=np.int8)
    state[s > level + 0.5 * band], state[s < level - 0.5 * band] = 1, -1
    set_at = np.flatnonzero(state)
    up = np.flatnonzero(np.diff(state[set_at]) == 2)
    before = set_at[up]
    # the crossing lies between the last low and the first high sample
    after = set_at[up + 1]
    first = before + np.array([np.argmax(s[a : b + 1] > level) for a, b in zip(before, after, strict=True)], dtype=int)
    part = (level - s[first - 1]) / (s[first] - s[first - 1])
    found = time[first - 1] + part * (time[first] - time[first - 1])
    if found.size < FEWEST:
        raise ReadError(f"{found.size} pulses; at least {FEWEST} are needed to follow the shaft's angle")
    steps = np.diff(found)
    odd = np.flatnonzero(np.maximum(steps[1:] / steps[:-1], steps[:-1] / steps[1:]) > UNEVEN)
    if odd.size:
        raise ReadError(
            f"a pulse is missing, or is one too many, near {found[odd[0] + 1]:.6g} s ({odd.size} such places); "
            "set level and hysteresis, or cut the record"
        )
    return np.asarray(found)


def shaft_angle(time: np.ndarray, signal: np.ndarray, how: Keyphasor) -> tuple[np.ndarray, np.ndarray]:
    """Angle [rad] and speed [rad/s] (n,) of the shaft: monotone cubics between pulses, constant speed next to them.

    Farther outside than `OUTSIDE` intervals of the pulses both are missing (NaN): nothing shows how the shaft turned.
    """
    from scipy.interpolate import PchipInterpolator

    pulses = pulse_times(time, signal, how)
    turns = 2 * np.pi / how.pulses * np.arange(pulses.size)
    curve = PchipInterpolator(pulses, turns)
    rate = curve.derivative()
    inside = np.clip(time, pulses[0], pulses[-1])
    ends = np.where(time < pulses[0], (turns[1] - turns[0]) / (pulses[1] - pulses[0]), 0.0)
    ends = np.where(time > pulses[-1], (turns[-1] - turns[-2]) / (pulses[-1] - pulses[-2]), ends)
    speed = np.where(ends > 0, ends, rate(inside))
    shown = np.abs(ends * (time - inside)) <= OUTSIDE * (turns[1] - turns[0])
    return np.where(shown, curve(inside) + ends * (time - inside), np.nan), np.where(shown, speed, np.nan)


def angle_by_stretches(time: np.ndarray, signal: np.ndarray, how: Keyphasor) -> tuple[np.ndarray, np.ndarray]:
    """`shaft_angle` of every stretch without missing values and gaps; NaN elsewhere and where pulses are too few.

    In each stretch the angle begins anew at its first pulse. Raises ReadError where no stretch has an angle.
    """
    parts = whole_slices(time, ~np.isfinite(signal) | ~np.isfinite(time))
    if len(parts) == 1 and parts[0] == slice(0, time.size):
        return shaft_angle(time, signal, how)
    angle, speed = np.full(time.size, np.nan), np.full(time.size, np.nan)
    reason = ReadError("has no values")
    for part in parts:
        try:
            angle[part], speed[part] = shaft_angle(time[part], signal[part], how)
        except ReadError as error:
            reason = error
    if not np.isfinite(angle).any():
        raise reason
    return angle, speed


HARMONICS, BINS, RARE = 12, 2000, 0.3
TURN = 2 * np.pi
KINDS = ("harmonic", "table")


@dataclass(frozen=True, eq=False)
class Runout:
    """`values`: coefficients (2 n, 2) of cosines and sines, or a table (bins, 2); both [m], over the shaft angle."""

    kind: str
    values: np.ndarray

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Runout (n, 2) [m] at angles (n,) [rad]."""
        if self.kind == "harmonic":
            return harmonics(angle, len(self.values) // 2) @ self.values
        place = np.mod(angle, TURN) / TURN * len(self.values) - 0.5
        low = np.floor(place).astype(int)
        share = (place - low)[:, None]
        n = len(self.values)
        return (1 - share) * self.values[low % n] + share * self.values[(low + 1) % n]


def harmonics(angle: np.ndarray, count: int) -> np.ndarray:
    """Cosines and sines (n, 2 count) of multiples of the angle (n,)."""
    turns = np.exp(1j * np.outer(angle, np.arange(1, count + 1)))
    return np.hstack([turns.real, turns.imag])


def estimate_runout(
    angle: np.ndarray, y: np.ndarray, kind: str = "harmonic", count: int = HARMONICS, bins: int = BINS
) -> Runout:
    """Runout of displacements y (n, 2) [m] measured at shaft angles (n,) [rad]; its mean over a turn is zero.

    Raises
    ------
    UnfitError
        If the shaft does not turn at least twice.

    Examples
    --------
    >>> import rotorsim as rs
    >>> angle = np.linspace(0.0, 8 * np.pi, 400)
    >>> runout = rs.identification.estimate_runout(angle, 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)]))
    >>> float(abs(runout.values).max().round(9))
    1e-06
    """
    turns = abs(angle[-1] - angle[0]) / TURN
    if turns < 2 * (1 - 1e-3):  # an encoder rounds the last angle down
        raise UnfitError(
            f"runout: the shaft turns {turns:.2g} times, the filter needs 2 turns or more; record longer at speed"
        )
    if kind == "harmonic":
        return Runout(kind, fit_harmonics(angle, y, fitting_count(angle, count)))
    if kind == "table":
        return Runout(kind, _table(angle, y, bins))
    raise UnfitError(f"runout: kind {kind!r}; choose 'harmonic' or 'table'")


def fit_harmonics(angle: np.ndarray, y: np.ndarray, count: int) -> np.ndarray:
    """Coefficients (2 count, 2) [m] of cosines and sines of y (n, 2) [m] over angles (n,) [rad], next to a mean."""
    basis = np.column_stack([np.ones(len(angle)), harmonics(angle, count)])
    return np.asarray(np.linalg.lstsq(basis, y, rcond=1e-8)[0][1:])


def fitting_count(angle: np.ndarray, count: int) -> int:
    """Number of harmonics, at most `count`, that stay below the Nyquist frequency."""
    step = abs(angle[-1] - angle[0]) / (len(angle) - 1)
    return max(1, min(count, int(0.95 * np.pi / step)))


def _table(angle: np.ndarray, y: np.ndarray, bins: int) -> np.ndarray:
    at = np.minimum((np.mod(angle, TURN) / TURN * bins).astype(int), bins - 1)
    visits = np.bincount(at, minlength=bins)
    # an encoder on the edge of a count fills a bin by chance now and then; one noisy visit is not a mean
    seen = np.flatnonzero(visits > RARE * visits[visits > 0].mean())
    table = np.empty((bins, 2))
    for axis in range(2):
        mean = np.bincount(at, y[:, axis], bins)[seen] / visits[seen]
        table[:, axis] = np.interp(np.arange(bins), seen, mean, period=bins)
    return table - table.mean(axis=0)


def on_angle(angle: np.ndarray, y: np.ndarray, per_turn: int = 256) -> tuple[np.ndarray, np.ndarray]:
    """Samples resampled evenly over the shaft angle: angles (k,) [rad] and values (k, 2) by straight lines.

    Examples
    --------
    >>> import rotorsim as rs
    >>> angle, values = rs.identification.on_angle(turning["angle"].values, turning["disc"].values, per_turn=64)
    >>> values.shape == (angle.size, 2)
    True
    """
    first, last = sorted((angle[0], angle[-1]))
    grid = np.arange(np.ceil(first * per_turn / TURN), np.floor(last * per_turn / TURN) + 1) * TURN / per_turn
    order = np.argsort(angle, kind="stable")
    return grid, np.column_stack([np.interp(grid, angle[order], column[order]) for column in y.T])


ATTRIBUTE = "slow_roll"
ALREADY = "subtracted before it was recorded"
SLOW = 0.5
"""Largest share of a record's highest speed at which the shaft rolls slowly."""
SlowVectors = dict[tuple[int, str], complex]


@dataclass(frozen=True)
class SlowRollSource:
    """One of: `subtracted` already; `file` of a slow roll; rows `below` a speed [rad/s]; vectors [m] of order, axis."""

    subtracted: bool = False
    file: Path | None = None
    below: float | None = None
    vectors: SlowVectors = field(default_factory=dict)


def parse_slow_roll(table: dict[str, Any], order_of: Callable[[str], int], folder: Path) -> SlowRollSource:
    """Section [slow_roll] of a mapping; raises ReadError for no or more than one source."""
    keys = {"subtracted", "file", "below"} & set(table)
    orders = [key for key in table if key not in keys]
    if len(keys) + bool(orders) != 1:
        raise ReadError(
            "slow_roll: give one of subtracted = true, file = 'slow.csv', below = '400 rpm' and [slow_roll.1X.x]; "
            "it is subtracted once"
        )
    if "subtracted" in keys and table["subtracted"] is not True:
        raise ReadError(f"slow_roll.subtracted: {quote(table['subtracted'])}; write true, or leave the section out")
    if "file" in keys and not isinstance(table["file"], str):
        raise ReadError(f"slow_roll.file: {quote(table['file'])}; give the path of a slow roll's file")
    return SlowRollSource(
        "subtracted" in keys,
        folder / table["file"] if "file" in keys else None,
        quantity_at("slow_roll.below", table["below"], "rad/s") if "below" in keys else None,
        {
            key: value
            for order in orders
            for key, value in _stated_vectors(order, table[order], order_of(order)).items()
        },
    )


def _stated_vectors(name: str, axes: Any, order: int) -> SlowVectors:
    found = {}
    for axis, parts in axes.items() if isinstance(axes, dict) else ():
        path = f"slow_roll.{name}.{axis}"
        if axis not in AXES or not isinstance(parts, dict) or set(parts) != {"amplitude", "phase"}:
            raise ReadError(f"{path}: write e.g. [slow_roll.1X.x] with amplitude = '8 um pp' and phase = '30 deg'")
        size = amplitude_at(f"{path}.amplitude", parts["amplitude"])
        found[order, axis] = size * np.exp(-1j * quantity_at(f"{path}.phase", parts["phase"], "rad"))
    if not found:
        raise ReadError(f"slow_roll.{name}: write e.g. [slow_roll.1X.x] with amplitude and phase")
    return found


def without_slow_roll(record: xr.Dataset, how: SlowRollSource, slow: xr.Dataset | None = None) -> xr.Dataset:
    """The record less its slow roll; `slow` is what `how.file` holds.

    Raises SchemaError if it is subtracted already, if the slow roll is none, or if a record lacks the angle.
    """
    if done := record.attrs.get(ATTRIBUTE):
        raise SchemaError(
            f"slow roll: was {done}; leave [slow_roll] out, it is subtracted once", argument="slow_roll", value=done
        )
    if how.subtracted:
        return record.assign_attrs({ATTRIBUTE: ALREADY})
    if slow is not None and slow.attrs.get(ATTRIBUTE):
        raise SchemaError("slow roll: its own slow roll is subtracted, nothing is left of it; give the original")
    if "speed" in record.dims:
        vectors, source = _of_vectors(record, how, slow)
        found = _less_vectors(record, vectors)
    else:
        found, source = _less_harmonics(record, how, slow)
    text = f"subtracted: {source}"
    return with_notes(found.assign_attrs({ATTRIBUTE: text}), [f"slow roll {text}"])


def _of_vectors(record: xr.Dataset, how: SlowRollSource, slow: xr.Dataset | None) -> tuple[SlowVectors, str]:
    """Vectors of the slow roll, and where they come from."""
    if how.vectors:
        return how.vectors, "vectors of the mapping"
    if how.below is not None:
        slow = record.isel(speed=np.flatnonzero(np.abs(record["speed"].values) < how.below))
        if not slow.sizes["speed"]:
            raise SchemaError(f"slow roll: no row below {how.below * TO_RPM:.4g} rpm; raise slow_roll.below")
    assert slow is not None
    if "speed" not in slow.dims:
        raise SchemaError("slow roll: is a time series, and the record holds vectors; give vectors of the slow roll")
    top = float(np.abs(slow["speed"].values).max())
    _check_slow(top, float(np.abs(record["speed"].values).max()))
    mean = (slow["amplitude"] * np.exp(-1j * slow["phase"])).mean("speed")
    every = [(int(n), str(axis)) for n in mean["order"].values for axis in mean["axis"].values]
    vectors = {(n, axis): complex(mean.sel(order=n, axis=axis)) for n, axis in every}
    return vectors, f"mean of {slow.sizes['speed']} rows up to {top * TO_RPM:.4g} rpm"


def _less_vectors(record: xr.Dataset, vectors: SlowVectors) -> xr.Dataset:
    amplitude = (record["amplitude"] * np.exp(-1j * record["phase"])).values.copy()
    orders, axes = record["order"].values.tolist(), record["axis"].values.tolist()
    for (order, axis), value in vectors.items():
        if order in orders and axis in axes:
            amplitude[:, orders.index(order), axes.index(axis)] -= value
    out = record.copy()
    out["amplitude"] = (record["amplitude"].dims, np.abs(amplitude), record["amplitude"].attrs)
    out["phase"] = (record["phase"].dims, -np.angle(amplitude), record["phase"].attrs)
    return out


def _less_harmonics(record: xr.Dataset, how: SlowRollSource, slow: xr.Dataset | None) -> tuple[xr.Dataset, str]:
    angle, motion = _turning(record, "the record")
    if how.below is not None:
        rolling = _rolling(record, angle, how.below)
        _check_slow(how.below, _speed(record, angle))
        shown = estimate_runout(angle[rolling], motion[rolling]).at(angle)
        source = f"the record's own motion below {how.below * TO_RPM:.4g} rpm"
    elif how.vectors:
        shown = np.zeros_like(motion)
        for (order, axis), value in how.vectors.items():
            shown[:, AXES.index(axis)] += (value * np.exp(1j * order * angle)).real
        source = "vectors of the mapping"
    else:
        assert slow is not None
        if "speed" in slow.dims:
            raise SchemaError("slow roll: holds vectors, and the record is a time series; give a slow roll over time")
        own, rolled = _turning(slow, "the slow roll")
        speed, high = _speed(slow, own), _speed(record, angle)
        _check_slow(speed, high)
        shown = estimate_runout(own, rolled).at(angle)
        source = f"record at {speed * TO_RPM:.4g} rpm"
    out = record.copy()
    out["disc_measured"] = (record["disc_measured"].dims, motion - shown, record["disc_measured"].attrs)
    return out, source


def _rolling(record: xr.Dataset, angle: np.ndarray, below: float) -> slice:
    """The longest stretch of a record in which the shaft turns slower than a speed [rad/s]."""
    time = np.asarray(record["time"].values, float)
    speed = measured(record, "speed")
    speed = np.gradient(angle, time) if speed is None else np.asarray(speed, float)
    parts = whole_slices(time, ~(np.abs(speed) < below))
    if not parts:
        raise SchemaError(
            f"slow roll: the shaft never turns slower than {below * TO_RPM:.4g} rpm; raise slow_roll.below, or give a "
            "file"
        )
    return max(parts, key=lambda part: part.stop - part.start)


def _turning(record: xr.Dataset, which: str) -> tuple[np.ndarray, np.ndarray]:
    angle = measured(record, "angle")
    if angle is None or "disc_measured" not in record:
        raise SchemaError(f"slow roll: {which} has no shaft angle or no disc_measured; map a keyphasor and the probes")
    return angle, np.asarray(record["disc_measured"].values, float)


def _speed(record: xr.Dataset, angle: np.ndarray) -> float:
    """Highest speed [rad/s] of a tenth of a record."""
    time = np.asarray(record["time"].values, float)
    parts = [part for part in np.array_split(np.arange(time.size), 10) if part.size > 1]
    rates = [abs(angle[p[-1]] - angle[p[0]]) / (time[p[-1]] - time[p[0]]) for p in parts]
    return float(np.nanmax(rates))


def _check_slow(slow: float, high: float) -> None:
    if slow > SLOW * high:
        raise SchemaError(
            f"slow roll: {slow * TO_RPM:.4g} rpm is not slow for a record up to {high * TO_RPM:.4g} rpm; "
            f"give one below {SLOW * high * TO_RPM:.4g} rpm"
        )

"""Sensors of a laboratory: displacement probes at any angle, and the keyphasor that gives the shaft angle.

Two or more displacement probes at one plane give the motion in x and y there. A probe at the angle a reads r = g (x cos
a + y sin a), its gain g holding sensitivity and sense; two at different angles give x and y, more of them by least
squares.

A proximity probe gives volts round its gap voltage. DC-coupled, the gap voltage (or the mean) is taken off, so that
motion is measured from there; without either the reading stays as it is. AC-coupled, there is no mean to measure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ReadError, SchemaError
from identification.records.schema import require
from identification.records.stretches import whole_slices
from identification.records.units import quantity_at
from rotorsim.base.display import did_you_mean, quote

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
    """Names of the probes at the disc's plane, the position `wanted` [m] or the only one there is."""
    places = {name: probe.position for name, probe in probes.items()}
    if wanted is not None:
        found = tuple(name for name, z in places.items() if z is not None and abs(z - wanted) <= SAME_PLACE)
        if not found:
            raise ReadError(f"disc.position: no probe at {1e3 * wanted:.6g} mm; give the position of a probe")
        return found
    known = [z for z in places.values() if z is not None]
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
    """Angle [rad] and speed [rad/s] (n,) of the shaft: monotone cubics between pulses, constant speed outside."""
    from scipy.interpolate import PchipInterpolator

    pulses = pulse_times(time, signal, how)
    turns = 2 * np.pi / how.pulses * np.arange(pulses.size)
    curve = PchipInterpolator(pulses, turns)
    rate = curve.derivative()
    inside = np.clip(time, pulses[0], pulses[-1])
    ends = np.where(time < pulses[0], (turns[1] - turns[0]) / (pulses[1] - pulses[0]), 0.0)
    ends = np.where(time > pulses[-1], (turns[-1] - turns[-2]) / (pulses[-1] - pulses[-2]), ends)
    speed = np.where(ends > 0, ends, rate(inside))
    return curve(inside) + ends * (time - inside), speed


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

"""Shaft angle from the pulses of a keyphasor: edges with hysteresis, between which the angle runs smoothly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from identification.errors import ReadError
from identification.records.lab.whole_stretches import stretches

SHARE = 0.2
"""Hysteresis without a given one, as a share of the signal's range."""
UNEVEN = 1.6
"""Factor between neighbouring intervals above which a pulse is missing or there is one too many."""
FEWEST = 4


@dataclass(frozen=True)
class Keyphasor:
    """How pulses are found: level and hysteresis in the signal's unit, both from its range if None.

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
    band = SHARE * (high - low) if how.hysteresis is None else how.hysteresis
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
    parts = stretches(time, ~np.isfinite(signal) | ~np.isfinite(time))
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

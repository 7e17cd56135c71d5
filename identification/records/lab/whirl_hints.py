r"""Hints that phases are leads or that axes are exchanged or mirrored; only reported, never corrected.

Unbalance whirls forward, and its phase lag grows through a resonance. With complex amplitudes A of an order,
:math:`|A_x + i A_y|/2` is its forward and :math:`|A_x - i A_y|/2` its backward part. Phases that are leads conjugate
the amplitudes: they turn both around. Exchanged axes, or one of the wrong sign, turn the whirl alone. Split supports
can whirl backward between two critical speeds, hence a hint needs the whole table.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorsim.base.constants import TO_RPM

if TYPE_CHECKING:
    import xarray as xr

BACKWARD = 2.0
"""Ratio of backward to forward amplitude from which whirl counts as backward."""
FALL = np.deg2rad(60.0)
"""A phase lag that falls by so much [rad] about a peak is a lead."""
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
    angle = next((record[name] for name in ("angle_measured", "angle") if name in record), None)
    disc = next((record[name] for name in ("disc_measured", "disc") if name in record), None)
    if angle is None or disc is None or disc.ndim != 2 or disc.shape[1] != 2:
        return []
    step = max(1, disc.shape[0] // EVERY)
    motion, turned = np.asarray(disc.values, float)[::step], np.asarray(angle.values, float)[::step]
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

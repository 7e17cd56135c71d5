"""Speeds at which the final model of a run-up's vectors misses the measured ones, in sentences.

An amplitude is missed by more than a tenth of the order's largest one, a phase by more than 15 deg. Phases of
amplitudes, and orders, that are hardly above their floor do not count.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.discrepancy.search.candidates import NO_SOLUTION

AMPLITUDE, PHASE = 0.10, np.deg2rad(15.0)
ABOVE = 3.0
"""Amplitudes below so many times the floor have no phase."""
NEAR = 0.05
"""Bands that are less than this share of all rows apart are one."""


def missed_bands(shown: Iterable[dict[str, Any]], model: str = "the model") -> list[str]:
    """Sentences on the rows of vectors that `spectra_of` shows, an order and channel each; none for records."""
    parts = [one for one in shown if one["orders"]]
    tables: dict[str, list[dict[str, Any]]] = {}
    for one in parts:
        tables.setdefault(one["record"].rpartition(",")[0], []).append(one)
    return [
        f"{name}, {channel}, {order}X: {model} misses {missed}"
        for name, own in tables.items()
        for k, order in enumerate(own[0]["orders"])
        for c, channel in enumerate(own[0]["channels"])
        if (missed := _missed(*_rows(own, c, k)))
    ]


def _rows(parts: Sequence[dict[str, Any]], channel: int, number: int) -> tuple[np.ndarray, ...]:
    """Speeds (k,) [rad/s] that rise, measured and simulated vectors and floors (k,) [m] of all parts of a table."""
    speed = np.concatenate([one["speeds"] for one in parts])
    measured = np.concatenate([one["measured_vectors"][channel, number] for one in parts])
    simulated = np.concatenate([one["simulated_vectors"][-1][channel, number] for one in parts])
    floor = np.concatenate([one["floor"][channel].reshape(-1, len(one["speeds"]))[number] for one in parts])
    rising = np.argsort(speed)
    return speed[rising], measured[rising], simulated[rising], floor[rising]


def _missed(speed: np.ndarray, measured: np.ndarray, simulated: np.ndarray, floor: np.ndarray) -> str:
    """What is missed, by how much at most, and where; empty where nothing is."""
    clear = np.abs(measured) > ABOVE * floor
    if not clear.any():
        return ""
    if np.abs(simulated).max() > NO_SOLUTION / 2:
        return f"all: it has no solution at {_bands(speed, np.abs(simulated) > NO_SOLUTION / 2)}"
    top = float(np.abs(measured).max())
    off = np.abs(np.abs(simulated) - np.abs(measured))
    turned = np.where(clear, np.abs(np.angle(simulated * np.conj(measured))), 0.0)
    found = []
    if off.max() > AMPLITUDE * top:
        worst = f"up to {off.max() * TO_UM:.3g} um ({100 * off.max() / top:.0f} % of its peak)"
        found.append(f"the amplitude by {worst} at {_bands(speed, off > AMPLITUDE * top)}")
    if turned.max() > PHASE:
        found.append(f"the phase by up to {np.rad2deg(turned.max()):.0f} deg at {_bands(speed, turned > PHASE)}")
    return " and ".join(found)


def _bands(speed: np.ndarray, missed: np.ndarray) -> str:
    """Bands of speeds as text: rows that are missed, those near to each other joined."""
    rows = np.flatnonzero(missed)
    near = max(2, round(NEAR * len(speed)))
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > near) + 1)
    rpm = speed * TO_RPM
    ends = [(f"{rpm[run[0]]:.0f}", f"{rpm[run[-1]]:.0f}") for run in runs]
    return ", ".join(low if low == high else f"{low}-{high}" for low, high in ends) + " rpm"

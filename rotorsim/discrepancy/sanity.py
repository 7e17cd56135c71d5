"""Mistakes of a record that look like physics: units, clocks, channels, another machine. Suggested, never assumed."""

from __future__ import annotations

import numpy as np

from rotorsim.discrepancy.comparison import Comparison
from rotorsim.errors import DataError

FACTORS = {25.4: "mils or inches taken for millimetres", 1e3: "mm taken for um or the like",
           1e6: "metres taken for micrometres", 39.37: "an inch-based unit"}  # fmt: skip
UNLIKE = 0.5
"""Share of the response that must be alike before anything is named."""


def check(comparison: Comparison, simulated: np.ndarray, fitted: np.ndarray) -> list[str]:
    """Sentences about what looks like a mistake; raises DataError where the records cannot be this machine's.

    simulated (n,) [m] is at the nominal point, fitted (n,) [m] after re-calibration.
    """
    moving = comparison.layout.frequency > 0
    y, s, f = comparison.measured[moving], simulated[moving], fitted[moving]
    remaining = float(np.linalg.norm(y - f)) / max(float(np.linalg.norm(y)), 1e-300)
    if remaining < UNLIKE:
        return []
    ratio = float(np.linalg.norm(y)) / max(float(np.linalg.norm(s)), 1e-300)
    for factor, what in FACTORS.items():
        for share in (factor, 1 / factor):
            if abs(ratio / share - 1) < 0.35 and np.linalg.norm(y / ratio - s) < 0.8 * np.linalg.norm(s):
                raise DataError(
                    f"records: displacements are {ratio:.3g} times those of the machine file, about {share:.4g}: are "
                    f"there {what}? state the unit in the mapping; nothing was assumed"
                )
    _check_swap(comparison, y, s, moving)
    _check_clock(comparison, simulated)
    if remaining > 0.95:
        raise DataError(
            "records: even re-calibrated, the machine file explains none of the response; are they of this machine, "
            "and is the machine file's name, speed and pressure right?"
        )
    return [
        f"re-calibrated, the machine file leaves {100 * remaining:.0f} % of the response unexplained: check that the "
        "records are of this machine"
    ]


def _check_swap(comparison: Comparison, y: np.ndarray, s: np.ndarray, moving: np.ndarray) -> None:
    """x and y exchanged."""
    layout = comparison.layout
    exchanged = s.copy()
    record, channel = layout.record[moving], layout.channel[moving]
    for i in range(len(comparison.trials)):
        x, z = (record == i) & (channel == 0), (record == i) & (channel == 1)
        exchanged[x], exchanged[z] = s[z], s[x]
    if np.linalg.norm(y - exchanged) < 0.5 * min(np.linalg.norm(y - s), np.linalg.norm(y)):
        raise DataError("records: channels x and y fit when they are exchanged; check the mapping of the sensors")


def _check_clock(comparison: Comparison, simulated: np.ndarray) -> None:
    """Displacement shifted in time against the inputs by one lag common to a record's excited lines."""
    layout = comparison.layout
    for i, trial in enumerate(comparison.trials):
        found = []
        for c in range(2):
            own = np.flatnonzero((layout.record == i) & (layout.channel == c))[2:]
            half = len(own) // 2
            y = comparison.measured[own[:half]] + 1j * comparison.measured[own[half:]]
            s = simulated[own[:half]] + 1j * simulated[own[half:]]
            at = trial.excited[1:]
            if at.sum() < 4:
                return
            f = trial.frequencies[1:][at]
            lags = np.linspace(-0.02, 0.02, 801)
            match = [np.abs(np.vdot(s[at] * np.exp(-2j * np.pi * f * lag), y[at]).real) for lag in lags]
            power = np.linalg.norm(y[at]) * np.linalg.norm(s[at])
            if max(match) > 0.9 * power and match[400] < 0.6 * max(match):
                found.append(lags[int(np.argmax(match))])
        if len(found) == 2 and abs(found[0] - found[1]) < 2e-4:
            raise DataError(
                f"{trial.name}: displacement runs {found[0] * 1e3:+.2f} ms beside the inputs; are the clocks of the "
                "two recorders aligned? shift one of them; nothing was assumed"
            )

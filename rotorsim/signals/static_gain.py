"""Static gain from a staircase: rest position of the disc at each reference (thesis C.3.1, figure C.5).

Rest is the mean over the last part of a step, over whole revolutions where the shaft turns and one fits. For each
driven axis a line is fitted to all its steps; what is left is the deviation, and the difference between the ways up and
down is the hysteresis. Works on any record of the schema, so also on one of a rig.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.base.constants import SAMPLE
from rotorsim.base.errors import DataError

if TYPE_CHECKING:
    import xarray as xr

SHORTEST = 10
"""Samples that a step needs at least; shorter ones are not a rest."""
AXIS = ("x", "y")
NAMES = {
    "gain": "static gain",
    "offset": "disc at no reference",
    "deviation_max": "largest deviation from linear",
    "deviation_rms": "rms deviation from linear",
    "hysteresis": "largest opening between up and down",
}


def static_gain_map(record: xr.Dataset, share: float = 0.5, variable: str | None = None) -> xr.Dataset:
    """Static gains of a staircase record.

    Parameters
    ----------
    record : Dataset
        With `reference` [V] and `disc_measured` or `disc` [m]; each step drives one axis, or neither.
    share : float
        Last part of every step that is averaged, above 0 and at most 1.
    variable : str, optional
        Displacement to take; `disc_measured` if the record has it, else `disc`.

    Returns
    -------
    Dataset
        reference (step, axis) [V] and disc (step, axis) [m]; gain (output, input) [m/V], offset (output, input) [m],
        deviation_max, deviation_rms and hysteresis (output, input) [m] for the driven inputs: the largest and the rms
        distance from the line, and the largest opening between the ways up and down.

    Raises
    ------
    DataError
        If a variable is missing or no axis is driven over three levels.
    """
    import xarray as xr

    if not 0 < share <= 1:
        raise DataError(f"share = {share}: must be above 0 and at most 1; give e.g. 0.5")
    levels, rest = rests(record, share, variable)
    driven = [axis for axis in range(2) if len(np.unique(levels[:, axis])) >= 3]
    if not driven:
        raise DataError("record: no axis of its reference has three levels; give the record of a staircase")
    fits = [fit_axis(levels, rest, axis) for axis in driven]
    length, gain = {"units": "m"}, {"units": "m/V"}
    columns = {name: np.stack([fit[name] for fit in fits], axis=1) for name in fits[0]}
    variables = {
        name: (("output", "input"), columns[name], (gain if name == "gain" else length) | {"long_name": label})
        for name, label in NAMES.items()
    }
    steps = {"reference": (("step", "axis"), levels, {"units": "V", "long_name": "reference of a step"}),
             "disc": (("step", "axis"), rest, length | {"long_name": "disc at rest"})}  # fmt: skip
    coords = {"axis": list(AXIS), "output": list(AXIS), "input": [AXIS[axis] for axis in driven]}
    return xr.Dataset(steps | variables, coords, {"share": share})


def rests(record: xr.Dataset, share: float, variable: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Levels (n, 2) [V] and rests of the disc (n, 2) [m] of all steps that are long enough."""
    wanted = ("disc_measured", "disc") if variable is None else (variable,)
    disc = next((name for name in wanted if name in record), None)
    if disc is None or "reference" not in record:
        raise DataError(f"record: lacks 'reference' or '{wanted[0]}'; give the record of a staircase")
    reference, position = (np.asarray(record[name].values, float) for name in ("reference", disc))
    speed = np.asarray(record["speed"].values, float) if "speed" in record else np.zeros(len(reference))
    jumps = np.flatnonzero(np.any(np.diff(reference, axis=0) != 0, axis=1)) + 1
    steps = [(a, b) for a, b in pairwise([0, *jumps, len(reference)]) if b - a >= SHORTEST]
    if not steps:
        raise DataError("record: the reference never rests; give the record of a staircase")
    windows = [window(a, b, share, abs(float(speed[a:b].mean()))) for a, b in steps]
    rest = np.array([position[b - n : b].mean(axis=0) for (_, b), n in zip(steps, windows, strict=True)])
    return reference[[a for a, _ in steps]], rest


def window(a: int, b: int, share: float, speed: float) -> int:
    """Samples to average at the end of a step: whole revolutions where one fits."""
    n = max(round((b - a) * share), 1)
    turn = 2 * np.pi / (speed * SAMPLE) if speed > 0 else np.inf
    return round(n // turn * turn) if n >= turn else n


def fit_axis(levels: np.ndarray, rest: np.ndarray, axis: int) -> dict[str, np.ndarray]:
    """Line, deviations and hysteresis (2,) of both outputs over the steps that drive one axis."""
    mine = levels[:, 1 - axis] == 0
    r, p = levels[mine, axis], rest[mine]
    if len(np.unique(levels[:, 1 - axis])) > 1:  # without the rests at 0 V of the other axis' staircase
        swept = np.flatnonzero(r != 0)
        r, p = r[max(swept[0] - 1, 0) : swept[-1] + 2], p[max(swept[0] - 1, 0) : swept[-1] + 2]
    slope, offset = np.polyfit(r, p, 1)
    left = p - np.outer(r, slope) - offset
    return {"gain": slope, "offset": offset, "deviation_max": np.abs(left).max(axis=0),
            "deviation_rms": np.sqrt((left**2).mean(axis=0)), "hysteresis": opening(r, p)}  # fmt: skip


def opening(r: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Largest difference (2,) between rests at the same level reached from below and from above; 0 without both."""
    way = np.sign(np.diff(r, prepend=r[0]))
    widest = np.zeros(2)
    for level in np.unique(r):
        up, down = p[(r == level) & (way > 0)], p[(r == level) & (way < 0)]
        if len(up) and len(down):
            widest = np.maximum(widest, np.abs(up[:, None] - down[None]).max(axis=(0, 1)))
    return widest

"""Stretches of constant reference in a record, and the rest positions of disc and pins in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.missing import need
from rotorsim.signals.prepare import sampling_time
from rotorsim.signals.record_blocks import Values, blocks

LEAST = 0.1
"""Shortest stretch [s] that counts where no number of samples is given."""
FEWEST = 3
"""Levels of a gain."""


@dataclass(frozen=True)
class Holds:
    """Steps in order: `reference` (step, axis) [V], `disc` (step, axis) [m], `pin` (step, injector) [m] or None, over
    samples `start` to `stop` (step,); `output` is the displacement's name."""

    reference: np.ndarray
    disc: np.ndarray
    pin: np.ndarray | None
    start: np.ndarray
    stop: np.ndarray
    output: str


def find_holds(record: xr.Dataset, shortest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First sample, sample after the last, reference (step, axis) [V] of stretches of `shortest` samples or more."""
    found: list[tuple[int, int, np.ndarray]] = []
    begin, last, position = 0, None, 0
    for block in blocks(record, ("reference",)):
        r = block["reference"]
        joined = r if last is None else np.vstack((last, r))
        shift = position - (last is not None)
        for i in np.flatnonzero(np.any(np.diff(joined, axis=0) != 0, axis=1)) + 1:
            if shift + i - begin >= shortest:
                found.append((begin, int(shift + i), joined[i - 1]))
            begin = int(shift + i)
        last, position = r[-1:], position + len(r)
    if last is not None and position - begin >= shortest:
        found.append((begin, position, last[0]))
    starts, stops, values = ([row[k] for row in found] for k in range(3))
    return np.array(starts, int), np.array(stops, int), np.array(values, float).reshape(len(found), 2)


def rest(record: xr.Dataset, output: str, shortest: int | None = None, share: float = 0.5) -> Holds:
    """Mean positions in the last `share` of every hold, over whole revolutions where the shaft makes one in it.

    Records of any length: displacements are read in blocks, and only if the reference takes enough levels.

    Raises
    ------
    MissingError
        If neither axis of the reference rests at three levels.
    """
    need("reference" in record, "The record has no reference of the actuators.")
    least = max(2, round(LEAST / sampling_time(record))) if shortest is None else shortest
    start, stop, reference = find_holds(record, least)
    levels = max(len(np.unique(reference[:, axis])) for axis in (0, 1))
    seconds = f"{least * sampling_time(record):.3g} s or longer"
    need(levels >= FEWEST, f"The reference rests at {levels} levels for {seconds}; a gain takes {FEWEST}.")
    names = [output, *(["pin"] if "pin" in record else [])]
    first = [b - _window(record, a, b, share) for a, b in zip(start, stop, strict=True)]
    means = [_means(record, names, a, b) for a, b in zip(first, stop, strict=True)]
    disc, *pin = (np.array([row[name] for row in means]) for name in names)
    return Holds(reference, disc, pin[0] if pin else None, start, stop, output)


def _window(record: xr.Dataset, start: int, stop: int, share: float) -> int:
    """Samples to average at the end of a hold."""
    n = max(round((stop - start) * share), 1)
    if "speed" not in record:
        return n
    speed = abs(float(_means(record, ["speed"], start, stop)["speed"]))
    turn = 2 * np.pi / (speed * round(sampling_time(record), 12)) if speed > 0 else np.inf
    return round(n // turn * turn) if n >= turn else n


def _means(record: xr.Dataset, names: list[str], start: int, stop: int) -> Values:
    """Mean of some variables from sample `start` to before `stop`, read in blocks."""
    totals: Values = {}
    for block in blocks(record[names].isel(time=slice(start, stop)), names):
        totals = {name: totals.get(name, 0.0) + block[name].sum(axis=0) for name in names}
    return {name: total / (stop - start) for name, total in totals.items()}

"""Stretches of constant reference in a record, and the rest positions of disc and pins in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.missing import need
from rotorsim.signals.prepare import sampling_time
from rotorsim.signals.record_blocks import blocks

LEAST = 0.1
"""A stretch counts from so many seconds on."""
LONGEST = 5.0
"""A rest is averaged over the last half of a stretch, at most so many seconds of it."""
FEWEST = 3


@dataclass(frozen=True)
class Holds:
    """Steps in order: `reference` (step, axis) [V], `disc` and its `scatter` (step, axis) [m], `pin` (step,
    injector) [m] or None, over samples `start` to `stop` (step,); `output` is the displacement's name."""

    reference: np.ndarray
    disc: np.ndarray
    scatter: np.ndarray
    pin: np.ndarray | None
    start: np.ndarray
    stop: np.ndarray
    output: str


def find_holds(record: xr.Dataset, least: float = LEAST) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First sample, sample after the last, and reference (step, axis) [V] of stretches of `least` seconds or more."""
    shortest = max(2, round(least / sampling_time(record)))
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


def rest(record: xr.Dataset, output: str, least: float = LEAST) -> Holds:
    """Mean positions in the last half of every hold, over whole revolutions where the shaft makes them.

    Raises
    ------
    MissingError
        With fewer than three holds of different reference.
    """
    need("reference" in record, "The record has no reference of the actuators.")
    start, stop, reference = find_holds(record, least)
    levels = len(np.unique(reference, axis=0)) if len(start) else 0
    need(levels >= FEWEST, f"The reference rests at {levels} levels for {least:g} s or longer; a gain takes {FEWEST}.")
    names = [output, "angle", *(["pin"] if "pin" in record else [])]
    cap = max(2, round(LONGEST / sampling_time(record)))
    rows = [_settled(record, names, max((a + b) // 2, b - cap), b) for a, b in zip(start, stop, strict=True)]
    disc, scatter, pin = (np.array(part) for part in zip(*rows, strict=True))
    return Holds(reference, disc, scatter, pin if "pin" in record else None, start, stop, output)


def _settled(record: xr.Dataset, names: list[str], start: int, stop: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean and scatter (axis,) of the disc and mean (injector,) of the pins between two samples."""
    part = record[names].isel(time=slice(start, stop))
    angle = np.asarray(part["angle"].values, float)
    whole = np.floor(abs(angle[-1] - angle[0]) / (2 * np.pi) + 1e-9) * 2 * np.pi
    kept = np.abs(angle[-1] - angle) < whole - 1e-9 if whole else np.ones(len(angle), bool)
    disc = np.asarray(part[names[0]].values, float)[kept]
    pin = np.asarray(part["pin"].values, float)[kept].mean(axis=0) if "pin" in part else np.zeros(0)
    return disc.mean(axis=0), disc.std(axis=0), pin

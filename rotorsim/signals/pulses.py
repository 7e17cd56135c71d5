"""Detection of impacts, and the response to each without the steady motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.missing import need
from rotorsim.signals.prepare import sampling_time
from rotorsim.signals.record_blocks import Values, blocks

THRESHOLD = 0.05
"""A pulse is where the force exceeds this share of its largest value."""
APART, LONGEST = 0.01, 0.05
"""Pulses closer than the first time [s] are one; what lasts longer than the second is not an impact."""
BEFORE, AFTER = 0.5, 2.0
"""Time [s] before a pulse from which the motion of the turning shaft is taken, and after it that is kept, at most."""
LEAD = 0.002
ORDERS = (1, 2, 3, 4, 5, 6, 7, 8)
TURNS = 4
"""Orders are fitted over so many turns or more."""


@dataclass(frozen=True)
class Pulse:
    """Samples `start` to `stop` of a pulse, the `axis` along which it is strongest and its `peak` [N]; its answer
    runs to sample `end`, and the undisturbed motion before it begins at sample `before`."""

    before: int
    start: int
    stop: int
    end: int
    axis: int
    peak: float


def find_pulses(record: xr.Dataset, name: str = "disc_force") -> list[Pulse]:
    """All impacts of a record; raises MissingError where the force does not act in short pulses.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.signals.find_pulses(impact)) > 0
    True
    """
    need(name in record, "The record has no force on the disc.")
    dt, n = sampling_time(record), record.sizes["time"]
    largest = max(float(np.abs(b[name]).max()) for b in blocks(record, (name,)))
    need(largest > 0, "No force acts on the disc.")
    edges = _edges(_above(record, name, THRESHOLD * largest), round(APART / dt))
    short = bool(len(edges)) and all(b - a <= LONGEST / dt for a, b in edges)
    need(short, f"The force on the disc does not act in pulses shorter than {LONGEST * 1e3:.0f} ms.")
    lead = max(1, round(LEAD / dt))
    pulses, free = [], 0
    for k, (a, b) in enumerate(edges):
        nearest = edges[k + 1][0] - 2 * lead if k + 1 < len(edges) else n
        end = min(nearest, a + round(AFTER / dt))
        force = np.asarray(record[name].isel(time=slice(a, b)).values, float)
        axis = int(np.abs(force).max(axis=0).argmax())
        before = max(free, a - round(BEFORE / dt))
        pulses.append(Pulse(before, a, b, end, axis, float(force[np.abs(force[:, axis]).argmax(), axis])))
        free = (b + nearest) // 2
    return pulses


def _above(record: xr.Dataset, name: str, least: float) -> np.ndarray:
    """Samples at which either component exceeds `least`."""
    found, position = [], 0
    for block in blocks(record, (name,)):
        found.append(position + np.flatnonzero(np.abs(block[name]).max(axis=1) > least))
        position += len(block[name])
    return np.concatenate(found)


def _edges(above: np.ndarray, apart: int) -> list[tuple[int, int]]:
    """First sample and sample after the last of runs of samples less than `apart` from each other."""
    cuts = np.flatnonzero(np.diff(above) > apart)
    first, last = np.append(above[:1], above[cuts + 1]), np.append(above[cuts], above[-1:])
    return [(int(a), int(b) + 1) for a, b in zip(first, last, strict=True)]


def answer(record: xr.Dataset, pulse: Pulse, output: str) -> Values:
    """`time` (n,) [s] from the pulse on, `force` (n, 2) [N] and `disc` (n, 2) [m] from just before a pulse to its
    `end`, without mean and orders of the shaft, which are fitted before the pulse."""
    lead = min(pulse.start - pulse.before, max(1, round(LEAD / sampling_time(record))))
    part = record[["time", "angle", "disc_force", output]].isel(time=slice(pulse.before, pulse.end))
    values = {str(k): np.asarray(part[k].values, float) for k in part.variables if k != "axis"}
    quiet, cut = pulse.start - pulse.before, pulse.start - pulse.before - lead
    d = values[output] - steady_motion(values["angle"], values[output], quiet)
    time = values["time"] - values["time"][quiet]
    return {"time": time[cut:], "force": values["disc_force"][cut:], "disc": d[cut:]}


def steady_motion(angle: np.ndarray, d: np.ndarray, quiet: int) -> np.ndarray:
    """Mean and, where the shaft turns enough, orders fitted to the first `quiet` samples of d (n, 2), for all."""
    if quiet < 2:
        return d[:1]
    columns = [np.ones(len(angle))]
    if abs(angle[quiet - 1] - angle[0]) >= 2 * np.pi * TURNS:
        columns += [wave(n * angle) for n in ORDERS for wave in (np.cos, np.sin)]
    basis = np.column_stack(columns)
    c, *_ = np.linalg.lstsq(basis[:quiet], d[:quiet], rcond=None)
    return np.asarray(basis @ c)

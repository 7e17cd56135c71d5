"""Sampling time of a record, and checks for uneven time stamps and gaps.

Time stamps that a program rounded still count as even: each step may differ by a tenth from the mean one, and no stamp
lies further than half a sample from the even clock. A step of more than one and a half samples is a gap.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.errors import SchemaError

if TYPE_CHECKING:
    import xarray as xr

JITTER, DRIFT, GAP = 0.1, 0.5, 1.5
"""Largest deviation of a step, largest deviation of a stamp, smallest gap; all in samples."""
EXACT = 1e-9
"""Relative difference of rates that are the same."""

WAY_OUT = "cut it with 'rotorsim data cut', or read it with identification.load: identify leaves its gaps out"
"""Of records with gaps or without values somewhere."""


def sampling_time(record: xr.Dataset) -> float:
    """Time from sample to sample [s]; raises SchemaError if the record is not sampled evenly.

    Examples
    --------
    >>> import rotorsim as rs
    >>> round(rs.identification.sampling_time(record), 6)
    0.0002
    """
    time = np.asarray(record["time"].values, float)
    found = problems(time)
    if found:
        raise SchemaError(f"record.time: {found[0]}")
    return float(time[-1] - time[0]) / (time.size - 1)


def nominal_rate(time: np.ndarray) -> float:
    """Rate [Hz] of even time stamps (n,) [s]: the roundest number within what the rounding of the stamps leaves open.

    Stamps 0.000039, 0.000078, ... of a recorder at 25.6 kHz have the mean rate 25599.9999 Hz, and steps of 25641 Hz.
    """
    span = float(time[-1] - time[0])
    if time.size < 2 or not 0 < span < np.inf:
        return np.nan
    mean = (time.size - 1) / span
    off = np.abs(time - time[0] - np.arange(time.size) / mean).max()
    open_ = mean * (2 * off / span + EXACT)
    rounder = (round(mean, digits) for digits in range(-4, 7))
    return next((rate for rate in rounder if rate > 0 and abs(rate - mean) <= open_), mean)


def problems(time: np.ndarray) -> tuple[str, ...]:
    """Sentences about what is wrong with time stamps (n,) [s]; empty if nothing is."""
    if time.size < 2:
        return (f"{time.size} samples; a record needs at least 2",)
    wrong = np.flatnonzero(~np.isfinite(time))
    if wrong.size:
        return (f"{wrong.size} NaN or infinite time stamps, the first at sample {wrong[0] + 1}; cut them out",)
    with np.errstate(over="ignore", invalid="ignore"):  # a damaged file may hold any number
        steps = np.diff(time)
        return _order(time, steps) or _evenness(time, steps)


def _order(time: np.ndarray, steps: np.ndarray) -> tuple[str, ...]:
    """Faults in the order of the time stamps."""
    found = []
    for which, words, remedy in (
        (steps < 0, "falls", "sort or cut the record"),
        (steps == 0, "stands still", "remove the duplicated samples"),
    ):
        at = np.flatnonzero(which)
        if at.size:
            first = f"the first after sample {at[0] + 1} at {time[at[0]]:.6g} s"
            found.append(f"time {words} at {at.size} places, {first}; {remedy}")
    return tuple(found)


def _evenness(time: np.ndarray, steps: np.ndarray) -> tuple[str, ...]:
    """Faults of the steps of ascending time stamps."""
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if gaps.size:
        first = f"the first of {steps[gaps[0]]:.4g} s after {time[gaps[0]]:.6g} s"
        return (f"{gaps.size} gaps in samples {usual:.4g} s apart, {first}; {WAY_OUT}",)
    even = time[0] + np.arange(time.size) * ((time[-1] - time[0]) / (time.size - 1))
    # rounding of the stamps themselves must not count against a late start of a fast clock
    slack = 4 * float(np.spacing(np.abs(time).max()))
    if np.abs(steps - usual).max() > JITTER * usual + slack or np.abs(time - even).max() > DRIFT * usual + slack:
        spread = f"steps from {steps.min():.4g} s to {steps.max():.4g} s"
        return (f"sampled unevenly, {spread}; resample it at a fixed rate",)
    return ()

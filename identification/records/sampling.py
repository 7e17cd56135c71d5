"""Sampling of a record: its even clock, uneven time stamps, the stretches between gaps, resampling at a lower rate.

Time stamps that a program rounded still count as even: each step may differ by a tenth from the mean one, and no stamp
lies further than half a sample from the even clock. A step of more than one and a half samples is a gap.

Stamps that were rounded more coarsely, to decimals or to significant digits, are no clock of their own: where rounding
alone explains every stamp and every step, the rate follows from the whole length (`unrounded`).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.errors import SchemaError

if TYPE_CHECKING:
    import xarray as xr


JITTER, DRIFT, GAP = 0.1, 0.5, 1.5
"""Largest deviation of a step, largest deviation of a stamp, smallest gap; all in samples."""
COARSEST = 1e-3
"""Largest share of a record's length to which its stamps may be rounded."""
DIGITS = range(4, 10)
"""Significant digits to which a stamp may be rounded."""
DECIMALS = range(10)
"""Decimals to which a stamp [s] may be rounded."""
EXACT = 1e-9
"""Relative difference of rates that are the same."""
WAY_OUT = "cut it with 'rotorsim data cut', or read it with identification.load: identify leaves its gaps out"
"""Remedy for records with gaps or missing values."""


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


def unrounded(time: np.ndarray) -> np.ndarray:
    """The even times (n,) [s] whose rounded values are uneven stamps; the stamps themselves where that is not so.

    Rounding to r, up, down or to the nearest, moves no stamp by more than r and changes no step by more.
    """
    if not problems(time) or time.size < 3 or not np.isfinite(time).all() or not time[-1] > time[0]:
        return time
    step = 1 / nominal_rate(time)
    even = step * np.arange(time.size)
    off = time - even
    for size in _roundings(time):
        if size.max() > COARSEST * (time[-1] - time[0]):
            continue
        start = float(np.clip(0.5 * (off.max() + off.min()), time[0] - size[0], time[0] + size[0]))
        start = float(time[0]) if np.all(np.abs(off - time[0]) <= size) else start
        slack = 4 * float(np.spacing(np.abs(time).max()))
        larger = np.maximum(size[1:], size[:-1]) + slack
        if np.all(np.abs(off - start) <= size + slack) and np.all(np.abs(np.diff(time) - step) <= larger):
            return start + even
    return time


def _roundings(time: np.ndarray) -> Iterator[np.ndarray]:
    """Sizes (n,) [s] to which all stamps may have been rounded: fewest decimals, then fewest significant digits."""
    slack = 4 * np.spacing(np.abs(time).max())
    for decimals in DECIMALS:
        if np.abs(np.round(time, decimals) - time).max() <= slack:
            yield np.full(time.size, 10.0**-decimals)
            break
    exponent = np.floor(np.log10(np.maximum(np.abs(time), np.finfo(float).tiny)) + EXACT)
    for digits in DIGITS:
        size = 10.0 ** (exponent - digits + 1)
        if np.abs(np.round(time / size) * size - time).max() <= slack:
            yield np.where(time == 0, size.max(), size)
            break


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


def usual_step(time: np.ndarray, bad: np.ndarray) -> float:
    steps = np.diff(time)[~(bad[1:] | bad[:-1])]
    return float(np.median(steps)) if steps.size else np.inf


def leaps(time: np.ndarray, bad: np.ndarray) -> np.ndarray:
    """Numbers (k,) of the samples after which time leaps."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((np.diff(time) > GAP * usual_step(time, bad)) & ~(bad[1:] | bad[:-1]))


def whole_slices(time: np.ndarray, bad: np.ndarray) -> list[slice]:
    """Runs of samples that are not `bad` (n,) and without a gap in time."""
    begins = np.concatenate(([True], bad[:-1])) & ~bad
    begins[leaps(time, bad) + 1] = True
    starts = np.flatnonzero(begins)
    ends = np.append(np.flatnonzero(bad), time.size)
    stops = np.minimum(np.append(starts[1:], time.size), ends[np.searchsorted(ends, starts)])
    return [slice(int(a), int(b)) for a, b in zip(starts, stops, strict=True)]


LARGEST_PART = 20_000
"""Largest numerator or denominator of the ratio of two rates."""
HELD = ("reference", "reference_external", "disc_force", "base_acceleration")
"""Inputs, which a sampled model holds from one sample to the next."""
PER_PERIOD = 2.5
"""Least samples in a period of an order: the filter passes frequencies below 0.4 of the rate."""


def resample(record: xr.Dataset, rate: float, order: int = 0) -> xr.Dataset:
    """The record at `rate` [Hz], from its first time on; attributes state from which rate.

    `order` is the highest multiple of the shaft speed that must be left.

    Every channel passes the same linear-phase low-pass filter below half the new rate; flags take the value of the
    nearest sample before. Inputs (references, force) become their mean over each new interval, in which a model holds
    them; records of rotorsim hold them from sample to sample, those of other recorders are taken as straight lines.

    Raises
    ------
    SchemaError
        If the rate is above the record's own, in no simple ratio to it, too low for the order, or values are missing.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.resample(record, 1000.0).sizes["time"] < record.sizes["time"]
    True
    """
    from scipy.signal import resample_poly

    sampling_time(record)  # uneven time stamps are refused
    own = nominal_rate(np.asarray(record["time"].values, float))
    ratio = Fraction(rate / own).limit_denominator(LARGEST_PART)
    if rate > own * (1 + EXACT):
        raise SchemaError(f"record: is sampled at {own:.6g} Hz; {rate:.6g} Hz would invent what is between")
    if abs(float(ratio) * own / rate - 1) > EXACT or ratio.numerator > LARGEST_PART:
        raise SchemaError(f"record: {own:.9g} Hz and {rate:.9g} Hz are in no simple ratio; take a rate that divides it")
    if order:
        _check_order(record, rate, order)
    n = -(-record.sizes["time"] * ratio.numerator // ratio.denominator)
    lines = "source_format" in record.attrs and ratio != 1
    if lines and any(name in record for name in HELD):
        n = (record.sizes["time"] - 1) * ratio.numerator // ratio.denominator  # whole intervals only
    start = float(record["time"].values[0])
    variables: dict[str, Any] = {}
    for name, variable in record.data_vars.items():
        values = variable.values
        if "time" not in variable.dims:
            variables[str(name)] = variable
            continue
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise SchemaError(f"{name}: has missing values; cut them out before resampling")
        axis = variable.dims.index("time")
        if name in HELD:
            new = _held(values, axis, n, ratio, not lines)
        elif values.dtype.kind == "f":
            new = resample_poly(values, ratio.numerator, ratio.denominator, axis=axis, padtype="line")
            new = np.take(new, np.arange(n), axis=axis)
        else:
            new = np.take(values, np.arange(n) * ratio.denominator // ratio.numerator, axis=axis)
        variables[str(name)] = (variable.dims, new, variable.attrs)
    coords: dict[str, Any] = {str(k): v for k, v in record.coords.items() if "time" not in v.dims}
    coords["time"] = ("time", start + np.arange(n) / rate, record["time"].attrs)
    attrs = record.attrs | {"resampled": f"from {own:.6g} Hz to {rate:.6g} Hz, polyphase filter"}
    return type(record)(variables, coords, attrs)


def _check_order(record: xr.Dataset, rate: float, order: int) -> None:
    speed = next((record[name].values for name in ("speed", "speed_measured") if name in record), None)
    if speed is None:
        raise SchemaError("record: has no speed, so that no order can be kept; map a keyphasor or a speed")
    highest = order * float(np.abs(speed).max()) / (2 * np.pi)
    if rate < PER_PERIOD * highest:
        raise SchemaError(
            f"record: {rate:.6g} Hz is too low for {order}X, which goes up to {highest:.4g} Hz; take a rate of "
            f"{PER_PERIOD * highest:.4g} Hz or more"
        )


def _held(values: np.ndarray, axis: int, n: int, ratio: Fraction, steps: bool) -> np.ndarray:
    """Means (n along `axis`) of an input over the intervals of a lower rate; between samples it is held if `steps`."""
    values = np.moveaxis(values, axis, 0)
    after = values if steps else np.concatenate([values[1:], values[-1:]])
    total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(0.5 * (values + after), axis=0)])
    edges = np.minimum(np.arange(n + 1) * ratio.denominator / ratio.numerator, len(values))
    low = np.minimum(edges.astype(int), len(values) - 1)
    column = (-1, *[1] * (values.ndim - 1))
    share = (edges - low).reshape(column)
    inside = share * values[low] + 0.5 * share**2 * (after - values)[low]
    return np.moveaxis(np.diff(total[low] + inside, axis=0) / np.diff(edges).reshape(column), 0, axis)

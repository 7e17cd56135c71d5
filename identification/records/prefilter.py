r"""From a record to the signals of a fit: gaps left out, prefiltered (thesis, 2.1.3, C.3.5), several records joined.

A gap is a leap of time or a sample without a value. A record is cut into its whole stretches, or these are put behind
each other on one clock for a fit. In the `Signals` of such a fit `breaks` are the numbers of the samples at which the
later stretches begin, those of further records among them. Each stretch has an initial state of its own; those of one
record share its offset and its harmonics of the shaft angle, records have their own.

The prefilter subtracts the extended runout on the measured shaft angle; where asked for, a running median (of 3 in the
thesis) takes out spikes; the mean of the rest before the excitation (2000 samples in the thesis) is the bias of inputs
and outputs; and where asked for, the same Butterworth low-pass, forwards and backwards, acts on inputs and outputs
alike, which leaves their relation.

Cites: thesis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from identification.records.sampling import leaps, sampling_time, usual_step, whole_slices
from identification.records.schema import measured, require, validate, with_notes
from identification.records.sensors import HARMONICS, Runout, estimate_runout, fitting_count, harmonics, probe_outputs
from rotorsim.base.errors import SchemaError, UnfitError

if TYPE_CHECKING:
    import xarray as xr


SHORTEST = 0.1
"""Shortest stretch [s] that is kept; most of a shorter one is the decay of its initial state."""
LEAST = 1.0
"""Shortest length [s] of a record without its gaps."""
USED = ("reference", "reference_external", "disc_measured", "disc", "pin_measured", "pin", "probe_measured",
        "angle_measured", "angle", "speed_measured", "speed", "pressure_measured", "pressure")  # fmt: skip
"""Channels of a fit, whose missing values are gaps."""
ANGLES = ("angle_measured", "angle")
ALIKE = 1e-3
"""Relative difference of sampling times that count as the same."""
DRIFT = {"speed": (0.02, 5.0, "rad/s"), "pressure": (0.03, 3e3, "Pa")}
"""Change within one operating point, as a share of the mean or in the unit, whichever is larger."""


def whole_stretches(record: xr.Dataset, shortest: float = SHORTEST) -> list[xr.Dataset]:
    """The stretches of a record without gaps and missing values, in the order of time; each notes what was cut.

    A channel without any value is left out altogether.

    Parameters
    ----------
    record : time series, as `identification.load` gives it
    shortest : stretches that last less [s] are left out

    Raises
    ------
    SchemaError
        If the record has no time or no such stretch.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.identification.whole_stretches(record, 0.1))
    1
    """
    if "time" not in record.dims or "time" not in record.coords:
        raise SchemaError("record: no time series; run-up vectors have no gaps to cut")
    empty = [name for name in _timed(record) if not np.isfinite(record[name].values).any()]
    kept = record.drop_vars(empty)
    time = np.asarray(kept["time"].values, float)
    missing = {name: ~np.isfinite(kept[name].values).reshape(time.size, -1).all(axis=1) for name in _timed(kept)}
    bad = np.logical_or.reduce([~np.isfinite(time), *missing.values()])
    reasons = [f"{name} has no value and was left out" for name in empty]
    reasons += [f"{np.count_nonzero(at)} samples without a value in {name}" for name, at in missing.items() if at.any()]
    parts = whole_slices(time, bad)
    gaps = leaps(time, bad)
    if gaps.size:
        reasons.append(f"{gaps.size} gaps in time, the first after {time[gaps[0]]:.6g} s")
    step = usual_step(time, bad)
    long = [part for part in parts if (part.stop - part.start) * step >= max(shortest, 2 * step)]
    if not long:
        raise SchemaError(
            f"record: no whole stretch of {shortest:g} s ({'; '.join(reasons) or 'too short'}); record it again"
        )
    return [_piece(kept, part, len(parts), reasons) for part in long]


def longest(stretches: list[xr.Dataset]) -> xr.Dataset:
    """The stretch with the most samples.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.longest(rs.identification.whole_stretches(record, 0.1)).sizes["axis"]
    2
    """
    return max(stretches, key=lambda stretch: stretch.sizes["time"])


def _piece(record: xr.Dataset, part: slice, count: int, reasons: list[str]) -> xr.Dataset:
    piece = record.isel(time=part)
    if count == 1 and not reasons:
        return piece
    time = piece["time"].values
    samples = f"samples {part.start + 1} to {part.stop} of {record.sizes['time']}"
    where = f"cut: {samples}, {time[0]:.6g} s to {time[-1]:.6g} s"
    return with_notes(piece, [f"{where}; {'; '.join(reasons)}" if reasons else where])


def _timed(record: xr.Dataset) -> list[str]:
    """Names of the float variables over time."""
    return [str(n) for n, v in record.data_vars.items() if v.dims[:1] == ("time",) and v.dtype.kind == "f"]


def without_gaps(record: xr.Dataset) -> tuple[xr.Dataset, tuple[int, ...], str]:
    """The whole stretches behind each other on an even clock, the samples at which they begin, and what was left out.

    A record without gaps comes back as it is. Samples are missing where time leaps or a channel of USED is not finite.
    Raises UnfitError if less than a second is left.
    """
    if "time" not in record.coords or record["time"].dims != ("time",) or record["time"].dtype.kind not in "fiu":
        return record, (), ""
    time = np.asarray(record["time"].values, float)
    names = [name for name in USED if name in record and record[name].dtype.kind == "f"]
    names = [name for name in names if record[name].dims[:1] == ("time",)]
    whole = [np.isfinite(record[name].values).reshape(time.size, -1).all(axis=1) for name in names]
    bad = ~np.logical_and.reduce([np.isfinite(time), *whole])
    found = whole_slices(time, bad) if time.size > 1 else []
    if len(found) == 1 and not bad.any():
        return record, (), ""
    step = _step_within(time, found)
    kept = [part for part in found if (part.stop - part.start) * step >= SHORTEST]
    lasting = sum(part.stop - part.start for part in kept)
    known = time[np.isfinite(time)]
    wanted = max(round(float(np.ptp(known)) / step) + 1, time.size) if known.size and step > 0 else time.size
    if lasting * step < LEAST:
        raise UnfitError(
            f"record: {lasting * step:.3g} s of {wanted * step:.3g} s are left without the gaps, in stretches of "
            f"{SHORTEST:g} s or more; a local fit needs {LEAST:g} s: record it again"
        )
    lost = wanted - lasting
    note = f"{lost} of {wanted} samples ({100 * lost / wanted:.2g} %) left out; whole stretches: {len(kept)}"
    return _closed_up(record, kept, step), tuple(np.cumsum([p.stop - p.start for p in kept])[:-1].tolist()), note


def longest_whole(record: xr.Dataset) -> tuple[xr.Dataset, tuple[str, ...]]:
    """The longest stretch of a record without gaps, and a sentence where that is not all of it."""
    closed, breaks, left_out = without_gaps(record)
    if not breaks:
        return closed, (left_out,) if left_out else ()
    first, last = max(pairwise([0, *breaks, closed.sizes["time"]]), key=lambda edges: edges[1] - edges[0])
    return closed.isel(time=slice(first, last)), (f"gaps: seen in the longest stretch, {last - first} samples",)


def _step_within(time: np.ndarray, found: list[slice]) -> float:
    """Sampling time [s] in the stretches, or of all samples where no two belong together."""
    steps = [np.diff(time[part]) for part in found if part.stop - part.start > 1] or [np.diff(time)]
    steps = [one[np.isfinite(one)] for one in steps]
    return float(np.median(np.concatenate(steps))) if any(one.size for one in steps) else 0.0


def _closed_up(record: xr.Dataset, kept: list[slice], step: float) -> xr.Dataset:
    """The stretches on one clock; the angle loses the whole turns that the gaps had."""
    time = np.asarray(record["time"].values, float)
    for part in kept:
        sampling_time(record.isel(time=part))  # refuses what is uneven within
    closed = record.isel(time=np.concatenate([np.arange(part.start, part.stop) for part in kept]))
    closed = closed.assign_coords(time=("time", time[kept[0].start] + step * np.arange(closed.sizes["time"])))
    closed["time"].attrs = dict(record["time"].attrs)
    for name in ANGLES:
        if name in closed:
            angle, edges = closed[name].values.copy(), np.cumsum([p.stop - p.start for p in kept])[:-1]
            for k in edges:
                angle[k:] -= 2 * np.pi * np.round((angle[k] - angle[k - 1]) / (2 * np.pi))
            closed[name] = closed[name].copy(data=angle)
    return closed


@dataclass(frozen=True, eq=False)
class Signals:
    """Prefiltered record of an identification.

    u (n, 2) [V], y (n, 2) [m], truth (n, 2) [m] and pins (n, injectors) [m] where they are known, Q (n, h) orthonormal
    regressors that the fit projects out (an offset, and harmonics of the angle where nothing else removed them), noise
    (2,) [m] one standard deviation of what no model can follow, the operating point, and what was done. `breaks` are
    the samples at which later stretches begin, see `joined`. Where u and pins are the part that an external
    reference explains, `acting` (n, 2 + injectors) holds reference [V] and pins [m] that acted.
    """

    Ts: float
    u: np.ndarray
    y: np.ndarray
    truth: np.ndarray | None
    pins: np.ndarray | None
    Q: np.ndarray
    rest: int
    noise: np.ndarray
    speed: float
    pressure: float
    notes: tuple[str, ...]
    breaks: tuple[int, ...] = ()
    acting: np.ndarray | None = None


def cut(signals: Signals, at: slice) -> Signals:
    """The samples of a slice, without a rest; regressors are made orthonormal again."""
    return replace(
        signals, u=signals.u[at], y=signals.y[at], Q=np.linalg.qr(signals.Q[at])[0], rest=0,
        truth=None if signals.truth is None else signals.truth[at],
        pins=None if signals.pins is None else signals.pins[at],
        acting=None if signals.acting is None else signals.acting[at],
    )  # fmt: skip


def parts_of(breaks: Sequence[int], n: int) -> Iterator[slice]:
    """Slices of the stretches of n samples."""
    edges = [0, *breaks, n]
    return (slice(a, b) for a, b in pairwise(edges))


def longest_part(signals: Signals) -> slice:
    """The stretch with the most samples after the rest of the first."""
    parts = list(parts_of(signals.breaks, len(signals.u)))
    return max(parts, key=lambda part: part.stop - max(part.start, signals.rest))


def regressors_of(Q: np.ndarray, at: slice) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (n, k) of a part of the samples and their numbers, without those that are zero there."""
    shown = np.flatnonzero(np.any(Q[at] != 0, axis=0))
    return np.ascontiguousarray(Q[at][:, shown]), shown


def offsets(n: int, breaks: Sequence[int]) -> np.ndarray:
    """An offset for each stretch, orthonormal, (n, stretches)."""
    columns = np.zeros((n, len(breaks) + 1))
    for k, part in enumerate(parts_of(breaks, n)):
        columns[part, k] = (part.stop - part.start) ** -0.5
    return columns


def joined(records: Sequence[Signals]) -> Signals:
    """Signals of several records at one operating point as one.

    Raises UnfitError if their sampling times or operating points differ, or only some have pins.
    """
    first = records[0]
    if len(records) == 1:
        return first
    for k, other in enumerate(records[1:], start=2):
        _check_alike(first, other, k)
    lengths = [len(one.u) for one in records]
    starts = np.cumsum([0, *lengths[:-1]])
    breaks = [int(at + b) for at, one in zip(starts, records, strict=True) for b in (0, *one.breaks)][1:]
    Q = np.zeros((sum(lengths), sum(one.Q.shape[1] for one in records)))
    column = 0
    for at, one in zip(starts, records, strict=True):
        Q[at : at + len(one.u), column : column + one.Q.shape[1]] = one.Q
        column += one.Q.shape[1]
    notes = tuple(dict.fromkeys(text for one in records for text in one.notes))
    open_loop = (one.u if one.pins is None else np.hstack([one.u, one.pins]) for one in records)  # acts as it is
    acting = [known if one.acting is None else one.acting for one, known in zip(records, open_loop, strict=True)]
    return replace(
        first, u=_stacked([one.u for one in records]), y=_stacked([one.y for one in records]), Q=Q,
        truth=None if any(one.truth is None for one in records) else _stacked([one.truth for one in records]),
        pins=None if any(one.pins is None for one in records) else _stacked([one.pins for one in records]),
        acting=None if all(one.acting is None for one in records) else _stacked(acting),
        noise=np.sqrt(np.average([one.noise**2 for one in records], axis=0, weights=lengths)),
        speed=float(np.average([one.speed for one in records], weights=lengths)),
        pressure=float(np.average([one.pressure for one in records], weights=lengths)),
        notes=(*notes, f"{len(records)} records in one fit"), breaks=tuple(breaks),
    )  # fmt: skip


def _stacked(values: Sequence[np.ndarray | None]) -> np.ndarray:
    return np.ascontiguousarray(np.vstack([one for one in values if one is not None]))


def _check_alike(first: Signals, other: Signals, number: int) -> None:
    if abs(other.Ts / first.Ts - 1) > ALIKE:
        raise UnfitError(
            f"record {number}: a sample every {other.Ts:.6g} s, the first record's every {first.Ts:.6g} s; one local "
            "fit takes records of one sampling time"
        )
    for name in DRIFT:
        share, least, unit = DRIFT[name]
        a, b = getattr(first, name), getattr(other, name)
        if abs(b - a) > max(share * abs(a), least):
            raise UnfitError(
                f"record {number}: {name} {b:.5g} {unit}, the first record's {a:.5g} {unit}; one local fit takes "
                "records of one operating point: identify each alone and fit_lpv them"
            )
    if (first.pins is None) != (other.pins is None):
        raise UnfitError(f"record {number}: only some of the records have pin positions; map them in all or drop them")


REST = 2000
"""Most samples of the rest that the bias is taken from."""
SETTLING = 0.5
"""Beginning of a steady record that is left out [s]: a virtual one starts in static equilibrium."""
TURNING = 1.0
"""Slowest speed [rad/s] that counts as turning."""


@dataclass(frozen=True)
class Prefilter:
    """Settings of a prefilter.

    runout: 'harmonic', 'table' or 'none'; harmonics: number in the filter; median: odd number of samples of a running
    median against spikes, 1 for none (it changes the displacement so that standard deviations no longer hold); lowpass:
    corner of the Butterworth filter [Hz], None for none; order: its order; bias: subtract the rest's mean; probes:
    names of the probes whose motion in x and y is the output (see `records.sensors`), the disc's where there are none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> settings = rs.identification.Prefilter(runout="none", lowpass=1000.0)
    >>> rs.identification.filtered(record, settings=settings).y.shape
    (10000, 2)
    """

    runout: str = "harmonic"
    harmonics: int = HARMONICS
    median: int = 1
    lowpass: float | None = None
    order: int = 4
    bias: bool = True
    probes: tuple[str, ...] = ()


def chosen_output(record: xr.Dataset, settings: Prefilter | None) -> xr.Dataset:
    """The record with the output that the settings choose as `disc_measured`."""
    return probe_outputs(record, settings.probes) if settings and settings.probes else record


def rest_length(reference: np.ndarray) -> int:
    """Number of samples at the beginning through which the references (n, 2) do not move."""
    moved = np.any(reference != reference[0], axis=1)
    return int(np.argmax(moved)) if moved.any() else len(reference)


def runout_of(steady: xr.Dataset, settings: Prefilter | None = None, channel: str = "disc_measured") -> Runout:
    """Extended runout from a record without excitation at the speed and pressure of the experiment.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.runout_of(turning, rs.identification.Prefilter(harmonics=4)).values.shape
    (8, 2)
    """
    settings = settings or Prefilter()
    validate(steady)
    angle, y = measured(steady, "angle"), _displacement(steady, channel)
    if angle is None:
        raise UnfitError("runout: the steady record has no angle_measured; map the encoder or set runout='none'")
    start = int(SETTLING / sampling_time(steady))
    start = start if len(y) > 3 * start else 0
    return estimate_runout(angle[start:], y[start:], settings.runout, settings.harmonics)


def filtered(record: xr.Dataset, steady: xr.Dataset | None = None, settings: Prefilter | None = None) -> Signals:
    """Signals of a record of the schema.

    Parameters
    ----------
    record : Dataset
        With `reference` and `disc_measured` (or `disc`).
    steady : Dataset or None
        Without excitation, at the same speed and pressure: its runout is subtracted. Where there is none and the shaft
        turns, the fit itself takes the harmonics of the angle out.
    settings : Prefilter or None
        What to do.

    Raises
    ------
    SchemaError, UnfitError

    Examples
    --------
    >>> import rotorsim as rs
    >>> signals = rs.identification.filtered(record)
    """
    settings = settings or Prefilter()
    validate(record)
    require(record, "reference", use="identification")
    record = chosen_output(record, settings)
    steady = None if steady is None else chosen_output(steady, settings)
    Ts, u = sampling_time(record), np.asarray(record["reference"].values, float)
    y, angle = _displacement(record, "disc_measured"), measured(record, "angle")
    truth = np.asarray(record["disc"].values, float) if "disc" in record else None
    speed, pressure = operating_point(record, Ts)
    turning, notes = abs(speed) > TURNING and angle is not None and settings.runout != "none", []
    basis = np.ones((len(y), 1))
    if turning and steady is not None:
        assert angle is not None
        y = y - runout_of(steady, settings).at(angle)
        if truth is not None and "disc" in steady:
            truth = truth - runout_of(steady, settings, "disc").at(angle)
        notes.append(f"extended runout removed ({settings.runout})")
    elif turning:
        assert angle is not None
        count = fitting_count(angle, settings.harmonics)
        basis = np.hstack([basis, harmonics(angle, count)])
        notes.append(f"{count} harmonics of the shaft angle removed in the fit")
    elif abs(speed) > TURNING and settings.runout != "none":
        notes.append("the shaft turns and there is no angle_measured: runout and imbalance stay in the data")
    rest = rest_length(u)
    y = _median(y, settings.median)
    u, y, truth = (None if v is None else _biased(v, rest, settings) for v in (u, y, truth))  # type: ignore[assignment]
    if settings.lowpass is not None:
        u, y = (_lowpass(v, settings, Ts) for v in (u, y))
    Q = np.linalg.qr(basis)[0]
    pins = measured(record, "pin")
    return Signals(Ts, u, y, truth, pins, Q, rest, noise_of(y, Q, rest), speed, pressure, tuple(notes))


def operating_point(record: xr.Dataset, Ts: float) -> tuple[float, float]:
    """Mean speed [rad/s], from the angle if nothing else gives it, and mean pressure [Pa, gauge]; NaN if unknown."""
    speed, pressure, angle = (measured(record, name) for name in ("speed", "pressure", "angle"))
    if speed is None and angle is not None:
        speed = np.array([(angle[-1] - angle[0]) / (Ts * (len(angle) - 1))])
    return (float("nan") if speed is None else float(np.mean(speed)),
            float("nan") if pressure is None else float(np.mean(pressure)))  # fmt: skip


def noise_of(y: np.ndarray, Q: np.ndarray, rest: int) -> np.ndarray:
    """Standard deviation (2,) of what is there without excitation: at rest, else from the spectrum's upper end."""
    first, last = rest // 2, min(rest, len(y))
    if last - first >= max(200, 4 * Q.shape[1]):
        basis = Q[first:last]
        left = y[first:last] - basis @ np.linalg.lstsq(basis, y[first:last], rcond=1e-8)[0]
        return np.asarray(left.std(axis=0))
    power = np.abs(np.fft.rfft(y - y.mean(axis=0), axis=0)) ** 2
    upper = power[int(0.5 * len(power)) : int(0.95 * len(power))]
    return np.asarray(np.sqrt(upper.mean(axis=0) / len(y)))


def _displacement(record: xr.Dataset, channel: str) -> np.ndarray:
    name = channel if channel in record else "disc"
    require(record, "disc_measured" if name not in record else name, use="identification")
    return np.asarray(record[name].values, float)


def _biased(values: np.ndarray, rest: int, settings: Prefilter) -> np.ndarray:
    """Values less their mean at rest, or over the record where there is no rest."""
    if not settings.bias:
        return values
    return values - values[: min(rest, REST) if rest >= 50 else len(values)].mean(axis=0)


def _median(values: np.ndarray, width: int) -> np.ndarray:
    if width <= 1:
        return values
    if width % 2 == 0:
        raise UnfitError(f"prefilter.median: {width} samples; take an odd number")
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, (width, 1), mode="nearest"))


def _lowpass(values: np.ndarray, settings: Prefilter, Ts: float) -> np.ndarray:
    from scipy.signal import butter, sosfiltfilt

    assert settings.lowpass is not None
    if not 0 < settings.lowpass < 0.5 / Ts:
        raise UnfitError(
            f"prefilter.lowpass: {settings.lowpass:g} Hz; choose a corner between 0 and {0.5 / Ts:g} Hz (half the rate)"
        )
    return np.asarray(sosfiltfilt(butter(settings.order, settings.lowpass, fs=1 / Ts, output="sos"), values, axis=0))


DELAY = 10
"""Samples after which pins have followed a held reference."""


def pin_pairs(pins: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Signal (n, 2) [m] of the x and y actuators from pins (n, k) [m] and references u (n, 2) [V]."""
    basis = np.column_stack([u[:-DELAY], np.ones(len(u) - DELAY)])
    slopes = np.linalg.lstsq(basis, pins[DELAY:], rcond=None)[0][:2]
    owner = np.argmax(np.abs(slopes), axis=0)
    if set(owner) != {0, 1} or not np.any(slopes):
        raise UnfitError("record.pin: no pin follows each of the references; map the pins or take model 3")
    signs = np.sign(slopes[owner, np.arange(pins.shape[1])])
    return np.column_stack([(signs * (owner == axis) * pins).sum(axis=1) for axis in range(2)])

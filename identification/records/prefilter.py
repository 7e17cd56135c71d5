r"""Prefilter for identification: bias, extended runout, median, low-pass (thesis, 2.1.3, C.3.5).

Order: the extended runout is subtracted on the measured shaft angle, where asked for a running median (of 3 in the
thesis) takes out spikes, the mean of the rest before the excitation (2000 samples in the thesis) is the bias of inputs
and outputs, and where asked for the same Butterworth low-pass, forwards and backwards, acts on inputs and outputs
alike, which leaves their relation.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identification.errors import UnfitError
from identification.records.runout import HARMONICS, Runout, estimate_runout, fitting_count, harmonics
from identification.records.sampling import sampling_time
from identification.records.schema import measured, require, validate
from identification.records.sensors import probe_outputs
from identification.records.stretches import Signals

if TYPE_CHECKING:
    import xarray as xr


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
    pins = np.asarray(record["pin"].values, float) if "pin" in record else None
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
    padded = np.pad(values, ((width // 2, width // 2), (0, 0)), mode="edge")
    if width == 3:  # four times as fast as sorting
        a, b, c = padded[:-2], padded[1:-1], padded[2:]
        return np.asarray(np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c)))
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, width, axis=0), axis=-1))


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

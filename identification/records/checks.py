"""Checks of a record's fitness for identification; each fault raises UnfitError with one sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.errors import UnfitError
from identification.records.examination import examine
from identification.records.prefilter import Signals, measured
from rotorsim.base.constants import TO_UM

if TYPE_CHECKING:
    import xarray as xr

SHORTEST = 1.0
"""Least time with excitation [s]; some hundred periods of a rotor on gas."""
SAMPLES = 50
"""Least samples for each parameter."""
STUCK = 0.02
"""A displacement that stays the same to the last bit for so long [s] is a drop-out."""
DRIFT = {"speed": (0.02, 5.0, "rad/s"), "pressure": (0.03, 3e3, "Pa")}
"""Allowed change of the operating point: share of the mean, or at least so much."""
SPANS = 10
"""Number of stretches whose means show drift."""


def check_record(record: xr.Dataset, Ts: float) -> None:
    """Raise UnfitError for saturated or dropped-out channels, mistaken units and a drifting operating point."""
    found = examine(record)
    for channel in found.channels:
        if channel.name.split()[0] != "disc_measured":
            continue
        for remark in channel.remarks:
            if "saturated" in remark:
                raise UnfitError(
                    f"record.{channel.name}: {remark.rstrip('?')} (more than 0.5 % of the record); reduce the "
                    "excitation or widen the sensor's range"
                )
            raise UnfitError(f"record.{channel.name}: {remark}; identification needs a displacement that moves")
    for text in found.doubts:
        raise UnfitError(f"record.{text}; correct the mapping's unit")
    _drop_outs(record, Ts)
    for name in DRIFT:
        _drift(record, name)


def _drop_outs(record: xr.Dataset, Ts: float) -> None:
    name = "disc_measured" if "disc_measured" in record else "disc"
    if name not in record:
        return
    for axis, values in zip("xy", np.asarray(record[name].values, float).T, strict=True):
        same = np.concatenate([[False], np.diff(values) == 0, [False]])
        edges = np.flatnonzero(np.diff(same.astype(np.int8)))
        starts, lengths = edges[::2], edges[1::2] - edges[::2]
        if lengths.size and lengths.max() * Ts >= STUCK and len(np.unique(values[:2000])) > 20:
            first = int(starts[int(np.argmax(lengths))])
            raise UnfitError(
                f"record.{name} {axis}: stands still for {lengths.max() * Ts:.3g} s after "
                f"{record['time'].values[first]:.4g} s (at most {STUCK:g} s): a drop-out; cut the record there"
            )


def _drift(record: xr.Dataset, name: str) -> None:
    values = measured(record, name)
    if values is None:
        return
    means = np.array([part.mean() for part in np.array_split(values, SPANS)])
    share, least, unit = DRIFT[name]
    allowed = max(share * abs(means.mean()), least)
    if np.ptp(means) > allowed:
        raise UnfitError(
            f"record.{name}: drifts from {means[0]:.5g} to {means[-1]:.5g} {unit}, a local model allows {allowed:.3g} "
            f"{unit}; cut the record where it is constant"
        )


def check_signals(signals: Signals, parameters: int, name: str = "reference") -> None:
    """Raise UnfitError for too short or unexcited signals; `name` is what excites."""
    lasting = (len(signals.u) - signals.rest) * signals.Ts
    samples = len(signals.u) - signals.rest
    for axis in range(2):
        if np.ptp(signals.u[:, axis]) < 1e-6:
            raise UnfitError(
                f"record.{name} {'xy'[axis]}: does not move; excite both axes, independently of each other"
            )
    if lasting < SHORTEST or samples < SAMPLES * parameters:
        need = max(SHORTEST, SAMPLES * parameters * signals.Ts)
        raise UnfitError(f"record: {lasting:.3g} s with excitation, {parameters} parameters need {need:.3g} s or more; "
                         "record longer")  # fmt: skip
    changes = np.count_nonzero(np.any(np.diff(signals.u, axis=0) != 0, axis=1))
    if changes < 10:
        raise UnfitError(f"record.{name}: moves {changes} times, 10 or more are needed; excite with a PRBS or chirp")
    alike = abs(float(np.corrcoef(signals.u.T)[0, 1]))
    if alike > 0.98:
        raise UnfitError(
            f"record.{name}: x and y are correlated by {alike:.3f}, at most 0.98; excite them independently"
        )


def check_modes(wn: np.ndarray, Ts: float) -> None:
    """Raise UnfitError for natural frequencies [rad/s] above the Nyquist frequency of samples every `Ts` [s]."""
    highest, nyquist = float(np.max(wn, initial=0.0)) / (2 * np.pi), 0.5 / Ts
    if not highest <= nyquist:
        raise UnfitError(
            f"identify: the fit ended with a mode at {highest:.4g} Hz, above the Nyquist frequency of the record, "
            f"{nyquist:.4g} Hz; record without a controller and with more excitation, or take another model or method"
        )


def suspicious_gains(gain: np.ndarray) -> tuple[str, ...]:
    """A sentence if cross gains of (2, 2) exceed the direct gains, as they do with swapped channels."""
    direct, cross = np.abs(np.diag(gain)), np.abs(gain[[0, 1], [1, 0]])
    if cross.sum() <= direct.sum():
        return ()
    return (
        f"cross gains {cross[0] * TO_UM:.3g}, {cross[1] * TO_UM:.3g} um/V are larger than direct gains "
        f"{direct[0] * TO_UM:.3g}, {direct[1] * TO_UM:.3g} um/V: x and y of the reference or the disc seem to be "
        "swapped; check the mapping",
    )

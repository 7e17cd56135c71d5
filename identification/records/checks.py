r"""Checks of a record's fitness for identification: faults, length, excitation, and feedback to its reference.

Feedback from the displacement to the reference is found by the test of Caines and Chan (1975).

.. math:: \Delta u_k = \sum_{i=1}^{p} a_i u_{k-i} + \sum_{i=1}^{q} b_i y_{k-i} + e_k

In open loop past outputs y add nothing to the prediction of the next reference u from past ones, whatever the rotor
does; behind a controller they do, because it feeds their noise back. Jumps of the reference, which no feedback makes,
are left out. The coefficients come from every other stretch of the record, and are judged on those between.

Output-error models are biased in closed loop, where the disturbance and the input are correlated (Ljung 1999, 13.4). A
record that holds the external reference is fitted in two stages, see `identification.local.closed_loop`.

Cites: caines_1975, ljung_1999.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.records.examination import examine
from identification.records.prefilter import DRIFT, Signals
from identification.records.schema import measured, measured_name
from rotorsim.base.errors import UnfitError
from rotorsim.base.units import TO_UM

if TYPE_CHECKING:
    import xarray as xr


SHORTEST = 1.0
"""Least time with excitation [s]; some hundred periods of a rotor on gas."""
SAMPLES = 50
"""Least samples for each parameter."""
STUCK = 0.02
"""Time [s] from which a displacement that stays the same to the last bit is a drop-out."""
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
    name = measured_name(record, "disc")
    if not name:
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
                f"record.{name} {'xy'[axis]}: does not move; excite both axes, independently of each other",
                argument=f"{name}.{'xy'[axis]}",
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
            f"record.{name}: x and y are correlated by {alike:.3f}, at most 0.98; excite them independently",
            argument=name,
            value=alike,
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


PAST_U, PAST_Y = 30, 10
"""Samples of the references and of the outputs from which the next reference is predicted."""
JUMP = 6.0
"""Jump of the excitation: a change of this many times the median one."""
FEED = 0.05
"""Share of the variance unexplained by past references from which past outputs count as fed back."""
PREDICTABLE = 1e-4
"""Prediction error, as a share of the reference's spread, below which its own past predicts it (sines): no verdict."""
STRETCH = 500
"""Samples of a stretch."""
FEWEST_SAMPLES = 2000
OPEN = ("", "off", "none", "no", "open loop")
"""Attributes of foreign records that name no controller."""
WAY_OUT = "record reference_external too, or without the controller"
EXTERNAL = "reference_external"
SATURATED = 1e-3
"""Share of samples at the range of the actuators from which a closed loop is refused: no linear model of the
film follows the excursions that take the law there."""
RECURRING = 5
"""Samples at one and the same extreme that show it to be the range of the actuators."""


def fed_back(u: np.ndarray, y: np.ndarray) -> float:
    """Share (0 to 1) of the changes of u (n, 2) that past y (n, 2) explain and past u do not; the larger axis."""
    n = len(u)
    lags = max(PAST_U, PAST_Y)
    if n < FEWEST_SAMPLES:
        return 0.0
    v, z = ((x - x.mean(axis=0)) / np.maximum(x.std(axis=0), 1e-300) for x in (u, y))
    past = np.hstack([_past(v, PAST_U, lags), np.ones((n - lags, 1))])
    both = np.hstack([past, _past(z, PAST_Y, lags)])
    return max(_gain(np.diff(v[lags - 1 :, axis]), past, both) for axis in range(2))


def _past(x: np.ndarray, count: int, lags: int) -> np.ndarray:
    """Values (n - lags, 2 count) of x (n, 2) one to `count` samples ago."""
    return np.hstack([x[lags - i : len(x) - i] for i in range(1, count + 1)])


def _gain(change: np.ndarray, past: np.ndarray, both: np.ndarray) -> float:
    usual = np.median(np.abs(change))
    keep = np.abs(change) <= JUMP * usual
    half = np.arange(len(change)) // STRETCH % 2 == 0
    left = []
    for known in (past, both):
        first, second = keep & half, keep & ~half
        if usual == 0.0 or min(first.sum(), second.sum()) < FEWEST_SAMPLES // 4:
            return 0.0
        found = np.linalg.lstsq(known[first], change[first], rcond=1e-10)[0]
        left.append(float(np.mean((change[second] - known[second] @ found) ** 2)))
    return 0.0 if left[0] < PREDICTABLE**2 else max(1 - left[1] / left[0], 0.0)


def controller_of(record: xr.Dataset) -> str:
    """The controller of a record, from its attributes or channels; empty if they name none."""
    for name in ("law", "controller"):
        if (known := str(record.attrs.get(name, "")).strip()).lower() not in OPEN:
            return known
    external = "reference_external" in record and "reference" in record
    if external and not np.array_equal(record["reference_external"].values, record["reference"].values):
        return "reference_external differs from reference"
    return "controlled" if str(record.attrs.get("experiment", "")) == "controlled" else ""


def check_loop(record: xr.Dataset, method: str, refuse: bool = True) -> tuple[str, ...]:
    """Sentences about a record of a closed loop; `refuse` raises UnfitError where it names its controller itself."""
    if name := controller_of(record):
        text = f"made in closed loop ({name})"
        if method == "two-stage":
            return ()
        way_out = "choose method 'auto'" if EXTERNAL in record else WAY_OUT
        if refuse and method == "oe":
            raise UnfitError(f"record: {text}, where output error gives wrong frequencies and damping; {way_out}")
        return (f"{text}: frequencies and damping may be far off; {way_out}",)
    output = "disc_measured" if "disc_measured" in record else "disc"
    share = fed_back(*(np.asarray(record[name].values, float) for name in ("reference", output)))
    if share < FEED:
        return ()
    return (
        f"past displacements explain {100 * share:.0f} % of the changes of the reference (open loop: below "
        f"{100 * FEED:.0f} %): a controller seems to act on it, and frequencies and damping may be far off; {WAY_OUT}",
    )


def method_for(record: xr.Dataset, method: str) -> str:
    """'two-stage' for a closed loop with its external reference and 'oe' otherwise, where the method is 'auto'.

    Raises UnfitError if two-stage is asked for and there is no external reference.
    """
    if method == "two-stage" and EXTERNAL not in record:
        raise UnfitError(f"record: no {EXTERNAL}, which two-stage needs; {WAY_OUT} and take method 'auto'")
    if method != "auto":
        return method
    return "two-stage" if controller_of(record) and EXTERNAL in record else "oe"


def saturated_share(reference: np.ndarray) -> float:
    """Share of samples (n, 2) at which an axis that moves stands at its extreme, 0 where none recurs."""
    at = np.zeros(len(reference), bool)
    for values in reference.T[np.ptp(reference, axis=0) > 0]:
        for extreme in (values.min(), values.max()):
            same = values == extreme
            if np.count_nonzero(same) >= RECURRING:
                at |= same
    return float(at.mean())


def check_saturation(record: xr.Dataset, refuse: bool = True) -> tuple[str, ...]:
    """A sentence about a closed loop whose law drives the actuators to their range; `refuse` raises UnfitError."""
    u = np.asarray(record["reference"].values, float)
    share = saturated_share(u)
    if share == 0.0:
        return ()
    text = (
        f"the law drives the reference to its range of {np.abs(u).max():.4g} V in {100 * share:.2g} % of the samples, "
        "where loop and film are far from linear; excite with less or reduce the law's gain"
    )
    if refuse and share >= SATURATED:
        raise UnfitError(f"record: {text}")
    return (text,)

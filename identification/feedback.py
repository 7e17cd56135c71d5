r"""Test of a record for feedback from the disc displacement to the reference (Caines and Chan 1975).

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

from identification.errors import UnfitError

if TYPE_CHECKING:
    import xarray as xr

PAST_U, PAST_Y = 30, 10
"""Samples of the references and of the outputs from which the next reference is predicted."""
JUMP = 6.0
"""Changes beyond so many times the median one are jumps of the excitation."""
FEED = 0.05
"""Share of what past references leave unexplained from which past outputs count as fed back."""
PREDICTABLE = 1e-4
"""Prediction error, as a share of the reference's spread, below which its own past predicts it (sines): no verdict."""
BLOCK = 500
"""Samples of a stretch."""
FEWEST = 2000
OPEN = ("", "off", "none", "no", "open loop")
"""Attributes of foreign records that name no controller."""
WAY_OUT = "record reference_external too, or without the controller"
EXTERNAL = "reference_external"
SATURATED = 1e-3
"""Share of samples at the range of the actuators from which a closed loop is refused: the excursions that take the law
there are beyond what a linear model of the film follows."""
FEW = 5
"""So many samples at one and the same extreme are the range of the actuators."""


def fed_back(u: np.ndarray, y: np.ndarray) -> float:
    """Share (0 to 1) of the changes of u (n, 2) that past y (n, 2) explain and past u do not; the larger axis."""
    n = len(u)
    lags = max(PAST_U, PAST_Y)
    if n < FEWEST:
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
    half = np.arange(len(change)) // BLOCK % 2 == 0
    left = []
    for known in (past, both):
        first, second = keep & half, keep & ~half
        if usual == 0.0 or min(first.sum(), second.sum()) < FEWEST // 4:
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
    share = fed_back(*(np.asarray(record[name].values, float) for name in _channels(record)))
    if share < FEED:
        return ()
    return (
        f"past displacements explain {100 * share:.0f} % of the changes of the reference (open loop: below "
        f"{100 * FEED:.0f} %): a controller seems to act on it, and frequencies and damping may be far off; {WAY_OUT}",
    )


def method_for(record: xr.Dataset, method: str) -> str:
    """'two-stage' for a closed loop with its external reference and 'oe' otherwise, where the method is 'auto'.

    Raises
    ------
    UnfitError
        If two-stage is asked for and there is no external reference.
    """
    if method == "two-stage" and EXTERNAL not in record:
        raise UnfitError(f"record: no {EXTERNAL}, which two-stage needs; {WAY_OUT} and take method 'auto'")
    if method != "auto":
        return method
    return "two-stage" if controller_of(record) and EXTERNAL in record else "oe"


def saturated_share(reference: np.ndarray) -> float:
    """Share of samples (n, 2) at which an axis that moves stands at its own extreme, 0 where none recurs."""
    at = np.zeros(len(reference), bool)
    for values in reference.T[np.ptp(reference, axis=0) > 0]:
        for extreme in (values.min(), values.max()):
            same = values == extreme
            if np.count_nonzero(same) >= FEW:
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


def _channels(record: xr.Dataset) -> tuple[str, str]:
    return "reference", "disc_measured" if "disc_measured" in record else "disc"

r"""Choice of a model: advice before the fit, comparison of several models on a held-out record after it.

Order: models of increasing order by the subspace method from the first 60 % of the excited record, without refinement,
simulate the rest; the lowest whose fit is within half a point of the best is proposed, with the singular values.

Delay: the response (j omega)^2 G = K G + j omega D G + B h(omega) is linear in K, D and B once the lag h is known
(`local.greybox.levy`); of lags exp(-j omega tau) / (1 + j omega / p) the one is proposed that leaves the least. Its
total, tau + 1/p, is known well, how it splits is not; the fit with a free dead time finds that.

Cites: levy_1959, verhaegen_2007.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.local.blackbox import observable, realised
from identification.local.confidence import ceiling, fit_of, noise_free_fit, project
from identification.local.greybox import RATED, levy, peak_frequency
from identification.local.identify import fit_signals, of_stretches
from identification.local.models import LinearModel
from identification.local.result import Identification
from identification.lpv_model import SAME, LpvModel
from identification.records.checks import check_loop, check_signals, method_for
from identification.records.frequency_response import FrequencyResponse, frequency_response
from identification.records.prefilter import Prefilter, Signals, chosen_output, cut, filtered, longest_whole
from rotorsim.base.display import several
from rotorsim.base.errors import ModelError
from rotorsim.base.processes import one_thread

if TYPE_CHECKING:
    import xarray as xr

ORDERS = (2, 3, 4, 5, 6, 7, 8, 10)
FIRST = 0.6
"""Share of the excited record that models are made of."""
CLOSED = "closed loop: seen in two stages, behind what the external reference explains"
ENOUGH = 0.005
"""Fit below the best that a lower order may cost."""
DEAD_TIMES = np.arange(0.0, 3.01e-3, 1e-4)
CORNERS = (np.inf, 8000.0, 4000.0, 2500.0, 1500.0, 1000.0, 700.0, 500.0)
"""Dead times [s] and corners [rad/s] of lags that are tried."""
EARLY, LATE = 0.05, 1.5
"""Angles of the delay at the first peak [rad]: below the first no lag is needed, above the second one is not enough."""


@dataclass(frozen=True, eq=False)
class Advice:
    """Proposals before a fit.

    orders tried, singular_values of the first directions over their largest, fits (k, 2) by order of the second part
    of the record; order; peak [rad/s]; dead_time, lag [s] and their sum delay [s]; model '1', '2', '2-rate' or '3';
    sentences.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.identification.advise(record)
    >>> 0.0 <= found.delay < 5e-3
    True
    """

    orders: tuple[int, ...]
    singular_values: np.ndarray
    fits: np.ndarray
    order: int
    peak: float
    dead_time: float
    lag: float
    model: str
    sentences: tuple[str, ...]

    @property
    def delay(self) -> float:
        """Delay between reference and force [s], lag and dead time together."""
        return self.dead_time + self.lag

    def report(self) -> str:
        """Human-readable text of the proposals."""
        lines = ["order  singular value  fit of the second part"]
        lines += [
            f"{n:5d}  {self.singular_values[n - 1]:14.2e}  {100 * fit[0]:.1f}, {100 * fit[1]:.1f} %"
            for n, fit in zip(self.orders, self.fits, strict=True)
        ]
        return "\n".join([*lines, *self.sentences])


@one_thread()
def advise(ds: xr.Dataset, steady: xr.Dataset | None = None, settings: Prefilter | None = None) -> Advice:
    """Order, delay and model that a record suggests.

    Parameters
    ----------
    ds : Dataset
        Record of the schema with `reference` and `disc_measured`; of one with gaps the longest stretch is taken. A
        closed loop with `reference_external` is seen in two stages, as `identify` fits it.
    steady : Dataset or None
        Record without excitation at the same operating point, for the extended runout filter.
    settings : Prefilter or None
        Prefilter.

    Raises
    ------
    SchemaError, UnfitError
        With one sentence about what the record lacks.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.advise(record).order
    6
    """
    ds, alone = longest_whole(ds)
    method = method_for(ds, "auto")
    signals = fit_signals(ds, steady, settings) if method == "two-stage" else filtered(ds, steady, settings)
    check_signals(signals, 4 * max(ORDERS))
    values, fits = _orders(signals)
    best = int(np.argmax(fits.mean(axis=1) >= fits.mean(axis=1).max() - ENOUGH))
    excited = slice(min(signals.rest, len(signals.u) // 2), None)
    response = frequency_response(signals.u[excited], signals.y[excited], signals.Ts)
    peak = peak_frequency(response)
    dead_time, lag = _delay(response, peak, signals.Ts)
    closed = method == "two-stage"
    pinned = (RATED if closed else "2") if signals.pins is not None else ""
    model = pinned or ("1" if peak * (dead_time + lag) < EARLY else "3")
    sentences = _sentences(ORDERS[best], fits[best], peak, dead_time + lag, model) + alone
    if closed:
        sentences += (CLOSED,)
    remarks = check_loop(chosen_output(ds, settings), method, refuse=False)
    return Advice(ORDERS, values, fits, ORDERS[best], peak, dead_time, lag, model, (*sentences, *remarks))


def _orders(signals: Signals) -> tuple[np.ndarray, np.ndarray]:
    """Singular values over the largest; fits (k, 2) of the second part by models of the first."""
    start = min(signals.rest, len(signals.u) // 2)
    middle = start + int(FIRST * (len(signals.u) - start))
    first, second = cut(signals, slice(start, middle)), cut(signals, slice(middle, None))
    y = project(first.y, first.Q)
    left, values = observable(first.u, y)
    fits = []
    for n in ORDERS:
        A, B, C = realised(left, values, n, first.u, y)
        fits.append(fit_of(LinearModel(A, B, C, np.zeros((2, 2)), signals.Ts), second))
    return values[: max(ORDERS)] / values[0], np.array(fits)


def _delay(response: FrequencyResponse, peak: float, Ts: float) -> tuple[float, float]:
    """Dead time and lag [s] of those tried, behind the hold, that leave the least of the response around its peak."""
    s = 1j * response.omega
    band = (response.omega > 0.1 * peak) & (response.omega < 1.8 * peak)

    def left(choice: tuple[float, float]) -> float:
        h = np.exp(-s * (choice[0] + 0.5 * Ts)) / (1 + s / choice[1])
        K, D, B = levy(response, peak, h).reshape(3, 2, 2)
        at = s[band, None, None]
        made = np.linalg.solve(at**2 * np.eye(2) - at * D - K, B * h[band, None, None])
        return float(np.linalg.norm(response.G[band] - made))

    tau, corner = min(product(map(float, DEAD_TIMES), CORNERS), key=left)
    return tau, 1 / corner


def _sentences(order: int, fit: np.ndarray, peak: float, delay: float, model: str) -> tuple[str, ...]:
    """Sentences that follow from the estimates."""
    turn = peak * delay
    reasons = {
        "1": "model 1: references act at once",
        RATED: f"model {RATED}: pins are measured, and in a closed loop its damping ratios come closer than model 2's",
        "2": "model 2: pins are measured, which distinguishes actuators and film",
        "3": "model 3 with a free dead time: references act later and no pins are measured",
    }
    found = [
        f"order {order}: {100 * fit[0]:.1f}, {100 * fit[1]:.1f} % of the second part; higher orders add less than "
        f"{100 * ENOUGH:g} points",
        f"delay between reference and force {1e3 * delay:.2g} ms: {np.degrees(turn):.0f} deg at "
        f"{peak / 2 / np.pi:.4g} Hz",
        f"take {reasons[model]}",
    ]
    if turn > LATE:
        found.append("a delay of that angle is too much for one dead time: shift the reference by whole samples")
    if order > 8:
        found.append(f"the grey-box models have up to 10 states; hold them against a black box of order {order}")
    return tuple(found)


SHOWN = 2
"""Modes of a model in the table."""


@dataclass(frozen=True, eq=False)
class Compared:
    """One model on the record: number of states, fit and noise_free_fit (2,) as shares of one, wn [rad/s] and zeta of
    its oscillating modes, static gain (2, 2) [m/V]; `remark` where the model is of another operating point.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.compare_models({"lpv": lpv}, record).rows[0].fit.shape
    (2,)
    """

    name: str
    order: int
    fit: np.ndarray
    noise_free_fit: np.ndarray | None
    wn: np.ndarray
    zeta: np.ndarray
    static_gain: np.ndarray
    remark: str = ""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Models on one record, best mean fit first, and the highest fit (2,) that its noise allows.

    Examples
    --------
    >>> import rotorsim as rs
    >>> print(rs.identification.compare_models({"lpv": lpv}, record).report().split()[0])
    model
    """

    rows: tuple[Compared, ...]
    ceiling: np.ndarray

    def report(self) -> str:
        """Human-readable text of the table."""
        table = [("model", "states", "fit x, y %", "modes Hz", "damping ratios", "gain xx, yy um/V")]
        for row in self.rows:
            first = slice(0, SHOWN)
            cells = (
                several(100 * row.fit, ".1f"), several(row.wn[first] / (2 * np.pi), ".2f"),
                several(row.zeta[first], ".4f"), several(1e6 * np.diag(row.static_gain), ".3f"),
            )  # fmt: skip
            table.append((row.name, str(row.order), *cells))
        table.append(("noise ceiling", "", several(100 * self.ceiling, ".1f"), "", "", ""))
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in table]
        return "\n".join([*lines, *(f"{row.name}: {row.remark}" for row in self.rows if row.remark)])


@one_thread()
def compare_models(
    models: Mapping[str, Identification | LinearModel | LpvModel],
    record: xr.Dataset,
    steady: xr.Dataset | None = None,
    settings: Prefilter | None = None,
) -> Comparison:
    """Hold models against a record that none of them was made of.

    Parameters
    ----------
    models : mapping
        By name results of `identify`, linear models, or parameter-varying ones, which are frozen at the record's
        operating point.
    record : Dataset
        Record of the schema, held out; gaps are left out as in `identify`.
    steady, settings
        As for `identify`.

    Raises
    ------
    ModelError
        If there are no models, or one does not map two references to two displacements.
    SchemaError

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = {"Model 3": rs.identify(record, 3), "Model 1": rs.identify(record, 1)}
    >>> rs.identification.compare_models(found, record).rows[0].name
    'Model 3'
    """
    if not models:
        raise ModelError("compare_models: no models; give results of identify or models by name")
    signals = of_stretches(record, steady, settings)[1]
    rows = [_compared(name, one, signals) for name, one in models.items()]
    best = sorted(rows, key=lambda row: -float(np.mean(row.fit)))
    return Comparison(tuple(best), ceiling(project(signals.y, signals.Q), signals.noise))


def _compared(name: str, given: Any, signals: Signals) -> Compared:
    model, remark = _frozen(name, given, signals)
    if (model.B.shape[1], model.C.shape[0]) != (2, 2):
        raise ModelError(
            f"compare_models: {name} has {model.B.shape[1]} inputs and {model.C.shape[0]} outputs; give models from "
            "references x, y to disc x, y"
        )
    if not model.stable:
        raise ModelError(f"compare_models: {name} is unstable and cannot be simulated over a record; leave it out")
    modes = (given.wn, given.zeta) if isinstance(given, Identification) else (model.wn, model.zeta)
    return Compared(
        name, model.order, fit_of(model, signals), noise_free_fit(model, signals), *modes, model.static_gain, remark
    )


def _frozen(name: str, given: Any, signals: Signals) -> tuple[LinearModel, str]:
    """The linear model at the record's operating point, and a remark where it is not made for that point."""
    if isinstance(given, LpvModel):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = given.at(signals.speed, signals.pressure)
        return model, "extrapolated to the record's operating point" if model.extrapolated else ""
    model = given.model if isinstance(given, Identification) else given
    if not isinstance(model, LinearModel):
        raise ModelError(f"compare_models: {name} is a {type(given).__name__}; give results of identify or models")
    if "pin_x" in model.outputs:
        raise ModelError(f"compare_models: {name} is a model of the actuators; give models of the disc")
    apart = np.abs([model.speed - signals.speed, model.pressure - signals.pressure])
    return model, "made at another operating point than the record's" if np.any(apart > SAME) else ""

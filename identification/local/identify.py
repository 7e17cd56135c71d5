"""`identify`: local model with parameter uncertainty from one record at a constant operating point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import UnfitError
from identification.local.blackbox import FullStateSpace, balanced, subspace
from identification.local.closed_loop import judged
from identification.local.confidence import propagate
from identification.local.fit import Fit, GreyBox, Predictor, Problem, solve
from identification.local.goodness import ceiling, fit_of, noise_free_fit, project, simulated
from identification.local.greybox import STRUCTURES, delays, modes, static_gain
from identification.local.joint import ahead_of, covariance_of, problem_of
from identification.local.models import LinearModel
from identification.local.prepare import ready
from identification.local.residuals import residual_tests
from identification.local.result import Identification
from identification.local.start import broadened, start_values
from identification.local.stretches import longest_part, offsets
from identification.records.checks import check_modes, suspicious_gains
from identification.records.pin_positions import pin_pairs
from identification.records.prefilter import Prefilter, Signals
from identification.threads import one_thread
from rotorsim.base.rounding import normal_root

if TYPE_CHECKING:
    import xarray as xr

MODELS = ("1", "2", "3", "actuator", "blackbox")
METHODS = ("auto", "oe", "pem", "two-stage")
CANDIDATES = 5000
"""Samples on which the candidates for a start are compared."""
TRIAL = 8
"""Steps of each candidate."""
REDUNDANT = 1e-6
"""Where a black-box fit ends: what is left moves along directions that the data hardly know, and no fit any more."""


@one_thread
def identify(
    ds: xr.Dataset | Sequence[xr.Dataset],
    model: int | str = 3,
    order: int = 6,
    method: str = "auto",
    steady: xr.Dataset | None = None,
    settings: Prefilter | None = None,
    start: Any = None,
    check: bool = True,
) -> Identification:
    """Identify one record at a constant operating point, or several at the same point in one fit.

    Parameters
    ----------
    ds : Dataset or sequence of Dataset
        Record of the schema with `reference` and `disc_measured`; for model 2 and 'actuator' also `pin`. Samples that
        are not finite and leaps of time are left out; every stretch has its own initial state, every record its own
        offset.
    model : 1, 2, 3, 'actuator' or 'blackbox'
        Structure, see `identification.local.greybox` and `identification.local.blackbox`.
    order : int
        Of the black-box model.
    method : 'auto', 'oe', 'pem' or 'two-stage'
        Output error, which leftover imbalance disturbs less, prediction error, or two stages: output error behind what
        the external reference explains, see `identification.local.closed_loop`. 'auto' takes two stages for a record
        of a closed loop that holds `reference_external`, and output error otherwise.
    steady : Dataset or None
        Record without excitation at the same operating point, for the extended runout filter.
    settings : Prefilter or None
        Prefilter.
    start : sequence of float or None
        Start of the parameters in place of values found in the data.
    check : bool
        Refuse records with saturation, drop-outs, mistaken units or drift, and for output error those that name the
        controller they were made with; length and excitation are always checked. A record whose reference follows past
        displacements gives a warning.

    Returns
    -------
    Identification

    Raises
    ------
    SchemaError, UnfitError
        With one sentence about what the record lacks, or about a grey-box model with a mode above the record's
        Nyquist frequency.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.identify(record, model=3)
    >>> found.model.wn.shape
    (2,)
    """
    began, kind = perf_counter(), str(model)
    if kind not in MODELS or method not in METHODS:
        raise UnfitError(f"identify: model {model!r}, method {method!r}; choose of {', '.join(MODELS)} and {METHODS}")
    records: list[Any] = list(ds) if isinstance(ds, (list, tuple)) else [ds]
    made = ready(records, method, steady, settings, check, count_of(kind, order))
    signals, method = made.fit, "oe" if made.method == "two-stage" else made.method
    if kind in ("2", "actuator") and signals.pins is None:
        raise UnfitError(f"record: no pin; model {kind} needs pin positions, map them or take model 3")
    if kind == "2":
        found = _two_steps(signals, method, start)
    elif kind == "blackbox":
        found = _black_box(signals, order, method)
    else:
        found = _grey_box(kind, signals, method, start)
    if made.external is not None:
        found = judged(found, actuator_signals(made.whole) if kind == "actuator" else made.whole, made.external)
    return replace(found, seconds=perf_counter() - began, warnings=(*made.remarks, *found.warnings))


def count_of(kind: str, order: int) -> int:
    """Number of parameters."""
    return order * 4 if kind == "blackbox" else len(STRUCTURES[kind].parameters)


def actuator_signals(signals: Signals) -> Signals:
    """The same record with the pins' motion as output."""
    assert signals.pins is not None
    v = pin_pairs(signals.pins, signals.u)
    rest = signals.rest if signals.rest >= 50 else len(v)
    Q = offsets(len(v), signals.breaks)
    return replace(signals, y=v - v[:rest].mean(axis=0), truth=None, Q=Q, noise=np.zeros(2))


def _grey_box(kind: str, signals: Signals, method: str, start: Any) -> Identification:
    chosen = actuator_signals(signals) if kind == "actuator" else signals
    fitted, covariance = _solved(kind, chosen, chosen.u, "zero", method, start)
    theta = fitted.theta[: len(STRUCTURES[kind].parameters)]
    return _grey_result(kind, method, chosen, theta, covariance, fitted)


def _solved(kind: str, signals: Signals, w: np.ndarray, hold: str, method: str, start: Any) -> tuple[Fit, np.ndarray]:
    """Fit and covariance of a grey-box structure."""
    grey = GreyBox(STRUCTURES[kind], signals.Ts, hold)
    problem = problem_of(grey, _inputs(w, hold), project(signals.y, signals.Q), signals.Q, signals.breaks)
    if start is None:
        first = _best_start(problem, signals, start_values("2" if kind == "rotor" else kind, *_excited(w, signals)))
    else:
        first = np.asarray(start, float)
        if not problem.usable(first):
            raise UnfitError(f"identify.start: {STRUCTURES[kind].name} is unstable there; start from a stable model")
        first = first if kind == "actuator" else _best_start(problem, signals, [first, broadened(first)])
    fitted, q = solve(problem, first), len(first)
    if method == "pem":
        n = len(grey.sampled(first)[0])
        problem = ahead_of(problem, Predictor(grey, n, 2))
        fitted = solve(problem, np.concatenate([fitted.theta, np.zeros(2 * n)]))
    return fitted, covariance_of(problem, fitted, q, signals.Ts)


def _inputs(w: np.ndarray, hold: str) -> np.ndarray:
    """Inputs as the sampled model takes them: (u_k, u_k+1) where they run straight between samples."""
    return np.hstack([w, np.vstack([w[1:], w[-1:]])]) if hold == "first" else np.ascontiguousarray(w)


def _excited(w: np.ndarray, signals: Signals) -> tuple[np.ndarray, np.ndarray, float]:
    """Inputs and outputs from the end of the rest, and their period."""
    first = min(signals.rest, len(w) // 2)
    return w[first:], signals.y[first:], signals.Ts


def _best_start(problem: Problem, signals: Signals, candidates: Sequence[np.ndarray]) -> np.ndarray:
    """The usable candidate whose first steps on a stretch of the record come closest."""
    part = longest_part(signals)
    first = max(part.start, min(signals.rest, len(signals.u) // 2))
    at = slice(first, min(first + CANDIDATES, part.stop))
    short = Problem(problem.model, problem.w[at], problem.y[at], np.linalg.qr(problem.Q[at])[0])
    best, lowest = None, np.inf
    for theta in candidates:
        if problem.usable(theta):
            tried = solve(short, theta, TRIAL)
            if tried.cost < lowest and problem.usable(tried.theta):
                best, lowest = tried.theta, tried.cost
    if best is None:
        raise UnfitError("identify: no stable start found in the data; give start=, or check the record's channels")
    return best


def _two_steps(signals: Signals, method: str, start: Any) -> Identification:
    """Model 2: actuators from references to pins, then the rotor from pins to disc (thesis, figure 2.5)."""
    moved = actuator_signals(signals)
    begin = (None, None) if start is None else np.split(np.asarray(start, float), [14])
    one, one_cov = _solved("rotor", signals, moved.y, "first", method, begin[0])
    two, two_cov = _solved("actuator", moved, moved.u, "zero", method, begin[1])
    theta = np.concatenate([one.theta[:14], two.theta[:6]])
    covariance = np.zeros((20, 20))
    covariance[:14, :14], covariance[14:, 14:] = one_cov, two_cov
    result = _grey_result("2", method, signals, theta, covariance, one)
    return replace(result, information=np.zeros((0, 0)))


def _grey_result(
    kind: str, method: str, signals: Signals, theta: np.ndarray, covariance: np.ndarray, fitted: Fit
) -> Identification:
    structure = STRUCTURES[kind]
    A, B, C, D = structure.matrices(theta)
    outputs = ("pin_x", "pin_y") if kind == "actuator" else ("disc_x", "disc_y")
    model = LinearModel(A, B, C, D, 0.0, outputs=outputs, speed=signals.speed, pressure=signals.pressure)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0))
    parameters = {name: (float(v), float(s)) for name, v, s in zip(structure.parameters, theta, sd, strict=True)}
    gain = static_gain(kind, theta)
    moving = kind != "actuator"
    wn, zeta = modes(theta) if moving else (np.empty(0), np.empty(0))
    check_modes(wn, signals.Ts)
    spread = propagate(lambda t: np.concatenate(modes(t)), theta, covariance) if moving else np.empty(0)
    return _result(
        kind, method, model, parameters, theta, covariance, signals, fitted,
        modes_found=(wn, zeta, spread[: len(wn)], spread[len(wn) :]),
        gains=(gain, propagate(lambda t: static_gain(kind, t), theta, covariance).reshape(2, 2)),
        lags=(delays(kind, theta), propagate(lambda t: delays(kind, t), theta, covariance)),
        information=schur(fitted.N, len(theta)) if len(fitted.theta) == len(theta) else np.zeros((0, 0)),
        warnings=suspicious_gains(gain) if moving else (),
    )  # fmt: skip


def schur(N: np.ndarray, keep: int) -> np.ndarray:
    """Normal matrix of the first parameters with the others (initial states) eliminated."""
    known = N[:keep, keep:] @ normal_root(N[keep:, keep:])
    return np.asarray(N[:keep, :keep] - known @ known.T)


def _black_box(signals: Signals, order: int, method: str) -> Identification:
    y = project(signals.y, signals.Q)
    full = FullStateSpace(order, 2, 2)
    scale = float(np.std(y))  # matrices of like size make the redundant fit well conditioned
    at = longest_part(signals)
    A, B, C = balanced(*subspace(signals.u[at], y[at] / scale, order))
    problem = problem_of(full, np.ascontiguousarray(signals.u), y / scale, signals.Q, signals.breaks)
    fitted = solve(problem, full.pack(A, B, C), tolerance=REDUNDANT)
    if method == "pem":
        problem = ahead_of(problem, Predictor(full, order, 2))
        fitted = solve(problem, np.concatenate([fitted.theta, np.zeros(2 * order)]), tolerance=REDUNDANT)
    q = order * (order + 4)
    theta = fitted.theta[:q]
    covariance = covariance_of(problem, fitted, q, signals.Ts)
    model = _black_model(full, theta, scale, signals)
    wn, zeta = model.wn, model.zeta

    def properties(values: np.ndarray) -> np.ndarray:
        other = _black_model(full, values, scale, signals)
        same = len(other.wn) == len(wn)
        return np.concatenate([other.wn if same else wn, other.zeta if same else zeta, other.static_gain.ravel()])

    spread = propagate(properties, theta, covariance)
    n = len(wn)
    return _result(
        "blackbox", method, model, {}, theta, covariance, signals, fitted,
        modes_found=(wn, zeta, spread[:n], spread[n : 2 * n]),
        gains=(model.static_gain, spread[2 * n :].reshape(2, 2)), lags=(np.full(2, np.nan), np.full(2, np.nan)),
        information=np.zeros((0, 0)), warnings=suspicious_gains(model.static_gain),
    )  # fmt: skip


def _black_model(full: FullStateSpace, theta: np.ndarray, scale: float, signals: Signals) -> LinearModel:
    A, B, C, D = full.sampled(theta)
    return LinearModel(A, B, C * scale, D, signals.Ts, speed=signals.speed, pressure=signals.pressure)


def _result(
    kind: str, method: str, model: LinearModel, parameters: dict[str, tuple[float, float]], theta: np.ndarray,
    covariance: np.ndarray, signals: Signals, fitted: Fit, *, modes_found: tuple[np.ndarray, ...],
    gains: tuple[np.ndarray, ...], lags: tuple[np.ndarray, ...], information: np.ndarray, warnings: tuple[str, ...],
) -> Identification:  # fmt: skip
    y = project(signals.y, signals.Q)
    left = y - project(simulated(model, signals), signals.Q)
    wn, zeta, wn_sd, zeta_sd = modes_found
    unfinished = () if fitted.converged else (f"the fit did not converge in {fitted.iterations} iterations",)
    return Identification(
        kind, method, model, parameters, theta, covariance, fit_of(model, signals), ceiling(y, signals.noise),
        noise_free_fit(model, signals), wn, zeta, wn_sd, zeta_sd, gains[0], gains[1], lags[0], lags[1],
        residual_tests(left, signals.u), left.std(axis=0), signals.speed, signals.pressure,
        fitted.iterations, fitted.converged, 0.0, signals.notes, (*unfinished, *warnings), information,
    )  # fmt: skip

r"""Fits of grey-box and black-box models, of one record or of several stretches, and the warning of a long dead time.

A black-box model starts from the subspace method and is refined by output error or prediction error.

Model 3 may have a dead time, found in the record or given. Between reference and film force lie two poles of an
actuator and the film. The one lag that stands for all of them takes their phase at the modes, and with it more of the
gain there than they do, so that the fit raises the gain at rest. With a dead time on each axis next to it, a
first-order Pade approximation, the phase costs no gain.

.. math:: F_i(s) = \frac{p_i}{s + p_i}\; \frac{r_i - s}{r_i + s}, \qquad \tau_i = 2/r_i

The approximation is off by less than 0.1 rad while omega tau < 1.1, beyond which a result warns.

Cites: skogestad_2005.
"""

from collections.abc import Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from identification.local.bias import AtRest, at_rest, bias, nothing
from identification.local.blackbox import FullStateSpace, balanced, subspace
from identification.local.closed_loop import acted_of
from identification.local.confidence import (
    Spread,
    ceiling,
    fit_of,
    noise_free_fit,
    project,
    propagate,
    residual_tests,
    sandwich,
    simulated,
    spread,
    without_nuisance,
)
from identification.local.greybox import (
    DEAD_TIME,
    DELAYED,
    SHORTEST_DEAD,
    STRUCTURES,
    broadened,
    delays,
    modes,
    start_values,
    static_gain,
)
from identification.local.least_squares import FitProblem, GreyBox, Minimum, covariance_of, predicted, scores_of, solve
from identification.local.models import LinearModel
from identification.local.result import Identification, noted
from identification.local.structures import (
    Structure,
    bound_remarks,
    box,
    prepared,
    properties,
    refuse_indistinguishable,
    sizes,
    valued,
)
from identification.records.checks import check_modes, suspicious_gains
from identification.records.prefilter import Signals, longest_part, noise_of, offsets, pin_pairs, regressors_of
from rotorsim.base.errors import UnfitError
from rotorsim.base.rounding import normal_root

FREE = "free"
LONGEST = 5e-3
"""Longest dead time [s] that can be given."""
SHARE = 0.01
"""Longest dead time as a share of the record."""
SIGNIFICANT = 3.0
"""Least dead time of both axes that counts as found, in its standard deviations."""
LEAST = 0.25
"""Least dead time of both axes that counts as found, in samples."""
NONE = "no dead time found on both axes: Model 3 without one"
"""Note about a free dead time that the record does not show."""
COARSE = 1.1
"""Angle omega tau [rad] of the highest mode from which a first-order Pade approximation is coarse."""


def kind_for(model: str, dead_time: float | str) -> str:
    """Structure for `identify(model=, dead_time=)`.

    Raises UnfitError for a dead time that is negative, no number, too short or too long, or of another model than 3.
    """
    if isinstance(dead_time, str) and dead_time == FREE:
        return DELAYED if model == "3" else model
    wrong = isinstance(dead_time, bool) or not isinstance(dead_time, Real)
    if isinstance(dead_time, str) or wrong or not np.isfinite(dead_time) or dead_time < 0:
        raise UnfitError(f"identify.dead_time: {dead_time!r}; give seconds, 0 for none, or '{FREE}' to find it")
    if dead_time == 0:
        return model
    if model != "3":
        raise UnfitError(f"identify.dead_time: {dead_time:g} s for model {model}; only model 3 has a dead time")
    if not SHORTEST_DEAD < dead_time <= LONGEST:
        raise UnfitError(
            f"identify.dead_time: {dead_time:g} s; give {SHORTEST_DEAD:g} to {LONGEST:g} s, or shift the reference of "
            "the record by whole samples"
        )
    return DELAYED


def check_dead_time(dead_time: float | str, lasting: float) -> None:
    """Raise UnfitError for a stated dead time that is more than a hundredth of the excited record [s]."""
    if not isinstance(dead_time, str) and dead_time > SHARE * lasting:
        raise UnfitError(
            f"record: {lasting:.3g} s with excitation, a dead time of {dead_time:g} s needs {dead_time / SHARE:.3g} s "
            "or more; record longer"
        )


def _with_dead_time(dead_time: float) -> Structure:
    """Model 3 behind a known dead time [s] on both axes: the parameters of Model 3."""
    full, known = STRUCTURES[DELAYED], np.full(2, 2 / dead_time)
    return replace(
        STRUCTURES["3"], name=full.name, matrices=lambda theta: full.matrices(np.concatenate([theta[:14], known]))
    )


def _dead_time_promising(problem: FitProblem, theta: np.ndarray, x0: np.ndarray, Ts: float) -> bool:
    """Whether from a fit of Model 3 without dead time, at theta and x0, a step by Gauss and Newton lengthens one of
    LEAST samples on both axes; a look before the whole fit."""
    ahead = replace(problem, model=GreyBox(STRUCTURES[DELAYED], Ts))
    begin = np.concatenate([theta[:14], np.full(2, 2 / (LEAST * Ts))])
    states = x0.reshape(-1, len(problem.model.sampled(theta)[0]))  # of each stretch
    N, g, _ = ahead.normal_equations(begin, np.pad(states, ((0, 0), (0, 2))).ravel())
    scale = np.sqrt(np.maximum(np.diag(N), 1e-300))
    step = np.linalg.lstsq(N / np.outer(scale, scale), g / scale, rcond=1e-12)[0]
    return bool(np.all(step[14:16] < 0))  # of the rates 2 / dead time


def _dead_time_found(theta: np.ndarray, covariance: np.ndarray, Ts: float) -> bool:
    """Whether dead times of both axes differ from zero by more than their uncertainty."""
    r = theta[14:16]
    tau, sd = 2 / r, 2 * np.sqrt(np.maximum(np.diag(covariance)[14:16], 0)) / r**2
    return bool(np.all(tau > max(1.1 * SHORTEST_DEAD, LEAST * Ts)) and np.all(tau > SIGNIFICANT * sd))


def _dead_time_remark(theta: np.ndarray, wn: np.ndarray) -> tuple[str, ...]:
    """A sentence about dead times that are long for the modes wn [rad/s]."""
    tau = 2 / theta[14:16]
    if wn.size == 0 or wn.max() * tau.max() < COARSE:
        return ()
    return (
        f"dead time {1e3 * tau.max():.3g} ms: {np.degrees(wn.max() * tau.max()):.0f} deg at the highest mode, too much "
        "for one Pade approximation; shift the reference of the record by whole samples",
    )


CANDIDATES = 5000
"""Samples on which the candidates for a start are compared."""
TRIAL = 8
"""Steps of each candidate."""


AT_REST = 400
"""Samples at rest from which the noise of measured pins is taken."""


def actuator_signals(signals: Signals) -> Signals:
    """The same record with the pins' motion as output; its noise is that of the pins at rest, none without a rest."""
    assert signals.pins is not None
    v = pin_pairs(signals.pins, signals.u)
    rest = signals.rest if signals.rest >= 50 else len(v)
    Q = offsets(len(v), signals.breaks)
    noise = noise_of(v, Q, signals.rest) if signals.rest >= AT_REST else np.zeros(2)
    return replace(signals, y=v - v[:rest].mean(axis=0), truth=None, Q=Q, noise=noise)


def grey_box(kind: str, signals: Signals, method: str, start: Any) -> Identification:
    """Grey-box model whose parameters come from one fit."""
    chosen = actuator_signals(signals) if kind == "actuator" else signals
    fitted, found, calm = _solved(kind, chosen, chosen.u, "zero", method, start)
    theta = fitted.theta[: len(STRUCTURES[kind].parameters)]
    return _grey_result(kind, method, chosen, theta, found, calm, fitted)


def delayed(signals: Signals, method: str, start: Any, dead_time: float | str) -> Identification:
    """Model 3 with dead times, estimated or stated; without where the record shows none."""
    begin = None if start is None else list(start)[:14]
    if isinstance(dead_time, str):
        problem, plain = _fitted("3", signals, signals.u, "zero", method, begin)
        more = [2 / DEAD_TIME] * 2 if start is None or len(start) < 16 else start[14:]
        shown = method == "pem" or _dead_time_promising(problem, plain.theta, plain.x0, signals.Ts)
        if shown:
            fitted, found, calm = _solved(DELAYED, signals, signals.u, "zero", method, [*plain.theta[:14], *more])
            theta = fitted.theta[:16]
            shown = _dead_time_found(theta, found.covariance, signals.Ts)
        if not shown:
            judged = _judged("3", method, signals, problem, plain)
            return noted(_grey_result("3", method, signals, plain.theta[:14], *judged, plain), NONE)
    else:
        fitted, found, calm = _solved("3", signals, signals.u, "zero", method, begin, _with_dead_time(dead_time))
        theta, known = np.concatenate([fitted.theta[:14], np.full(2, 2 / dead_time)]), np.zeros((2, 2))
        found, calm = found.joined(Spread(known, known)), calm.joined(2)
    result = _grey_result(DELAYED, method, signals, theta, found, calm, fitted)
    return replace(result, warnings=(*result.warnings, *_dead_time_remark(theta, result.wn)))


def _solved(
    kind: str, signals: Signals, w: np.ndarray, hold: str, method: str, start: Any, structure: Structure | None = None
) -> tuple[Minimum, Spread, AtRest]:
    """Fit, covariance and change at rest of a grey-box structure, or of another with its parameters."""
    problem, fitted = _fitted(kind, signals, w, hold, method, start, structure)
    return fitted, *_judged(kind, method, signals, problem, fitted)


def _fitted(
    kind: str, signals: Signals, w: np.ndarray, hold: str, method: str, start: Any, structure: Structure | None = None
) -> tuple[FitProblem, Minimum]:
    """Fit of a structure, and the problem that it solves."""
    grey = GreyBox(structure or STRUCTURES[kind], signals.Ts, hold)
    problem = FitProblem(grey, _inputs(w, hold), project(signals.y, signals.Q), signals.Q, breaks=signals.breaks)
    problem = _with_judge(problem, kind, signals, hold)
    if start is None:
        rest = min(signals.rest, len(w) // 2)
        candidates = start_values("2" if kind == "rotor" else kind, w[rest:], signals.y[rest:], signals.Ts)
        first = _best_start(problem, signals, candidates)
    else:
        first = np.asarray(start, float)
        _check_start(first, len(grey.structure.parameters), grey.structure.name)
        if not problem.usable(first):
            raise UnfitError(f"identify.start: {STRUCTURES[kind].name} is unstable there; start from a stable model")
        first = first if kind == "actuator" else _best_start(problem, signals, [first, broadened(first)])
    fitted = solve(problem, first)
    return predicted(problem, fitted) if method == "pem" else (problem, fitted)


def _judged(kind: str, method: str, signals: Signals, problem: FitProblem, fitted: Minimum) -> tuple[Spread, AtRest]:
    """Covariance of the structure's parameters, and their change at rest by an output-error fit of what moves."""
    q = len(STRUCTURES[kind].parameters) if method == "pem" else len(fitted.theta)
    found = spread(*scores_of(problem, fitted.theta, fitted.x0), signals.Ts, signals.noise).first(q)
    if method == "pem" or kind == "actuator":
        return found, nothing(q)
    return found, at_rest(problem, fitted.theta, fitted.x0, signals.Ts, signals.noise)


def _with_judge(problem: FitProblem, kind: str, signals: Signals, hold: str) -> FitProblem:
    """The problem, judged by what acted where its inputs are only the explained part of that."""
    if (acted := acted_of(signals)) is None:
        return problem
    moved = actuator_signals(acted) if acted.pins is not None else acted
    chosen = moved if kind == "actuator" else acted
    w = moved.y if kind in ("rotor", "rotor-rate") else acted.u
    return replace(problem, judge=replace(problem, w=_inputs(w, hold), y=project(chosen.y, chosen.Q)))


def _inputs(w: np.ndarray, hold: str) -> np.ndarray:
    """Inputs as the sampled model takes them: (u_k, u_k+1) where they run straight between samples."""
    return np.hstack([w, np.vstack([w[1:], w[-1:]])]) if hold == "first" else np.ascontiguousarray(w)


def _best_start(problem: FitProblem, signals: Signals, candidates: Sequence[np.ndarray]) -> np.ndarray:
    """The usable candidate whose first steps on a stretch of the record come closest."""
    part = longest_part(signals)
    first = max(part.start, min(signals.rest, len(signals.u) // 2))
    at = slice(first, min(first + CANDIDATES, part.stop))
    short = FitProblem(problem.model, problem.w[at], problem.y[at], np.linalg.qr(regressors_of(problem.Q, at)[0])[0])
    best, lowest = None, np.inf
    for theta in candidates:
        if problem.usable(theta):
            tried = solve(short, theta, TRIAL)
            if tried.cost < lowest and problem.usable(tried.theta):
                best, lowest = tried.theta, tried.cost
    if best is None:
        raise UnfitError("identify: no stable start found in the data; give start=, or check the record's channels")
    return best


def two_steps(kind: str, signals: Signals, method: str, start: Any) -> Identification:
    """Model 2: actuators from references to pins, then the rotor from pins to disc (thesis, figure 2.5)."""
    moved = actuator_signals(signals)
    rotor, count = ("rotor", 14) if kind == "2" else ("rotor-rate", 18)
    begin: Sequence[Any] = (None, None) if start is None else np.split(np.asarray(start, float), [count])
    if kind != "2" and start is None:  # of a Model 2 without rates
        plain = _fitted("rotor", signals, moved.y, "first", "oe", None)[1]
        begin = (np.concatenate([plain.theta, np.zeros(4)]), None)
    if start is not None:
        _check_start(start, count + 6, f"Model {kind}")
    one, first, calm = _solved(rotor, signals, moved.y, "first", method, begin[0])
    two, second, _ = _solved("actuator", moved, moved.u, "zero", method, begin[1])
    theta = np.concatenate([one.theta[:count], two.theta[:6]])
    result = _grey_result(kind, method, signals, theta, first.joined(second), calm.joined(6), one)
    return replace(result, information=np.zeros((0, 0)))


def _check_start(start: Any, wanted: int, name: str) -> None:
    """Raise UnfitError where a start has another number of values than a model has parameters."""
    given = np.size(start)
    if given != wanted:
        raise UnfitError(f"identify.start: {name} has {wanted} parameters, {given} are given; give its theta")


def _grey_result(
    kind: str, method: str, signals: Signals, theta: np.ndarray, found: Spread, calm: AtRest, fitted: Minimum
) -> Identification:
    structure, covariance = STRUCTURES[kind], found.covariance
    A, B, C, D = structure.matrices(theta)
    outputs = ("pin_x", "pin_y") if kind == "actuator" else ("disc_x", "disc_y")
    model = LinearModel(A, B, C, D, 0.0, outputs=outputs, speed=signals.speed, pressure=signals.pressure)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0))
    parameters = {name: (float(v), float(s)) for name, v, s in zip(structure.parameters, theta, sd, strict=True)}
    gain = static_gain(kind, theta)
    moving = kind != "actuator"
    wn, zeta = modes(theta) if moving else (np.empty(0), np.empty(0))
    check_modes(wn, signals.Ts)
    sds = propagate(lambda t: np.concatenate(modes(t)), theta, covariance) if moving else np.empty(0)
    result = result_of(
        kind, method, model, parameters, theta, covariance, signals, fitted,
        modes_found=(wn, zeta, sds[: len(wn)], sds[len(wn) :]),
        gains=(gain, propagate(lambda t: static_gain(kind, t), theta, covariance).reshape(2, 2)),
        lags=(delays(kind, theta), propagate(lambda t: delays(kind, t), theta, covariance)),
        information=schur(fitted.N, len(theta)) if len(fitted.theta) == len(theta) else np.zeros((0, 0)),
        warnings=suspicious_gains(gain) if moving else (),
    )  # fmt: skip
    if not moving:
        return result
    left = project(signals.y, signals.Q) - project(simulated(model, signals), signals.Q)
    return replace(result, bias=bias(kind, theta, found, calm, model, signals, left, result.residuals.independent))


def _own_covariance(structure: Structure, problem: FitProblem, fitted: Minimum, Ts: float) -> np.ndarray:
    """Covariance (q, q) of the parameters; of those at a bound zero, for the others as if these were known.

    Raises UnfitError if the record does not show some parameters apart; the sentence names them.
    """
    q = len(structure.parameters)
    free = ~np.any(structure.at_bounds(fitted.theta[:q]), axis=0)
    forced = scores_of(problem, fitted.theta, np.zeros_like(fitted.x0))[1]  # noise in the initial state shows nothing
    refuse_indistinguishable(structure, without_nuisance(forced, sizes(structure, fitted.theta[:q]))[:, free], free)
    left, J = scores_of(problem, fitted.theta, fitted.x0)
    kept = np.concatenate([free, np.ones(J.shape[2] - q, bool)])
    covariance, count = np.zeros((q, q)), int(free.sum())
    covariance[np.ix_(free, free)] = sandwich(left, np.ascontiguousarray(J[..., kept]), Ts)[:count, :count]
    return covariance


def own_structure(structure: Structure, signals: Signals, method: str, start: Any) -> Identification:
    """Fit of a structure that the user has written."""
    made, first = prepared(structure, start)
    grey, q = GreyBox(made, signals.Ts), len(first)
    y = project(signals.y, signals.Q)
    problem = FitProblem(grey, np.ascontiguousarray(signals.u), y, signals.Q, box(made), signals.breaks)
    problem = _with_judge(problem, "own", signals, "zero")
    fitted = solve(problem, _best_start(problem, signals, [first]))
    if method == "pem":
        problem, fitted = predicted(problem, fitted)
    theta = fitted.theta[:q]
    covariance = _own_covariance(made, problem, fitted, signals.Ts)
    wn, zeta, wn_sd, zeta_sd, *gains = properties(lambda values: LinearModel(*made.matrices(values)), theta, covariance)
    check_modes(wn, signals.Ts)
    model = LinearModel(*made.matrices(theta), speed=signals.speed, pressure=signals.pressure)
    found = result_of(
        structure.name, method, model, valued(made, theta, covariance), theta, covariance, signals, fitted,
        modes_found=(wn, zeta, wn_sd, zeta_sd), gains=tuple(gains), lags=(np.full(2, np.nan), np.full(2, np.nan)),
        information=np.zeros((0, 0)), warnings=bound_remarks(made, theta),
    )  # fmt: skip
    return replace(found, units=structure.units)


def schur(N: np.ndarray, keep: int) -> np.ndarray:
    """Normal matrix of the first parameters with the others (initial states) eliminated."""
    known = N[:keep, keep:] @ normal_root(N[keep:, keep:])
    return np.asarray(N[:keep, :keep] - known @ known.T)


def result_of(
    kind: str, method: str, model: LinearModel, parameters: dict[str, tuple[float, float]], theta: np.ndarray,
    covariance: np.ndarray, signals: Signals, fitted: Minimum, *, modes_found: tuple[np.ndarray, ...],
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


def _subspace(signals: Signals, order: int) -> tuple[np.ndarray, float, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Outputs without regressors, their size, and A, B, C for outputs of size 1: such fits are well conditioned."""
    y = project(signals.y, signals.Q)
    scale, at = float(np.std(y)), longest_part(signals)
    return y, scale, subspace(signals.u[at], y[at] / scale, order)


def subspace_fit(signals: Signals, order: int) -> np.ndarray:
    """Fit (2,) of the black-box model that the subspace method finds, with which a grey box is compared.

    Raises UnfitError for a record too short for it.
    """
    _, scale, (A, B, C) = _subspace(signals, order)
    return fit_of(LinearModel(A, B, C * scale, np.zeros((2, 2)), signals.Ts), signals)


REDUNDANT = 1e-6
"""Least relative improvement at which a black-box fit ends."""
NOISE_SHARE = 0.1
"""Improvement at which a black-box fit ends, over the one that noise alone gives its free directions."""


def black_box(signals: Signals, order: int, method: str) -> Identification:
    """A black-box model of an order, from the subspace method on.

    Its 4 `order` free directions take 4 `order` of the y.size variances of noise out of the cost, wherever they end: a
    step that promises a tenth of that moves the parameters by a third of their uncertainty.
    """
    full, (y, scale, start) = FullStateSpace(order, 2, 2), _subspace(signals, order)
    A, B, C = balanced(*start)
    problem = FitProblem(full, np.ascontiguousarray(signals.u), y / scale, signals.Q, breaks=signals.breaks)
    if (acted := acted_of(signals)) is not None:
        problem = replace(problem, judge=replace(problem, w=acted.u))
    tolerance = max(REDUNDANT, NOISE_SHARE * 4 * order / y.size)
    fitted = solve(problem, full.pack(A, B, C), tolerance=tolerance)
    if method == "pem":
        problem, fitted = predicted(problem, fitted, tolerance)
    q = order * (order + 4)
    theta = fitted.theta[:q]
    covariance = covariance_of(problem, fitted, q, signals.Ts)

    def model_of(values: np.ndarray) -> LinearModel:
        A, B, C, D = full.sampled(values)
        return LinearModel(A, B, C * scale, D, signals.Ts, speed=signals.speed, pressure=signals.pressure)

    *modes_found, gain, gain_sd = properties(model_of, theta, covariance)
    return result_of(
        "blackbox", method, model_of(theta), {}, theta, covariance, signals, fitted, modes_found=tuple(modes_found),
        gains=(gain, gain_sd), lags=(np.full(2, np.nan), np.full(2, np.nan)), information=np.zeros((0, 0)),
        warnings=suspicious_gains(gain),
    )  # fmt: skip

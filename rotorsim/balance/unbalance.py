r"""Unbalance from 1X vectors: influence coefficients, a machine's model, tests by leaving one out, correction weights.

Influence coefficients say what each plane's unbalance adds to each vector. The vectors y (m,) of a condition with added
unbalance u (q,) are

.. math:: y = y_0 + H u + e, \qquad \operatorname{cov} e = S,

with one complex row of H a reading and speed. S holds what repeats of one condition do not show: a mounting, a drift of
the machine and of its first unbalance move all probes together, so the errors of the readings are strongly correlated
and the plain least-squares answer follows the worst of them. H and y_0 are least squares over the conditions with a
label; S is the covariance of what they leave, its correlations shrunk as far as its few conditions cannot show them
(Schaefer & Strimmer 2005); u is then the generalised least-squares estimate (Aitken). Sources: Goodman (1964) for least
squares over speeds and probes, Schaefer & Strimmer (2005). As many conditions as unknowns, such as a run without
and one with a trial weight in one plane, give H and y_0 exactly and tell nothing of S: all readings then weigh the same
and no deviation is stated.

Without phases, amplitudes a = \|y\| of a run without and three with a trial weight at different angles of each plane
give the same coefficients, turned so that y_0 is real: the four-run method (three circles that meet in a point), here
by least squares,

.. math:: a_k^2 = |y_0|^2 + |h|^2 |u_k|^2 + 2 \Re(\bar y_0 h u_k).

A machine's model gives the whirl of the shaft at each probe for unbalance in each plane. What a probe makes of it, its
angle, its sensitivity, the origin of the angles, is one complex number that all planes and speeds share and labelled
records give. Correction weights cancel the vectors, in the holes that a disc has. Results are a table of texts, plain
numbers and CSV.

Cites: goodman_1964, schaefer_2005.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite, pi
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from fe_shaft.response import run_unbalance_response
from rotorsim.balance.conditions import Conditions, Plane, Reading
from rotorsim.base.display import listing, quote
from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_UM
from rotorsim.machine import Machine, load_machine
from rotorsim.plant.mesh import Mesh

REGION = 0.9
"""Content of the regions that are stated."""
USUAL = 0.999
"""Share of conditions whose vectors leave no more than is taken for usual."""
NOISELESS = 1e-9
"""Least error of a reading, as a share of the largest: repeats may be equal to the last digit."""
DOUBT = 1e-3
"""Probability, for all labels together, below which a label is taken to contradict the others."""
METHODS = ("influence coefficients", "physical model", "amplitudes alone")
CONTRADICTION = 0.1
"""Largest misfit of amplitudes without phase over the largest of them."""
LEAST_CHANGE = 0.03
"""Least change of the vectors by a trial weight, root mean square over those without it."""
CLEAR = 3.0
"""Change by a trial weight, in errors of the vectors, that is more than chance."""
MOST_WEIGHTS = 10.0
"""Largest correction over the heaviest trial weight of its plane, unless repeats make the coefficients certain."""
G_MM = 1e6
"""g mm in a kg m."""


@dataclass(frozen=True, eq=False)
class Influence:
    """Influence coefficients and their errors.

    Attributes
    ----------
    coefficients : complex (m, q) [m/(kg m)], of vectors without added unbalance too: base (m,) [m]
    covariance : complex (m, m) [m^2] of a condition's errors, E[e e^H]; the unit matrix without freedom
    leverage : (q + 1, q + 1), inverse of the normal matrix of coefficients and base
    freedom : conditions less unknowns
    """

    coefficients: np.ndarray
    base: np.ndarray
    covariance: np.ndarray
    leverage: np.ndarray
    freedom: int


@dataclass(frozen=True, eq=False)
class Estimate:
    """Unbalance (q,) [kg m] of one condition, its complex covariance (q, q) [kg^2 m^2], the degrees of freedom of both.

    `left` is the weighted square of what the vectors leave, per degree of freedom: about 1. Above what one condition in
    thousand leaves (another day, another mounting) the covariance grows with it. Without freedom both are NaN.
    """

    unbalance: np.ndarray
    covariance: np.ndarray
    freedom: int
    left: float

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviation of either component of each plane's unbalance (q,) [kg m]."""
        return np.asarray(np.sqrt(np.diag(self.covariance).real / 2))

    def inside(self, truth: np.ndarray) -> np.ndarray:
        """Whether each plane's truth (q,) lies in its region of probability REGION."""
        distance = np.abs(self.unbalance - truth) ** 2 / np.diag(self.covariance).real
        return np.asarray(distance < stats.f.ppf(REGION, 2, 2 * self.freedom))


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Every labelled condition estimated from the others: truth and estimates (n, q) [kg m], regions met (n, q).

    `contradicts` lists the labels that all others together contradict.
    """

    labels: tuple[str, ...]
    truth: np.ndarray
    estimates: np.ndarray
    inside: np.ndarray
    contradicts: tuple[str, ...]

    @property
    def vector_rms(self) -> float:
        """Root mean square of the vector errors of a plane [kg m]."""
        return float(np.sqrt((np.abs(self.estimates - self.truth) ** 2).mean()))

    @property
    def magnitude_error(self) -> float:
        """Mean absolute error of the magnitudes [kg m]."""
        return float(np.abs(np.abs(self.estimates) - np.abs(self.truth)).mean())

    @property
    def content(self) -> float:
        """Share of the labels that lie in their region of probability REGION."""
        return float(self.inside.mean())


def fit_influence(vectors: np.ndarray, unbalance: np.ndarray) -> Influence:
    """Influence of `unbalance` (n, q) [kg m] on `vectors` (n, m) [m], both complex and complete.

    Raises
    ------
    DataError
        If there are fewer conditions than unknowns, planes were only ever changed together, or a vector is missing.

    Examples
    --------
    >>> import rotorsim as rs
    >>> unbalance = 1e-5 * np.arange(6)[:, None]  # kg m in one plane, and 0.1 m of vector for each
    >>> found = rs.balance.fit_influence(1e-6 + 0.1 * unbalance + 0j, unbalance + 0j)
    >>> float(abs(found.coefficients[0, 0]).round(3))
    0.1
    """
    if not np.isfinite(vectors).all():
        raise DataError("a condition with a known unbalance was not measured at every speed; leave it out")
    n, q = unbalance.shape
    regressors = np.column_stack([unbalance, np.ones(n)])
    scale = np.concatenate([np.full(q, np.abs(unbalance).max() or 1.0), [1.0]])
    if n < q + 1:
        planes = f"{q} planes" if q > 1 else "one plane"
        raise DataError(
            f"{n} conditions with a known unbalance: at least {q + 1} are needed for {planes}, one without a trial "
            "weight and one with a weight in each plane",
            argument="unbalance",
            value=n,
        )
    if not separable(unbalance):
        raise DataError(
            "the known unbalances never changed the planes apart; add a trial weight in one plane alone",
            argument="unbalance",
        )
    leverage = np.linalg.inv((regressors / scale).conj().T @ (regressors / scale)) / np.outer(scale, scale)
    solution = leverage @ (regressors.conj().T @ vectors)
    return Influence(
        solution[:q].T, solution[q], _covariance(vectors - regressors @ solution, n - q - 1), leverage, n - q - 1
    )


def fit_amplitudes(vectors: np.ndarray, unbalance: np.ndarray) -> Influence:
    """Influence of `unbalance` (n, q) [kg m], in one plane at a time, on amplitudes (n, m) [m] without phases.

    Coefficients and base are turned so that the base is real: the weights that follow are those of the rotor.

    Raises
    ------
    DataError
        Where a run has trial weights in several planes, a plane has fewer than three at different angles, there is no
        run without, or the amplitudes contradict each other.

    Examples
    --------
    >>> import rotorsim as rs
    >>> unbalance = 1e-5 * np.array([0, 1, np.exp(2j), np.exp(4j)])[:, None]
    >>> found = rs.balance.fit_amplitudes(abs(1e-6 + 0.1j * unbalance), unbalance)
    >>> float(found.coefficients[0, 0].imag.round(6))
    0.1
    """
    from scipy.optimize import least_squares

    n, q = unbalance.shape
    if not np.isfinite(vectors).all():
        raise DataError("a condition with a known unbalance was not measured at every speed; leave it out")
    if ((unbalance != 0).sum(axis=1) > 1).any():
        raise DataError(
            "amplitudes without phase: a run has trial weights in several planes; put them in one plane at a time",
            argument="unbalance",
        )
    size = np.abs(unbalance).max() or 1.0
    scaled = unbalance / size
    parts = [np.column_stack([np.abs(u) ** 2, 2 * u.real, -2 * u.imag]) for u in scaled.T]
    regressors = np.column_stack([np.ones(n), *parts])
    for k, part in enumerate(parts):
        own = np.column_stack([np.ones(n), part])[(scaled[:, k] != 0) | (scaled == 0).all(axis=1)]
        if not (scaled == 0).all(axis=1).any() or np.linalg.matrix_rank(own, tol=1e-6) < 4:
            raise DataError(
                f"amplitudes without phase: plane {k + 1} has {np.count_nonzero(scaled[:, k])} trial weights; one run "
                "without weight and three with one at different angles are needed, as fewer leave two answers",
                argument="unbalance",
                value=int(np.count_nonzero(scaled[:, k])),
            )
    coefficients, base = np.zeros((vectors.shape[1], q), complex), np.zeros(vectors.shape[1], complex)
    for m, a in enumerate(np.abs(vectors).T):
        unit = a.max() or 1.0
        start = np.linalg.lstsq(regressors, (a / unit) ** 2, rcond=None)[0]
        first = max(start[0], 1e-12) ** 0.5
        guess = np.concatenate([[first], np.delete(start, [0, *range(1, 3 * q + 1, 3)]) / first])

        def left(x: np.ndarray, a: np.ndarray = a / unit) -> np.ndarray:
            return np.asarray(np.abs(x[0] + scaled @ (x[1::2] + 1j * x[2::2])) - a)

        fit = least_squares(left, guess, x_scale="jac")
        worst = float(np.abs(fit.fun).max())
        if worst > CONTRADICTION:
            raise DataError(
                f"amplitudes without phase: no unbalance gives them; the nearest misses by {100 * worst:.2g} % of the "
                f"largest, at most {100 * CONTRADICTION:g} % are believed; measure again",
                argument="vectors",
                value=worst,
            )
        x = fit.x * unit
        base[m], coefficients[m] = abs(x[0]), (x[1::2] + 1j * x[2::2]) * np.sign(x[0]) / size
    return Influence(coefficients, base, np.eye(len(base), dtype=complex), np.zeros((q + 1, q + 1)), 0)


def changes(found: Influence, unbalance: np.ndarray) -> np.ndarray:
    """Change of the vectors by the heaviest trial weight of each plane (q,), as a share of those without it (rms)."""
    size = np.linalg.norm(found.coefficients, axis=0) * np.abs(unbalance).max(axis=0)
    return np.asarray(size / max(float(np.linalg.norm(found.base)), np.finfo(float).tiny))


def _check_changes(found: Influence, unbalance: np.ndarray, planes: tuple[Plane, ...]) -> None:
    """Refuse a trial weight that changed nothing: its coefficients are noise, and so are the weights after them."""
    noise = float(np.sqrt(np.trace(found.covariance).real)) if found.freedom else np.inf
    for share, plane, u in zip(changes(found, unbalance), planes, unbalance.T, strict=True):
        if share < LEAST_CHANGE and share * float(np.linalg.norm(found.base)) < CLEAR * noise:
            weight = float(np.abs(u).max()) * G_MM
            raise DataError(
                f"{plane.name}: the trial weight of {weight:.4g} g mm changed the vectors by {100 * share:.2g} %, at "
                f"least {100 * LEAST_CHANGE:g} % are needed; take a heavier one or check that it was mounted",
                argument="unbalance",
                value=share,
            )


def _check_correction(found: Influence, unbalance: np.ndarray, planes: tuple[Plane, ...], fix: Correction) -> None:
    """Refuse a correction many times the trial weight: an error of the small change is that many times as large."""
    noise = float(np.sqrt(np.trace(found.covariance).real)) if found.freedom else np.inf
    change = changes(found, unbalance) * float(np.linalg.norm(found.base))
    for plane, u, wanted, moved in zip(planes, unbalance.T, fix.wanted, change, strict=True):
        trial = float(np.abs(u).max())
        times = float(abs(wanted)) / max(trial, np.finfo(float).tiny)
        if times > MOST_WEIGHTS and moved < MOST_WEIGHTS * noise:
            raise DataError(
                f"{plane.name}: the correction of {abs(wanted) * G_MM:.4g} g mm is {times:.3g} times the trial weight "
                f"of {trial * G_MM:.4g} g mm, at most {MOST_WEIGHTS:g} times are corrected by one run: take a heavier "
                "trial weight, or repeat the runs so that their scatter shows",
                argument="unbalance",
                value=times,
            )


def separable(unbalance: np.ndarray) -> bool:
    """Whether the known unbalances (n, q) [kg m] changed every plane, and none only together with others."""
    n, q = unbalance.shape
    scaled = np.column_stack([unbalance / (np.abs(unbalance).max() or 1.0), np.ones(n)])
    return bool(np.linalg.matrix_rank(scaled, tol=1e-6 * np.sqrt(n)) == q + 1)


def testable(unbalance: np.ndarray) -> bool:
    """Whether each known unbalance of (n, q) can be left out: the others tell the planes apart and their errors."""
    n, q = unbalance.shape
    return n >= q + 3 and all(separable(np.delete(unbalance, i, axis=0)) for i in range(n))


def influence_of(coefficients: np.ndarray, vectors: np.ndarray, unbalance: np.ndarray) -> Influence:
    """Influence with given coefficients (m, q): base and errors from `vectors` (n, m) with `unbalance` (n, q)."""
    n = len(vectors)
    left = vectors - unbalance @ coefficients.T
    base = left.mean(axis=0)
    leverage = np.zeros((coefficients.shape[1] + 1,) * 2)
    leverage[-1, -1] = 1.0 / n
    freedom = n - 1 if n > 2 else 0  # two conditions are met exactly by a factor and a base
    return Influence(coefficients, base, _covariance(left - base, freedom), leverage, freedom)


def _covariance(left: np.ndarray, freedom: int) -> np.ndarray:
    """Covariance (m, m) of residuals (n, m), its correlations shrunk by what `freedom` cannot tell."""
    if freedom < 1:
        return np.eye(left.shape[1], dtype=complex)
    plain = (left.conj().T @ left).T / freedom
    size = np.sqrt(np.diag(plain).real)
    size = np.maximum(size, NOISELESS * size.max() or np.finfo(float).tiny ** 0.5)
    correlation = plain / np.outer(size, size)
    apart = ~np.eye(len(size), dtype=bool)
    strength = np.abs(correlation[apart]) ** 2
    shrink = min(1.0, float(((1 - strength) ** 2).sum() / freedom / max(strength.sum(), 1e-300)))
    correlation = np.where(apart, (1 - shrink) * correlation, 1.0)
    return np.asarray(correlation * np.outer(size, size))


def estimate(found: Influence, vectors: np.ndarray) -> Estimate:
    """Unbalance of a condition from its vectors (m,), NaN where it was not measured.

    Raises DataError if fewer vectors are there than planes.

    Examples
    --------
    >>> import rotorsim as rs
    >>> known = conditions.known
    >>> found = rs.balance.fit_influence(conditions.flat[known], conditions.unbalance[known])
    >>> rs.balance.estimate(found, conditions.flat[-1]).unbalance.shape
    (1,)
    """
    there = np.isfinite(vectors)
    H, S = found.coefficients[there], found.covariance[np.ix_(there, there)]
    m, q = H.shape
    if m < q:
        raise DataError(f"{m} vectors cannot tell {q} planes apart", argument="vectors", value=m)
    weighted = np.linalg.solve(S, H)
    covariance = np.linalg.inv(H.conj().T @ weighted)
    unbalance = covariance @ (weighted.conj().T @ (vectors[there] - found.base[there]))
    if found.freedom < 1:
        return Estimate(unbalance, np.full((q, q), np.nan), 0, np.nan)
    rest = vectors[there] - found.base[there] - H @ unbalance
    left = float((rest.conj() @ np.linalg.solve(S, rest)).real / max(m - q, 1))
    # what m readings took from the covariance's degrees of freedom, and the coefficients' own errors
    freedom = max(found.freedom - m + q, 1)
    at = np.append(unbalance, 1.0)
    unusual = left / float(stats.f.ppf(USUAL, 2 * max(m - q, 1), 2 * found.freedom))
    wider = (1.0 + float((at @ found.leverage @ at.conj()).real)) * max(unusual, 1.0)
    return Estimate(unbalance, covariance * wider * found.freedom / freedom, freedom, left)


Fit = Callable[[np.ndarray, np.ndarray], Influence]


def leave_one_out(conditions: Conditions, fit: Fit = fit_influence) -> LeftOut:
    """Each condition with a label estimated from the others.

    `fit` makes an Influence of vectors (n, m) and unbalances (n, q).

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.balance.leave_one_out(conditions).labels
    ('a', 'b', 'c', 'd', 'e', 'f')
    """
    known = np.flatnonzero(conditions.known)
    vectors, truth = conditions.flat[known], conditions.unbalance[known]
    estimates, inside, doubtful = np.zeros_like(truth), np.zeros(truth.shape, bool), []
    for i, at in enumerate(known):
        others = np.arange(len(known)) != i
        one = estimate(fit(vectors[others], truth[others]), vectors[i])
        estimates[i], inside[i] = one.unbalance, one.inside(truth[i])
        away = one.unbalance - truth[i]
        distance = float((away.conj() @ np.linalg.solve(one.covariance, away)).real) / len(away)
        if stats.f.sf(distance, 2 * len(away), 2 * one.freedom) * len(known) < DOUBT:
            doubtful.append(conditions.labels[at])
    return LeftOut(tuple(conditions.labels[k] for k in known), truth, estimates, inside, tuple(doubtful))


def model_influence(machine: Machine, conditions: Conditions) -> np.ndarray:
    """Complex influence (speeds x readings, planes) [m/(kg m)] of the machine on linear bearings along each probe.

    A probe without an angle sees x, which its complex factor turns where the bearings are the same in x and y. Raises
    DataError for a position that is missing or not on the shaft, and for a gas film.
    """
    if machine.film is not None:
        raise DataError(f"{machine.name}: a balancing model needs linear bearings; this machine has a gas film")
    mesh = Mesh(machine)
    speed = np.nanmedian(conditions.speed, axis=0)
    columns = []
    for plane in conditions.planes:
        whirl = run_unbalance_response(mesh.rotor, _node(mesh, plane), 1.0, 0.0, speed)
        at = np.array([4 * _node(mesh, r) for r in conditions.readings])
        along = np.array([r.angle or 0.0 for r in conditions.readings])[:, None]
        seen = np.cos(along) * whirl.response[at] + np.sin(along) * whirl.response[at + 1]
        columns.append(seen.T.ravel())
    return np.stack(columns, axis=1)


def without_model(machine: Machine, conditions: Conditions) -> str:
    """Why a machine's model cannot serve these records; empty where it can."""
    if machine.film is not None:
        return f"{machine.name} has a gas film, and a balancing model needs linear bearings"
    bare = [plane.name for plane in conditions.planes if plane.position is None]
    bare += [reading.name for reading in conditions.readings if reading.position is None]
    return f"the mapping gives no position of {listing(bare)}" if bare else ""


def _too_few(conditions: Conditions) -> str:
    """Why so few conditions do not judge a machine's model: none of them can be left out."""
    needed = len(conditions.planes) + 3
    return (
        f"{int(conditions.known.sum())} conditions with known unbalance cannot be left out one by one to compare it "
        f"with the influence coefficients; give at least {needed}, each plane changed in two or more"
    )


def _node(mesh: Mesh, part: Plane | Reading) -> int:
    name, position = part.name, part.position
    if position is None:
        raise DataError(f"{name}: the mapping gives no position; the physical model needs one")
    shaft = mesh.machine.shaft
    if not shaft.start - 1e-9 <= position <= shaft.end + 1e-9:
        raise DataError(f"{name}: {1e3 * position:g} mm is not on the shaft")
    return mesh.node(position)


def fit_physical(machine: Machine, conditions: Conditions) -> Fit:
    """Fit of an Influence that keeps the machine's shape: a complex factor a probe, and the first vector of each.

    Examples
    --------
    >>> import rotorsim as rs
    >>> fit = rs.balance.fit_physical(rs.load_machine("plain_rotor"), conditions)
    >>> known = conditions.known
    >>> fit(conditions.flat[known], conditions.unbalance[known]).coefficients.shape
    (2, 1)
    """
    return partial(_fit, model_influence(machine, conditions), len(conditions.readings))


def _fit(model: np.ndarray, readings: int, vectors: np.ndarray, unbalance: np.ndarray) -> Influence:
    free = fit_influence(vectors, unbalance)
    predicted = unbalance @ model.T
    weight = 1.0 / np.diag(free.covariance).real  # all the same without freedom
    factors = np.zeros(readings, dtype=complex)
    away = predicted - predicted.mean(axis=0)
    measured = vectors - vectors.mean(axis=0)
    for k in range(readings):
        same = slice(k, None, readings)
        a, b = away[:, same], measured[:, same]
        factors[k] = (weight[same] * a.conj() * b).sum() / (weight[same] * np.abs(a) ** 2).sum()
    coefficients = model * np.tile(factors, model.shape[0] // readings)[:, None]
    return influence_of(coefficients, vectors, unbalance)


@dataclass(frozen=True, eq=False)
class Correction:
    """Weights and what they leave.

    Attributes
    ----------
    wanted : complex unbalance to add in each plane (q,) [kg m]
    weights : for each plane the angle [rad] and mass [kg] of its weights; without a radius none
    given : complex unbalance of these weights (q,), `wanted` where there are none [kg m]
    before, after : 1X vectors (m,) [m 0-pk], the second predicted
    """

    wanted: np.ndarray
    weights: tuple[tuple[tuple[float, float], ...], ...]
    given: np.ndarray
    before: np.ndarray
    after: np.ndarray


def correction(found: Influence, vectors: np.ndarray, planes: tuple[Plane, ...]) -> Correction:
    """Weights against `vectors` (m,) [m], NaN where not measured, weighted by the errors of the coefficients.

    A weight goes into the two holes on either side of its angle, or anywhere on the radius without a number of holes.
    Raises DataError if fewer vectors are there than planes.

    Examples
    --------
    >>> import rotorsim as rs
    >>> unbalance = 1e-5 * np.arange(6)[:, None] + 0j
    >>> found = rs.balance.fit_influence(1e-6 + 0.1 * unbalance, unbalance)
    >>> disc = rs.balance.Plane("disc", radius=0.03, holes=16)
    >>> weights = rs.balance.correction(found, np.array([1e-6 + 0j]), (disc,)).weights
    >>> [round(mass * 1e6) for angle, mass in weights[0]]  # mg
    [333]
    """
    there = np.isfinite(vectors)
    H = found.coefficients[there]
    if H.shape[0] < H.shape[1]:
        raise DataError(f"{H.shape[0]} vectors cannot be balanced in {H.shape[1]} planes")
    wanted = -np.linalg.lstsq(H, vectors[there], rcond=None)[0]
    weights = tuple(in_holes(u, plane) for u, plane in zip(wanted, planes, strict=True))
    given = np.array([
        sum(m * (p.radius or 0.0) * np.exp(1j * a) for a, m in ws) if ws else u
        for u, p, ws in zip(wanted, planes, weights, strict=True)
    ])  # fmt: skip
    return Correction(wanted, weights, given, vectors, vectors + found.coefficients @ given)


def in_holes(unbalance: complex, plane: Plane) -> tuple[tuple[float, float], ...]:
    """Angle [rad] and mass [kg] of the weights that make an unbalance [kg m] in a plane; none without its radius."""
    if not plane.radius:
        return ()
    mass, angle = abs(unbalance) / plane.radius, float(np.angle(unbalance)) % (2 * pi)
    if not plane.holes:
        return ((angle, mass),)
    step = 2 * pi / plane.holes
    first = int(angle // step)
    share = np.array([np.sin((first + 1) * step - angle), np.sin(angle - first * step)]) / np.sin(step)
    return tuple(((first + k) % plane.holes * step, float(mass * share[k])) for k in range(2) if share[k] > 1e-9)


@dataclass(frozen=True, eq=False)
class Assessment:
    """Unbalance from 1X vectors.

    Attributes
    ----------
    conditions : the records
    tests : by method how well it gives each known unbalance from the others; empty where these are too few to leave
        one out
    method : the method of the smaller error, by which the estimates are; without tests the influence coefficients
    estimates : by record without known unbalance its unbalance [kg m] and standard deviation
    corrected : record that the weights are against; empty without one
    correction : weights, None without such a record
    changes : of the vectors by the heaviest trial weight of each plane, as a share of those without it (q,)
    left_out : why the physical model was not used; empty where it was
    """

    conditions: Conditions
    tests: dict[str, LeftOut]
    method: str
    estimates: dict[str, Estimate]
    corrected: str
    correction: Correction | None
    changes: np.ndarray
    left_out: str = ""


def assess(machine: Machine | str | Path, conditions: Conditions, correct: str = "") -> Assessment:
    """Estimate unbalance by influence coefficients and by the machine's model, side by side, and correct it.

    Parameters
    ----------
    machine : Machine, name or path
    conditions : Conditions
        1X vectors [m 0-pk] and known unbalances [kg m], see `read_conditions`.
    correct : str
        Record to balance; by default the first without added unbalance.

    Raises
    ------
    DataError
        If no record has a known unbalance, or no record has the name.

    Examples
    --------
    >>> import rotorsim as rs
    >>> conditions = rs.balance.read_conditions(["open.csv"], "balance.toml")
    >>> rs.balance.assess("bently_rk4", conditions).method
    'influence coefficients'
    """
    model = machine if isinstance(machine, Machine) else load_machine(machine)
    known = conditions.known
    if not known.any():
        raise DataError("no condition has a known unbalance; add a trial weight in each plane and label it")
    labelled = conditions.flat[known], conditions.unbalance[known]
    if not all(reading.phased for reading in conditions.readings):
        return _assess_amplitudes(conditions, labelled, correct)
    free: Fit = fit_influence
    enough = testable(conditions.unbalance[known])
    left_out = without_model(model, conditions) or ("" if enough else _too_few(conditions))
    methods = {METHODS[0]: free} if left_out else {METHODS[0]: free, METHODS[1]: fit_physical(model, conditions)}
    fits = {name: fit(*labelled) for name, fit in methods.items()}
    tests = {name: leave_one_out(conditions, fit) for name, fit in methods.items()} if enough else {}
    _check_changes(fits[METHODS[0]], conditions.unbalance[known], conditions.planes)
    best = min(tests, key=lambda name: tests[name].vector_rms, default=METHODS[0])
    label, weights = _correction(conditions, fits[best], correct)
    if weights is not None:
        _check_correction(fits[METHODS[0]], conditions.unbalance[known], conditions.planes, weights)
    found = {c: estimate(fits[best], conditions.flat[k]) for k, c in enumerate(conditions.labels) if not known[k]}
    changed = changes(fits[METHODS[0]], conditions.unbalance[known])
    return Assessment(conditions, tests, best, found, label, weights, changed, left_out)


def _assess_amplitudes(conditions: Conditions, labelled: tuple[np.ndarray, np.ndarray], correct: str) -> Assessment:
    """Correction weights by amplitudes alone; conditions without a label and the model need phases."""
    found = fit_amplitudes(*labelled)
    _check_changes(found, labelled[1], conditions.planes)
    turned = np.where(conditions.known[:, None], found.base + conditions.unbalance @ found.coefficients.T, np.nan)
    label, weights = _correction(replace(conditions, vectors=turned.reshape(conditions.vectors.shape)), found, correct)
    if weights is not None:
        _check_correction(found, labelled[1], conditions.planes, weights)
    changed = changes(found, labelled[1])
    return Assessment(conditions, {}, METHODS[2], {}, label, weights, changed, "the readings have no phases")


def _correction(conditions: Conditions, found: Influence, wanted: str) -> tuple[str, Correction | None]:
    """Condition to balance and its weights; empty and None if there is no condition without added unbalance."""
    if wanted and wanted not in conditions.labels:
        raise DataError(f"correct: no condition {quote(wanted)}; there are {listing(conditions.labels)}")
    bare = [c for c, u in zip(conditions.labels, conditions.unbalance, strict=True) if (u == 0).all()]
    label = wanted or (bare[0] if bare else "")
    if not label:
        return "", None
    vectors = conditions.flat[conditions.labels.index(label)]
    return label, correction(found, vectors, conditions.planes)


def result_rows(found: Assessment) -> list[tuple[str, str]]:
    """Rows (what, result) of a readable table."""
    conditions, tests, fix = found.conditions, found.tests, found.correction
    rows = [("Conditions", f"{int(conditions.known.sum())} with known unbalance, {len(found.estimates)} without")]
    for name, test in tests.items():
        rows.append((
            name.capitalize(),
            f"every label from the others: vector error {test.vector_rms * G_MM:.2f} g mm rms a plane, magnitude "
            f"{test.magnitude_error * G_MM:.2f} g mm; 90 % regions hold {100 * test.content:.0f} %",
        ))  # fmt: skip
    if tests:
        doubtful = tests[found.method].contradicts
        rows.append(("Labels that the others contradict", ", ".join(doubtful) or "none"))
    else:
        rows.append(("Errors", "not known: too few records with known unbalance to leave one out"))
    shares = zip(conditions.planes, found.changes, strict=True)
    text = ", ".join(f"{plane.name} {100 * share:.3g} %" for plane, share in shares)
    rows.append(("Change of the vectors by the heaviest trial weight", text))
    if found.left_out:
        rows.append(("Physical model", f"left out: {found.left_out}"))
    rows.append(("Estimates by", found.method))
    if fix is not None:
        for plane, wanted, parts in zip(conditions.planes, fix.wanted, fix.weights, strict=True):
            holes = ", ".join(f"{m * 1e3:.2f} g at {np.rad2deg(a):.0f} deg" for a, m in parts)
            against = f"{abs(wanted) * G_MM:.2f} g mm at {np.rad2deg(np.angle(wanted)) % 360:.0f} deg"
            rows.append((f"Against {found.corrected}, {plane.name}", against + (f": {holes}" if holes else "")))
        before, after = (float(np.nanmax(np.abs(v))) * TO_UM for v in (fix.before, fix.after))
        rows.append(("Largest 1X vector", f"{before:.2f} µm 0-pk, {after:.2f} µm 0-pk predicted after"))
    return rows


def summary(found: Assessment) -> dict[str, Any]:
    """The results as plain numbers, unbalances in g mm."""
    fix = found.correction
    return {
        "methods": {
            name: {"vector_rms_gmm": t.vector_rms * G_MM, "magnitude_error_gmm": t.magnitude_error * G_MM,
                   "share_in_90_percent_regions": t.content, "contradicted_labels": list(t.contradicts)}
            for name, t in found.tests.items()
        },
        "estimates_by": found.method,
        "physical_model_left_out": found.left_out,
        "changes_by_trial_weights": [float(share) for share in found.changes],
        "unbalance": {c: [_numbers(u, s) for u, s in zip(e.unbalance, e.deviation, strict=True)]
                      for c, e in found.estimates.items()},
        "correction": None if fix is None else {
            "condition": found.corrected,
            "wanted": [_numbers(u, None) for u in fix.wanted],
            "weights": [[{"deg": float(np.rad2deg(a)), "g": m * 1e3} for a, m in w] for w in fix.weights],
        },
    }  # fmt: skip


def _numbers(value: complex, deviation: float | None) -> dict[str, Any]:
    numbers = {"gmm": abs(value) * G_MM, "deg": float(np.rad2deg(np.angle(value)) % 360)}
    return numbers if deviation is None else numbers | {"sd_gmm": deviation * G_MM if isfinite(deviation) else None}


def estimate_table(found: Assessment) -> tuple[list[str], list[tuple[str, ...]]]:
    """Heads and rows of the unknown unbalances, with the standard deviation of either component, readable."""
    units = ("[g mm]", "at [deg]", "sd [g mm]")
    heads = ["record", *(f"{plane.name} {unit}" for plane in found.conditions.planes for unit in units)]
    rows = []
    for label, one in found.estimates.items():
        numbers = [_numbers(u, float(s)) for u, s in zip(one.unbalance, one.deviation, strict=True)]
        rows.append((label, *("" if n[key] is None else f"{n[key]:{form}}" for n in numbers for key, form in
                              (("gmm", ".2f"), ("deg", ".0f"), ("sd_gmm", ".2f")))))  # fmt: skip
    return heads, rows


def unbalance_csv(found: Assessment) -> str:
    """CSV of the unknown unbalances; sd_gmm is the standard deviation of either component in the worse plane."""
    planes = range(1, len(found.conditions.planes) + 1)
    lines = [",".join(["id", *(f"U{k}_{unit}" for k in planes for unit in ("gmm", "deg")), "sd_gmm"])]
    for label, one in found.estimates.items():
        numbers = [f"{n[key]:.3f}" for u in one.unbalance for n in (_numbers(u, None),) for key in ("gmm", "deg")]
        worst = float(one.deviation.max()) * G_MM
        lines.append(",".join([label, *numbers, f"{worst:.3f}" if isfinite(worst) else ""]))
    return "\n".join(lines) + "\n"

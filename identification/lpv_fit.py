r"""`fit_lpv`: surfaces from local models, polynomial order by hold-out, refinement.

Black-box models of neighbouring operating points need a common state basis (SMILE, De Caigny et al. 2011).

.. math:: T_i = O_i^+ O_{ref}, \qquad A_i' = T_i^{-1} A_i T_i,\; B_i' = T_i^{-1} B_i,\; C_i' = C_i T_i

with observability matrices O over as many samples as there are states. The thesis left this way (section 2.5): elements
of such matrices amplify the error of each local model, and surfaces through them miss the local behaviour.

Surfaces are refined by their frequency responses against those of the local models (thesis, section 4.1).

.. math:: \min_c \sum_j \sum_\omega \| G(\theta(q_j; c), j\omega) - G_j(j\omega) \|_F^2 / \overline{\|G_j\|_F^2}

by Gauss and Newton with damping from the plain surfaces, or by the output error over all records at once.

.. math:: \min_{c, x_{0j}} \sum_j \sum_k \| y_{jk} - \hat y_{jk}(\theta(q_j; c), x_{0j}) \|^2 / \|y_j\|^2

Each record's normal equations for its own parameters, initial state eliminated, are spread over the coefficients by the
basis functions at its operating point. One record is in memory at a time.

Cites: decaigny_2011, ljung_1999, thesis.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identification.local.blackbox import FullStateSpace
from identification.local.confidence import project
from identification.local.greybox import DELAYED, RATED, STRUCTURES, modes
from identification.local.least_squares import FitProblem, GreyBox, damped_step
from identification.local.models import LinearModel
from identification.local.response_fit import response_with_derivatives
from identification.local.result import Identification
from identification.local.structures import Structure
from identification.lpv_model import SAME, LpvModel, fit_surfaces, make_basis, rms
from identification.records.prefilter import Signals
from identification.records.schema import common
from rotorsim.base.errors import UnfitError
from rotorsim.base.processes import one_thread

ORDERS = (1, 2, 3)
"""Total degrees of the surfaces that a hold-out chooses among."""
STRIDE = 5
"""Samples between block rows of the observability matrices."""


def observability(model: LinearModel) -> np.ndarray:
    """C, C A^s, C A^2s ... (4 n blocks) of a sampled model."""
    power, blocks = np.linalg.matrix_power(model.A, STRIDE), [model.C]
    for _ in range(4 * model.order - 1):
        blocks.append(blocks[-1] @ power)
    return np.vstack(blocks)


def coherent_basis(models: Sequence[LinearModel]) -> list[LinearModel]:
    """The same sampled models, all in the basis that comes closest to that of the middle one.

    Examples
    --------
    >>> import rotorsim as rs
    >>> local = [lpv.at(speed, 0.5e6).discrete(2e-4) for speed in (200.0, 300.0, 400.0)]
    >>> len(rs.identification.coherent_basis(local))
    3
    """
    wanted = observability(models[len(models) // 2])
    found = []
    for model in models:
        T = np.linalg.lstsq(observability(model), wanted, rcond=None)[0]
        inverse = np.linalg.inv(T)
        found.append(replace(model, A=inverse @ model.A @ T, B=inverse @ model.B, C=model.C @ T))
    return found


LINES, ITERATIONS, SPAN = 60, 12, (0.05, 2.5)
"""Frequencies, most steps, and range of frequencies in units of the mean natural frequency."""


def response(structure: Structure, theta: np.ndarray, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """G (f, 2, 2) and its derivatives (f, 2, 2, q)."""
    return response_with_derivatives(structure.matrices(theta), structure.derivatives(theta), 1j * omega)


def frequencies(values: np.ndarray) -> np.ndarray:
    """Lines [rad/s] for parameters (k, q) of a structure with K and D in front."""
    middle = float(np.mean([modes(theta)[0] for theta in values]))
    return np.geomspace(SPAN[0] * middle, SPAN[1] * middle, LINES)


def distance(model: LpvModel, points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Relative distance (k,) of frequency responses of surfaces and local parameters (k, q) at points (k, 2).

    Examples
    --------
    >>> import rotorsim as rs
    >>> points = np.array([[300.0, 0.5e6]])
    >>> rs.identification.distance(lpv, points, np.array([lpv.theta(*points[0])])).tolist()
    [0.0]
    """
    structure, omega = STRUCTURES[model.kind], frequencies(values)
    found = []
    for q, theta in zip(points, values, strict=True):
        local, surface = (response(structure, t, omega)[0] for t in (theta, model.theta(*q)))
        found.append(np.linalg.norm(surface - local) / np.linalg.norm(local))
    return np.array(found)


def refine_frequency(model: LpvModel, points: np.ndarray, values: np.ndarray) -> LpvModel:
    """Refined surfaces; raises UnfitError for black-box models."""
    if model.kind == "blackbox":
        raise UnfitError("fit_lpv.refine: a black-box model has no structure to refine; take model 1, 2 or 3")
    structure, omega, basis = STRUCTURES[model.kind], frequencies(values), model.basis.at(points)
    local = [response(structure, theta, omega)[0] for theta in values]
    weights = [1 / np.linalg.norm(G) for G in local]

    def normal(c: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        N, g, cost = np.zeros((c.size, c.size)), np.zeros(c.size), 0.0
        for phi, G0, weight in zip(basis, local, weights, strict=True):
            G, dG = response(structure, c @ phi, omega)
            e, J = weight * (G0 - G).ravel(), weight * dG.reshape(-1, len(c))
            cost += float(np.sum(np.abs(e) ** 2))
            N += np.kron((J.conj().T @ J).real, np.outer(phi, phi))
            g += np.kron((J.conj().T @ e).real, phi)
        return N, g, cost

    return replace(model, coefficients=minimise(normal, model.coefficients, ITERATIONS), refined="frequency")


def minimise(normal, c: np.ndarray, iterations: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Coefficients (q, t) where normal(c) -> (N, g, cost) comes to rest, by Levenberg and Marquardt."""
    damping, (N, g, cost) = 1e-4, normal(c)
    for _ in range(iterations):
        step, promised = damped_step(N, g, damping)
        if promised < 1e-8 * cost:
            break
        trial = c + step.reshape(c.shape)
        found = normal(trial)
        if np.isfinite(found[2]) and found[2] < cost:
            c, (N, g, cost), damping = trial, found, damping / 10
        else:
            damping *= 20
    return c


GLOBAL_ITERATIONS = 6
"""Most steps of a refinement by the output error."""


def refine_global(model: LpvModel, signals: Sequence[Callable[[], Signals]]) -> LpvModel:
    """Refined surfaces of Model 1 or 3; `signals` are functions that return prefiltered records."""
    if model.kind not in ("1", "3", DELAYED):
        raise UnfitError(f"fit_lpv.refine: 'global' does not do model {model.kind}; take model 1 or 3, or 'frequency'")
    structure, states = STRUCTURES[model.kind], [np.zeros(0) for _ in signals]

    def normal(c: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        N, g, cost = np.zeros((c.size, c.size)), np.zeros(c.size), 0.0
        for j, load in enumerate(signals):
            one = load()
            phi = model.basis.at(np.array([[one.speed, one.pressure]]))[0]
            y = project(one.y, one.Q)
            problem = FitProblem(GreyBox(structure, one.Ts), np.ascontiguousarray(one.u), y, one.Q, breaks=one.breaks)
            states[j] = states[j] if len(states[j]) else np.zeros(problem.states(c @ phi))
            if not problem.usable(c @ phi):
                return N, g, np.inf
            own, slope, part = problem.normal_equations(c @ phi, states[j])
            q, weight = len(c), 1 / float(np.sum(y**2))
            link = own[:q, q:] @ np.linalg.inv(own[q:, q:])
            states[j] = states[j] + np.linalg.solve(own[q:, q:], slope[q:])
            N += weight * np.kron(own[:q, :q] - link @ own[q:, :q], np.outer(phi, phi))
            g += weight * np.kron(slope[:q] - link @ slope[q:], phi)
            cost += weight * part
        return N, g, cost

    return replace(model, coefficients=minimise(normal, model.coefficients, GLOBAL_ITERATIONS), refined="global")


REFINEMENTS = ("none", "frequency", "global")
LPV_KINDS = ("1", "2", RATED, "3", DELAYED, "blackbox")
"""Models that surfaces can be made of: a file of them names a structure that the package knows."""
BETTER = 0.95
"""A higher order is taken only if its hold-out error is below this share of the lower one's."""


@one_thread()
def fit_lpv(
    results: Sequence[Identification],
    order: int | str = 2,
    hold_out: Sequence[Identification] = (),
    refine: str = "none",
    signals: Sequence[Callable[[], Any]] = (),
) -> LpvModel:
    """Surfaces of the local parameters over speed and pressure.

    Parameters
    ----------
    results : sequence of Identification
        Local models of one kind; corners of the grid should be among them.
    order : 1, 2, 3 or 'hold-out'
        Total degree of the polynomials; 'hold-out' takes the one that predicts left-out points best.
    hold_out : sequence of Identification
        Points that are not fitted and only measure the surfaces; without them every third point that is not a corner is
        left out to measure, and the surfaces are then fitted through all.
    refine : 'none', 'frequency' or 'global'
        'frequency' then minimises the distance of frequency responses to the local models' (thesis, section 4.1),
        'global' the output error over all records at once.
    signals : sequence of functions
        For 'global': for each result one that returns its prefiltered `Signals`, called again at every iteration.

    Raises
    ------
    UnfitError
        If kinds differ, or points are too few for the order.

    Examples
    --------
    >>> import rotorsim as rs
    >>> lpv = rs.fit_lpv([rs.identify(one, model=3) for one in records], order=1)  # doctest: +SKIP
    """
    results = list(results)
    if not results:
        raise UnfitError("fit_lpv: 0 results; identify records at several operating points first")
    kinds = {(r.kind, r.model.order) for r in (*results, *hold_out)}
    if len(kinds) > 1 or results[0].kind not in LPV_KINDS:
        raise UnfitError(
            f"fit_lpv: models {sorted(kinds)}; give results of one kind, 1, 2, {RATED}, 3, {DELAYED} or blackbox of "
            "one order"
        )
    if refine not in REFINEMENTS:
        raise UnfitError(f"fit_lpv.refine: {refine!r}; choose of {', '.join(REFINEMENTS)}")
    points = np.array([(r.speed, r.pressure) for r in results])
    held = np.array([(r.speed, r.pressure) for r in hold_out]).reshape(-1, 2)
    values = _values([*results, *hold_out])
    values, others = values[: len(results)], values[len(results) :]
    degree = _best_order(points, values, held, others) if order == "hold-out" else order
    if not isinstance(degree, int):
        raise UnfitError(f"fit_lpv.order: {order!r}; choose 1, 2, 3 or 'hold-out'")
    model = _surfaces(results[0], points, values, degree)
    model = replace(
        model, rms_hold_out=_hold_out_error(points, values, held, others, degree),
        machine=common(r.model.machine for r in results),
    )  # fmt: skip
    if refine == "frequency":
        model = refine_frequency(model, points, values)
    elif refine == "global":
        if len(signals) != len(results):
            raise UnfitError(f"fit_lpv.signals: {len(signals)} for {len(results)} results; 'global' needs one for each")
        model = refine_global(model, signals)
    if refine != "none":
        at = [model.theta(*q) for q in points]
        model = replace(model, rms_identification=rms(np.array(at) - values))
    return model


def _values(results: Sequence[Identification]) -> np.ndarray:
    """Parameters (k, q) of all results, black-box models in one coherent basis."""
    if results[0].kind != "blackbox":
        return np.array([r.theta for r in results])
    n = results[0].model.order
    models = coherent_basis([r.model for r in results])
    return np.array([FullStateSpace(n, 2, 2).pack(m.A, m.B, m.C) for m in models])


def _surfaces(first: Identification, points: np.ndarray, values: np.ndarray, order: int) -> LpvModel:
    basis = make_basis(points, order)
    coefficients = fit_surfaces(basis, points, values)
    if first.kind in ("2", RATED):  # the actuators do not know the operating point
        coefficients[-6:] = 0
        coefficients[-6:, 0] = values[:, -6:].mean(axis=0)
    names = tuple(first.parameters) or tuple(f"theta_{i}" for i in range(values.shape[1]))
    errors = rms(basis.at(points) @ coefficients.T - values)
    states = first.model.order if first.kind == "blackbox" else 0
    unknown = np.full(len(names), np.nan)
    return LpvModel(
        first.kind, names, coefficients, basis, order, points, errors, unknown, Ts=first.model.Ts, states=states
    )


def _hold_out_error(
    points: np.ndarray, values: np.ndarray, held: np.ndarray, others: np.ndarray, order: int
) -> np.ndarray:
    """RMS (q,) of surfaces at points that they were not fitted to; NaN where there are too few points to leave out."""
    if not len(held):
        low, high = points.min(axis=0), points.max(axis=0)
        corner = ((np.abs(points - low) < SAME) | (np.abs(points - high) < SAME)).all(axis=1)
        left = np.flatnonzero(~corner)[1::3]
        kept = np.setdiff1d(np.arange(len(points)), left)
        points, held, values, others = points[kept], points[left], values[kept], values[left]
    if not len(held):
        return np.full(values.shape[1], np.nan)
    try:
        basis = make_basis(points, order)
    except UnfitError:
        return np.full(values.shape[1], np.nan)
    return rms(basis.at(held) @ fit_surfaces(basis, points, values).T - others)


def _best_order(points: np.ndarray, values: np.ndarray, held: np.ndarray, others: np.ndarray) -> int:
    """Lowest order that no higher one beats by 5 % of the hold-out error, averaged over the parameters."""
    spread = np.maximum(values.std(axis=0), 1e-300)
    errors = {order: float(np.mean(_hold_out_error(points, values, held, others, order) / spread)) for order in ORDERS}
    best, lowest = 0, np.inf
    for order, error in errors.items():
        if error < BETTER * lowest:
            best, lowest = order, error
    if not best:
        raise UnfitError(
            f"fit_lpv.order: {len(points)} points are too few for a hold-out; give the order, e.g. order=1"
        )
    return best

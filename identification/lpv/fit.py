"""`fit_lpv`: surfaces from local models, polynomial order by hold-out, refinement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identification.errors import UnfitError
from identification.local.blackbox import FullStateSpace
from identification.local.greybox import DELAYED, RATED
from identification.local.result import Identification
from identification.lpv.coherent import coherent_basis
from identification.lpv.model import LpvModel
from identification.lpv.refine_frequency import refine_frequency
from identification.lpv.refine_global import refine_global
from identification.lpv.surfaces import ORDERS, SAME, fit_surfaces, make_basis, rms
from identification.machine_name import common
from identification.threads import one_thread

REFINEMENTS = ("none", "frequency", "global")
LPV_KINDS = ("1", "2", RATED, "3", DELAYED, "blackbox")
"""Models that surfaces can be made of: a file of them names a structure that the package knows."""
BETTER = 0.95
"""A higher order is taken only if its hold-out error is below this share of the lower one's."""


@one_thread
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


def inner_points(points: np.ndarray) -> np.ndarray:
    """Indices of every third point that is not at a corner of the range."""
    low, high = points.min(axis=0), points.max(axis=0)
    edge = (np.abs(points - low) < SAME) | (np.abs(points - high) < SAME)
    return np.flatnonzero(~edge.all(axis=1))[1::3]


def _hold_out_error(
    points: np.ndarray, values: np.ndarray, held: np.ndarray, others: np.ndarray, order: int
) -> np.ndarray:
    """RMS (q,) of surfaces at points that they were not fitted to; NaN where there are too few points to leave out."""
    if not len(held):
        left = inner_points(points)
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

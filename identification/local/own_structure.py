"""Fit of a user's own structure: checks of its function, its start and its bounds, and of the fit's end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from identification.errors import ModelError, UnfitError
from identification.local.confidence import indistinguishable, propagate, sandwich, without_nuisance
from identification.local.greybox import Matrices, Structure
from identification.local.least_squares import FitProblem, Minimum, scores_of
from identification.local.models import LinearModel
from rotorsim.base.rounding import unstable_poles

TAKEN = ("1", "2", "3", "actuator", "blackbox")
SIZES = {"A": ("n", "n"), "B": ("n", "2"), "C": ("2", "n"), "D": ("2", "2")}


def prepared(structure: Structure, start: Any = None) -> tuple[Structure, np.ndarray]:
    """The structure with a function that is checked at each call, and where a fit of it begins (q,).

    Raises
    ------
    ModelError
        If the function fails, or its matrices have wrong shapes, complex numbers or NaN at the start.
    UnfitError
        If there is no start, or it has a wrong length, NaN, lies outside the bounds or is unstable.
    """
    if structure.name in TAKEN:
        raise UnfitError(f"{structure}: a model of the package has this name; choose another")
    if start is None and not structure.start:
        raise UnfitError(f"{structure}: has no start; give start=, one value for each of its parameters")
    theta = _numbers(structure, structure.start if start is None else start)
    if theta.shape != (len(structure.parameters),):
        raise UnfitError(
            f"{structure}.start: {theta.size} values; give one for each of {', '.join(structure.parameters)}"
        )
    made = replace(structure, matrices=checked(structure), start=tuple(theta))
    for name, value, low, high in zip(made.parameters, theta, made.low, made.high, strict=True):
        if not low <= value <= high:
            raise UnfitError(f"{structure}.start: {name} = {value:g} is not within {low:g} to {high:g}; start inside")
    if not made.admissible(theta):
        raise UnfitError(f"{structure}.start: {', '.join(made.positive)} must be above zero; start there")
    matrices = made.matrices(theta)
    for name, matrix in zip("ABCD", matrices, strict=True):
        if not np.all(np.isfinite(matrix)):
            raise ModelError(
                f"{structure}.matrices: {name} has NaN or infinite values at the start; correct the function"
            )
    if unstable_poles(matrices[0]):
        raise UnfitError(f"{structure}.start: the model is unstable there; start from a stable one")
    return made, theta


def _numbers(structure: Structure, start: Any) -> np.ndarray:
    """A start as an array; raises UnfitError for what are no numbers."""
    try:
        return np.asarray(start, float).ravel()
    except (TypeError, ValueError) as error:
        raise UnfitError(f"{structure}.start: {start!r}; give a number for each parameter") from error


def checked(structure: Structure) -> Callable[[np.ndarray], Matrices]:
    """The structure's function, whose matrices are real and of the right shapes or refused in a sentence."""
    own = structure.matrices

    def matrices(theta: np.ndarray) -> Matrices:
        values = ", ".join(f"{name} = {v:.6g}" for name, v in zip(structure.parameters, theta, strict=True))
        try:
            found = own(theta.copy())
        except Exception as error:
            raise ModelError(
                f"{structure}.matrices: {type(error).__name__}: {error}, at {values}; correct it"
            ) from error
        return _shaped(structure, found, values)

    return matrices


def _shaped(structure: Structure, found: Any, values: str) -> Matrices:
    """A, B, C, D as arrays of floats."""
    try:
        A, B, C, D = (_real(one) for one in found)
    except (TypeError, ValueError) as error:
        raise ModelError(
            f"{structure}.matrices: returns no four real matrices A, B, C, D ({error}), at {values}; return these"
        ) from error
    n = len(A) if A.ndim else 0
    for (name, sizes), matrix in zip(SIZES.items(), (A, B, C, D), strict=True):
        wanted = tuple(n if size == "n" else int(size) for size in sizes)
        if matrix.shape != wanted or not n:
            text = ", ".join(sizes)
            raise ModelError(
                f"{structure}.matrices: {name} has the shape {matrix.shape}, expected ({text}) with n states"
            )
    return A, B, C, D


def _real(value: Any) -> np.ndarray:
    """A matrix of floats; raises TypeError for complex numbers, which numpy would only cut."""
    if np.iscomplexobj(value):
        raise TypeError("complex numbers")
    return np.array(value, float)


def box(structure: Structure) -> tuple[np.ndarray, np.ndarray] | None:
    """Bounds of the parameters; None where there are none at all."""
    return (structure.low, structure.high) if structure.bounds else None


def covariance_of(structure: Structure, problem: FitProblem, fitted: Minimum, Ts: float) -> np.ndarray:
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


def sizes(structure: Structure, theta: np.ndarray) -> np.ndarray:
    """Sizes (q,) of the parameters; 0, for unknown, where one started at zero: it may be small without being idle."""
    start = np.asarray(structure.start)
    return np.where(start != 0, np.maximum(np.abs(theta), np.abs(start)), 0.0)


def refuse_indistinguishable(structure: Structure, J: np.ndarray, free: np.ndarray) -> None:
    """Raise UnfitError if directions of the free parameters leave the response as it is; J (samples, free)."""
    names = [name for name, one in zip(structure.parameters, free, strict=True) if one]
    if texts := indistinguishable(J, names):
        raise UnfitError(
            f"{structure}: not identifiable: {'; '.join(texts)}; make one of each constant in the matrices, or excite "
            "what distinguishes them"
        )


def bound_remarks(structure: Structure, theta: np.ndarray) -> tuple[str, ...]:
    """A sentence for each parameter that ended at a bound."""
    low, high = structure.at_bounds(theta)
    return tuple(
        f"{name} ended at its {'lower' if at_low else 'upper'} bound {value:g}: it has no standard deviation, and "
        "those of the others hold for this value"
        for name, value, at_low, at_high in zip(structure.parameters, theta, low, high, strict=True)
        if at_low or at_high
    )


def valued(structure: Structure, theta: np.ndarray, covariance: np.ndarray) -> dict[str, tuple[float, float]]:
    """Parameters by name as (value, sd); sd is NaN at a bound."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0))
    sd = np.where(np.any(structure.at_bounds(theta), axis=0), np.nan, sd)
    return {name: (float(v), float(s)) for name, v, s in zip(structure.parameters, theta, sd, strict=True)}


def properties(
    model_of: Callable[[np.ndarray], LinearModel], theta: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """wn [rad/s], zeta (k,), their standard deviations, static gain (2, 2) and its standard deviations."""
    first = model_of(theta)
    k = len(first.wn)

    def all_of(values: np.ndarray) -> np.ndarray:
        model = model_of(values)
        same = model if len(model.wn) == k else first
        return np.concatenate([same.wn, same.zeta, gain_of(model).ravel()])

    spread = propagate(all_of, theta, covariance)
    return first.wn, first.zeta, spread[:k], spread[k : 2 * k], gain_of(first), spread[2 * k :].reshape(2, 2)


def gain_of(model: LinearModel) -> np.ndarray:
    """Static gain (2, 2), NaN where the model integrates."""
    try:
        return model.static_gain
    except np.linalg.LinAlgError:
        return np.full((2, 2), np.nan)

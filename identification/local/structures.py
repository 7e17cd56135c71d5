r"""Structures with named parameters: the class that the thesis' models and your own are instances of, and its checks.

A structure makes the matrices A, B, C, D of continuous time from its parameters theta. Where A and B are affine in each
parameter alone, C and D constant, the difference of two values is the exact derivative; else it is that of the
polynomial through five values, which lie within the parameter's bounds:

.. math:: f'(\theta) \approx \sum_{i=1}^{5} w_i f(\theta + o_i h), \qquad
          \sum_i w_i o_i^k = \delta_{1k}, \; k = 0 \ldots 4

Central values give the usual formula of fourth order. The error of a smooth function is some 1e-11 of its size.

Cites: fornberg_1988.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from identification.local.confidence import indistinguishable, propagate
from identification.local.models import LinearModel
from rotorsim.base.errors import ModelError, UnfitError
from rotorsim.base.rounding import unstable_poles

Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
STEP = 1e-3
"""Distance of the five values, as a share of the parameter's size."""
AT_BOUND = 1e-9
"""A parameter nearer to a bound than this share of its size lies at it."""


@dataclass(frozen=True)
class Structure:
    """Parameters and the matrices that they make: two references [V] in, two displacements [m] out, n states.

    name; parameters: q names; matrices: function of theta (q,) that returns A (n, n), B (n, 2), C (2, n), D (2, 2) in
    SI units, continuous time; start (q,): where a fit begins, unless it is given another; bounds: q pairs (low, high),
    -inf and inf where there is none; units: q texts for reports; positive: names of parameters, such as poles and
    masses, that stay above zero and change by half at most in one step of a fit; affine: whether A and B are affine in
    each parameter alone and C and D constant, which makes derivatives exact. Nothing of it is stored with a model.

    Raises
    ------
    ModelError
        For names that repeat, or starts, bounds and units that do not fit them.

    Examples
    --------
    >>> import numpy as np, rotorsim as rs
    >>> def lags(theta):
    ...     pole, gain = theta
    ...     return -pole * np.eye(2), pole * gain * np.eye(2), np.eye(2), np.zeros((2, 2))
    >>> rs.identification.Structure("two lags", ("pole", "gain"), lags, (500.0, 1e-6), units=("rad/s", "m/V")).name
    'two lags'
    """

    name: str
    parameters: tuple[str, ...]
    matrices: Callable[[np.ndarray], Matrices]
    start: tuple[float, ...] = ()
    bounds: tuple[tuple[float, float], ...] = ()
    units: tuple[str, ...] = ()
    positive: tuple[str, ...] = ()
    affine: bool = False

    def __post_init__(self) -> None:
        """Refuse descriptions that do not fit together."""
        for name in ("parameters", "start", "bounds", "units", "positive"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        self._check_names()
        for name in ("start", "bounds", "units"):
            count = len(getattr(self, name))
            if count not in (0, len(self.parameters)):
                raise ModelError(f"{self}.{name}: {count} for {len(self.parameters)} parameters; give one for each")
        for name, pair in zip(self.parameters, self.bounds, strict=False):
            pair_of_numbers = np.shape(pair) == (2,) and all(isinstance(one, Real) for one in pair)
            if not (pair_of_numbers and pair[0] < pair[1]):
                raise ModelError(f"{self}.bounds of {name}: {pair}; give a pair (low, high) with low below high")

    def _check_names(self) -> None:
        """Refuse names that are not texts, repeat, or are not there."""
        names = self.parameters
        if not (self.name and names and all(isinstance(one, str) and one for one in (self.name, *names))):
            raise ModelError(f"structure {self.name!r}, parameters {names}: give it and each parameter a name")
        if len(set(names)) < len(names):
            raise ModelError(f"{self}.parameters: {', '.join(names)}; give each a name of its own")
        if unknown := set(self.positive) - set(names):
            raise ModelError(f"{self}.positive: {', '.join(sorted(unknown))}; choose of {', '.join(names)}")

    def __str__(self) -> str:
        """Name of the structure in messages."""
        return f"structure '{self.name}'"

    @property
    def low(self) -> np.ndarray:
        """Lower bounds (q,)."""
        return np.array([low for low, _ in self.bounds] or [-np.inf] * len(self.parameters), float)

    @property
    def high(self) -> np.ndarray:
        """Upper bounds (q,)."""
        return np.array([high for _, high in self.bounds] or [np.inf] * len(self.parameters), float)

    @property
    def positive_places(self) -> np.ndarray:
        """Places of the parameters that must be positive."""
        return np.array([self.parameters.index(name) for name in self.positive], int)

    def admissible(self, theta: np.ndarray) -> bool:
        """Whether the parameters that must be positive are, and all are within their bounds."""
        own = theta[: len(self.parameters)]
        within = not self.bounds or bool(np.all((own >= self.low) & (own <= self.high)))
        return within and bool(np.all(theta[self.positive_places] > 0))

    def at_bounds(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which parameters (q,) lie at their lower, and which at their upper bound."""
        size = AT_BOUND * np.maximum(np.abs(theta), 1e-300)
        return theta <= self.low + size, theta >= self.high - size

    def derivatives(self, theta: np.ndarray) -> Matrices:
        """dA/dtheta (q, n, n), dB (q, n, m), dC (q, p, n) and dD (q, p, m)."""
        columns = [self._affine(theta, i) if self.affine else self._curved(theta, i) for i in range(len(theta))]
        dA, dB, dC, dD = (np.array(one) for one in zip(*columns, strict=True))
        return dA, dB, dC, dD

    def _affine(self, theta: np.ndarray, i: int) -> list[np.ndarray]:
        low, high = theta.copy(), theta.copy()
        low[i], high[i] = 0.0, 1.0
        return [b - a for a, b in zip(self.matrices(low), self.matrices(high), strict=True)]

    def _curved(self, theta: np.ndarray, i: int) -> list[np.ndarray]:
        offsets, h = five_values(theta[i], self.low[i], self.high[i], self.start[i] if self.start else 0.0)
        weights = np.linalg.solve(np.vander(offsets, increasing=True).T, np.eye(5)[1]) / h
        middle, found = self.matrices(theta), [np.zeros(())] * 4
        for offset, weight in zip(offsets, weights, strict=True):
            moved = theta.copy()
            moved[i] += offset * h
            values = zip(found, self.matrices(moved), middle, strict=True)
            found = [
                total + weight * (value - old) for total, value, old in values
            ]  # what does not change adds nothing
        return found


def five_values(theta: float, low: float, high: float, start: float) -> tuple[np.ndarray, float]:
    """Offsets (5,), neighbours 1 apart, and their unit, of values of a parameter within its bounds."""
    size = max(abs(theta), abs(start)) or (min(high - low, 1.0))
    h = min(STEP * size, (high - low) / 4)
    first = np.clip(theta - 2 * h, low, max(high - 4 * h, low))
    return (first - theta) / h + np.arange(5), h


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

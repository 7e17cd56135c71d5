r"""Structures of grey-box models: named parameters theta and the matrices A, B, C, D that they make, continuous time.

The thesis' Models 1 to 3 (`identification.local.greybox`) are instances, and so is a structure of your own. Where A and
B are affine in each parameter alone, C and D constant, the difference of two values is the exact derivative; else it is
that of the polynomial through five values, which lie within the parameter's bounds:

.. math:: f'(\theta) \approx \sum_{i=1}^{5} w_i f(\theta + o_i h), \qquad
          \sum_i w_i o_i^k = \delta_{1k}, \; k = 0 \ldots 4

Central values give the usual formula of fourth order. The error of a smooth function is some 1e-11 of its size.

Cites: fornberg_1988.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real

import numpy as np

from identification.errors import ModelError

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
        """How messages name it."""
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
        """Where the parameters stand that must be positive."""
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

r"""Decisions of linear algebra with rounding taken into account: stability, definiteness, rank, largest value.

A computed answer is the exact one of a matrix that differs by its own rounding, about n eps \|A\|; what such matrices
do not agree on, rounding decides, and processors round differently. Thresholds of this kind stand here.
Source: Higham, Accuracy and Stability of Numerical Algorithms (2002), chapters 1 and 10; Trefethen & Embree (2005).

Cites: higham_2002, trefethen_2005.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rotorsim.base.errors import NoAnswerError

EPS = float(np.finfo(float).eps)
DECAYS = 1 - 1e-9
"""Radius within which a pole of a sampled system decays; one nearer to the unit circle is left to rounding."""
DAMPED = 1e-9
"""Damping ratio above which an oscillation decays, and below minus which it grows; in between rounding decides."""
SPLIT_ZERO = 4 * EPS**0.5
"""Largest size, over the largest eigenvalue, of the eigenvalues that rounding makes of a double zero (seen: 1.3e-8)."""
STRAIGHT = 1e-3
"""Imaginary part over modulus of a growing eigenvalue up to which it does not oscillate."""
ALIKE = 1e-6
"""Relative difference up to which two numbers from eigenvectors count as equal."""
REPEATED = 1e-9
"""Relative difference up to which two eigenvalues count as one: any sum of their vectors is a vector, too."""
PLANAR = 0.02
"""Roundness of an orbit below which its sense of whirl is mixed."""


def answer(function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Result of a function of linear algebra; raises NoAnswerError where it fails or is not finite.

    LAPACK refuses numbers that overflow, a singular matrix, an iteration without end: that ends a fit or a run.
    """
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            found = function(*arguments, **options)
    except (np.linalg.LinAlgError, ValueError, OverflowError, ZeroDivisionError) as error:
        raise NoAnswerError(f"linear algebra: {error}") from error
    for part in found if isinstance(found, tuple) else (found,):
        if isinstance(part, (np.ndarray, np.number, float)) and not np.all(np.isfinite(part)):
            raise NoAnswerError("linear algebra: numbers overflow")
    return found


def divergence(values: np.ndarray) -> float:
    """Largest growth rate [1/s] among eigenvalues (n,) [rad/s] that grow without oscillation; 0 without one.

    A static stiffness that pushes away makes them real and positive. Those that rounding makes of a double zero, a free
    motion, do not count; two alike, which rounding splits into a pair, do.
    """
    size = np.abs(values)
    grows = (values.real > 0) & (np.abs(values.imag) <= STRAIGHT * size) & (size > SPLIT_ZERO * size.max(initial=0.0))
    return float(values.real[grows].max(initial=0.0))


def repeated(values: np.ndarray) -> np.ndarray:
    """Whether eigenvalues (n,) are there twice or more, within rounding."""
    apart = np.abs(values[:, None] - values)
    return np.asarray((apart <= REPEATED * np.abs(values)).sum(axis=0) > 1)


def whirl_sense(roundness: np.ndarray) -> np.ndarray:
    """'forward', 'backward' or 'mixed' for the roundness (...) of orbits; empty at a NaN."""
    words = np.where(roundness > 0, "forward", "backward")
    return np.where(np.isnan(roundness), "", np.where(np.abs(roundness) < PLANAR, "mixed", words))


def unstable_poles(A: np.ndarray) -> int | None:
    """Number of eigenvalues of A (n, n) without negative real part; None if it depends on rounding.

    Rounding decides where a change of A by its own backward error puts a pole on the axis: where i omega - A, with
    omega the poles' own, is singular to working precision.
    """
    from scipy.linalg import matrix_balance

    if not len(A):
        return 0
    A = np.asarray(matrix_balance(A, permute=False)[0])
    poles = np.linalg.eigvals(A)
    at = 1j * poles.imag[poles.imag >= 0]
    distance = np.linalg.svd(at[:, None, None] * np.eye(len(A)) - A, compute_uv=False)
    if np.any(distance[:, -1] <= len(A) * EPS * distance[:, 0]):
        return None
    return int(np.count_nonzero(poles.real >= 0))


def decays(poles: np.ndarray) -> bool:
    """True if all poles z (n,) of a sampled system decay by more than rounding; False if one is not finite."""
    return bool(np.all(np.abs(poles) < DECAYS))


def definite(matrices: np.ndarray) -> np.ndarray:
    """True if symmetric matrices (..., n, n) are positive definite by more than rounding, after scaling."""
    size = np.sqrt(np.abs(np.diagonal(matrices, axis1=-2, axis2=-1)))
    size = np.where(size > 0, size, 1.0)
    values = np.linalg.eigvalsh(matrices / size[..., :, None] / size[..., None, :])
    return np.asarray(values[..., 0] > matrices.shape[-1] * EPS * np.abs(values).max(axis=-1))


def normal_root(N: np.ndarray) -> np.ndarray:
    """W (n, n) with W W' the inverse of a normal matrix N = J'J, independent of the units of J's columns.

    A combination that is not determined by more than rounding has the large variance of the least information that
    could be distinguished from none. A pseudo-inverse would give it none.
    """
    size = np.sqrt(np.maximum(np.diag(N), 0.0))
    size = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(N / size / size[:, None])
    values = np.maximum(values, len(N) * EPS * max(float(values.max(initial=0.0)), EPS))
    return np.asarray(vectors / np.sqrt(values) / size[:, None])


def least_squares(J: np.ndarray, y: np.ndarray, rcond: float = 1e-8) -> np.ndarray:
    """Least squares solution (k, ...) of J x = y, with a rank independent of the units of J's columns."""
    size = np.linalg.norm(J, axis=0)
    size = np.where(size > 0, size, 1.0)
    x = np.linalg.lstsq(J / size, y, rcond=rcond)[0]
    return np.asarray((x.T / size).T)


def first_of_largest(values: np.ndarray) -> int:
    """Index of the largest of positive values (n,), the first of those equal within rounding."""
    return int(np.argmax(values >= (1 - ALIKE) * np.max(values)))


def first_of_highest(values: np.ndarray) -> int:
    """Index of the highest of values (n,) of any sign, NaN left out, the first of those equal within rounding."""
    highest = np.nanmax(values)
    return int(np.argmax(values >= highest - ALIKE * abs(highest)))


def falls_below_zero(f: Callable[[float], float], low: float, high: float, **tolerances: float) -> float:
    """Zero crossing of f from f(low) >= 0 to f(high) < 0 by Brent's method, or an end if rounding decides."""
    from scipy.optimize import brentq

    if f(low) <= 0:
        return low
    return high if f(high) >= 0 else float(brentq(f, low, high, **tolerances))

"""Critical speeds by a direct search: all eigenvalues at each speed, without following any mode."""

from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.linalg import eigvals
from scipy.sparse import coo_matrix, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from rotorsim.base.errors import NoLiftOffError
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant

DAMPED = 0.5
"""Damping ratio from which an eigenvalue does not count."""
STEEP = 40.0
"""Bound on the change of a natural frequency with the speed, over the order, that the search supposes (seen: 28)."""
FINE = 1e-4
"""Relative width of an interval of speeds in which at most one crossing is looked for at each eigenvalue."""


def all_eigenvalues(plant: Plant, speed: float, pressure: float = 0.0) -> np.ndarray:
    """Every eigenvalue [rad/s] of the upper half plane at a speed [rad/s]; none where the film does not carry."""
    try:
        model = plant.linearise(speed, pressure)
    except NoLiftOffError:
        return np.zeros(0, complex)
    found = eigvals(model.A)
    return found[found.imag > 1e-6 * np.abs(found)]


def crossings(
    spectrum: Callable[[float], np.ndarray], low: float, high: float, order: int = 1, cells: int = 64
) -> np.ndarray:
    """Rows (speed, damping ratio, direction) of all crossings |s| = order speed between two speeds [rad/s].

    An interval is left out where every eigenvalue is farther from the line, at both ends, than it can move; others are
    halved. In one of a width of `FINE` the eigenvalues near the line are sorted and a sign that changes is a crossing.
    The direction is 1 where the natural frequency rises above the line and -1 where it falls below.
    """
    known: dict[float, np.ndarray] = {}

    def at(speed: float) -> np.ndarray:
        if speed not in known:
            s = spectrum(speed)
            known[speed] = s[-s.real < 1.6 * DAMPED * np.abs(s)]
        return known[speed]

    found: list[tuple[float, float, float]] = []
    stack = [(a, b) for a, b in zip(*(lambda g: (g[:-1], g[1:]))(np.linspace(low, high, cells + 1)), strict=True)]
    while stack:
        a, b = stack.pop()
        gaps = [np.abs(at(v)) - order * v for v in (a, b)]
        nearest = [np.abs(g).min() if g.size else np.inf for g in gaps]
        if max(nearest) > STEEP * order * (b - a) or not np.isfinite(nearest).any():
            continue
        if b - a > FINE * b:
            stack += [(a, (a + b) / 2), ((a + b) / 2, b)]
            continue
        found += _roots(at, a, b, order)
    return np.array(sorted(found)).reshape(-1, 3)


def counted(plant: Plant, low: float, high: float, rows: np.ndarray, pressure: float = 0.0) -> list[int]:
    """Intervals, of eight, in which the crossings of order 1 in `rows` are not as many, down less up, as the degree.

    With s = v exp(i phi), at the speed v, the zeros of det(J - s S) over the rectangle of v between two speeds and phi
    from 0 to the border of damping are the crossings, and the phase of the determinant turns once around it for each:
    forward for one that falls below the line, back for one that rises above it. Along phi at one speed the turn is that
    of all eigenvalues; along v, at the border, the determinant is asked. Where the equilibrium jumps at a speed, the
    parts below and above are counted.
    """
    edge = np.exp(1j * (np.pi - np.arccos(DAMPED)))
    speeds = np.linspace(_carried(plant, low, high, pressure), high, 9)
    for k, speed in enumerate(speeds):
        while len(rows) and np.abs(rows[:, 0] / speed - 1).min() < 2e-3:
            speed *= 1.003
        speeds[k] = speed
    model = cache(lambda v: plant.linearise(v, pressure))
    wrong = []
    for k, (a, b) in enumerate(pairwise(speeds.tolist())):
        turns = _turns(model, a, b, edge)
        if not abs(turns + rows[(rows[:, 0] > a) & (rows[:, 0] < b), 2].sum()) < 0.05:
            wrong.append(k)
    return wrong


def _turns(model: Callable[[float], LinearPlant], a: float, b: float, edge: complex) -> float:
    """Turns of the phase of the determinant around the rectangle between two speeds."""
    border, jump = _turned_along(lambda v: _log_det(model(v), v * edge), np.linspace(a, b, 17))
    if jump is not None:
        return _turns(model, a, jump[0], edge) + _turns(model, jump[1], b, edge)
    arcs = [_turned_along_phi(eigvals(model(v).A), v, edge) for v in (a, b)]
    return (arcs[1] - arcs[0] - border) / (2 * np.pi)


def _carried(plant: Plant, low: float, high: float, pressure: float) -> float:
    """Lowest speed at which the film carries, to a part in a thousand of the range."""
    refused = low
    while True:
        try:
            plant.linearise(low, pressure)
        except NoLiftOffError:
            refused, low = low, 0.5 * (low + high)
            continue
        if low - refused < 1e-3 * high:
            return low
        high, low = low, 0.5 * (low + refused)


def _turned_along_phi(roots: np.ndarray, v: float, edge: complex) -> float:
    """Change of the phase of prod(s - root) from s = v to v edge, along the arc."""
    angles = np.angle((v * edge - roots) / (v - roots))
    return float(np.where((np.abs(roots) < v) & (angles < 0), angles + 2 * np.pi, angles).sum())


def _turned_along(log: Callable[[float], complex], at: np.ndarray) -> tuple[float, tuple[float, float] | None]:
    """Change of the imaginary part of a logarithm along ascending values, in steps that are halved as it changes.

    And the first short step met in which it jumps, None without one.
    """
    known: dict[float, complex] = {}

    def change(a: float, b: float) -> complex:
        for v in (a, b):
            if v not in known:
                known[v] = log(v)
        off = known[b] - known[a]
        return complex(off.real, (off.imag + np.pi) % (2 * np.pi) - np.pi)

    total, left_over = 0.0, list(pairwise(at.tolist()))
    while left_over:
        a, b = left_over.pop()
        halves = change(a, 0.5 * (a + b)), change(0.5 * (a + b), b)
        if max(map(abs, halves)) < 1:
            total += halves[0].imag + halves[1].imag
        elif b - a < 1e-6 * b:
            return total, (a, b)
        else:
            left_over += [(a, 0.5 * (a + b)), (0.5 * (a + b), b)]
    return total, None


def _log_det(model: LinearPlant, s: complex) -> complex:
    """Logarithm of det(J - s S), out of sparse factors of the whole matrix."""
    factor = splu((model.J - s * diags(model.S)).tocsc())
    flips = sum(len(order) - connected_components(_permutation(order))[0] for order in (factor.perm_r, factor.perm_c))
    return complex(np.log(factor.U.diagonal().astype(complex)).sum() + 1j * np.pi * flips)


def _permutation(order: np.ndarray) -> coo_matrix:
    return coo_matrix((np.ones(len(order)), (np.arange(len(order)), order)))


def _roots(at: Callable[[float], np.ndarray], a: float, b: float, order: int) -> list[tuple[float, float, float]]:
    """Crossings in a short interval, where eigenvalues are paired by their distance."""
    first, last = at(a), at(b)
    found = []
    for s in first:
        if not last.size:
            break
        other = last[np.abs(last - s).argmin()]
        before, after = abs(s) - order * a, abs(other) - order * b
        if (before > 0) != (after > 0) and abs(other - s) < 2 * STEEP * order * (b - a):
            speed, value = _secant(at, s, a, b, before, after, order)
            if -value.real < DAMPED * abs(value):
                found.append((speed, -value.real / abs(value), 1.0 if before <= 0 else -1.0))
    return found


def _secant(
    at: Callable[[float], np.ndarray], s: complex, a: float, b: float, before: float, after: float, order: int
) -> tuple[float, complex]:
    """Speed and eigenvalue of a crossing between a and b by regula falsi on the eigenvalue nearest to s."""
    speed, value = a, s
    for _ in range(12):
        speed = a + (b - a) * before / (before - after)
        values = at(speed)
        value = complex(values[np.abs(values - s).argmin()])
        gap = abs(value) - order * speed
        if abs(gap) < 1e-10 * speed:
            break
        if (gap > 0) == (before > 0):
            a, before = speed, gap
        else:
            b, after = speed, gap
    return speed, value

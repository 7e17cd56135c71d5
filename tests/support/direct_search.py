"""Critical speeds by a direct search: all eigenvalues at each speed, without following any mode."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy.linalg import eigvals

from rotorsim.base.errors import NoLiftOffError
from rotorsim.plant import Plant

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


def counted(spectrum: Callable[[float], np.ndarray], low: float, high: float, rows: np.ndarray) -> list[int]:
    """Intervals, of eight, in which the crossings of order 1 in `rows` are not as many upward less downward as counted.

    A count of the modes below the line at both ends; where that differs, modes may have entered or left through the
    border of damping, and each is followed to its nearest at 120 steps. Rows are those of `crossings`, which costs more
    than a film's spectrum allows.
    """
    speeds = np.linspace(low, high, 9)
    for k, speed in enumerate(speeds):
        while len(rows) and np.abs(rows[:, 0] / speed - 1).min() < 2e-3:
            speed *= 1.003
        speeds[k] = speed
    below = [int(np.sum((np.abs(s) < v) & (-s.real < DAMPED * np.abs(s)))) for v in speeds for s in [spectrum(v)]]
    wrong = []
    for k, (a, b) in enumerate(pairwise(speeds)):
        net = int(-rows[(rows[:, 0] > a) & (rows[:, 0] < b), 2].sum())
        if net != below[k + 1] - below[k] and net != _net(spectrum, np.linspace(a, b, 121)):
            wrong.append(k)
    return wrong


def _net(spectrum: Callable[[float], np.ndarray], speeds: np.ndarray) -> int:
    """Modes that fall below the line of order 1, less those that rise above it, over speeds in small steps."""
    spectra = [s[np.abs(np.abs(s) / v - 1) < 0.3] for v in speeds for s in [spectrum(v)]]
    net = 0
    for v, w, here, there in zip(speeds[:-1], speeds[1:], spectra[:-1], spectra[1:], strict=True):
        for s in here if len(there) else []:
            other = there[np.abs(there - s).argmin()]
            gaps = abs(s) - v, abs(other) - w
            if abs(other - s) > 0.1 * abs(s):  # it has left the neighbourhood of the line
                continue
            if gaps[0] * gaps[1] < 0 and -s.real / abs(s) - other.real / abs(other) < 2 * DAMPED:
                net += 1 if gaps[1] < 0 else -1
    return net


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

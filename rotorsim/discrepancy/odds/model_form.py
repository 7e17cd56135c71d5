r"""Error of the model's form: a stationary process over lines and operating points, relative to the response.

.. math:: r = r_0 + U z, \quad z \sim N(0, \tau^2 I), \quad U U' = \mathrm{diag}(y)\,(K_f \otimes K_o)\,\mathrm{diag}(y)

r is the whitened residual, y the whitened magnitude of the response at each line. K_f holds hat functions over
frequency, K_o falls with the distance of two operating points in speed and pressure; real and imaginary part and both
channels have processes of their own. Each row of a run-up's vectors is an operating point, its order n lies at the
frequency n Omega / 2 pi: so it shares its error with the same order in a record at that speed. tau is the relative
error; it is not declared but inferred (`SIZES`, by `weights`).

Source: Kennedy & O'Hagan (2001), with a process that is relative to the response.

Cites: kennedy_2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsim.base.constants import MPA
from rotorsim.discrepancy.data.groups import Layout
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.linear_algebra import answer
from rotorsim.discrepancy.residuals.floor import modulus

BAND = 25.0
"""Distance [Hz] over which the relative error of a response changes."""
SPEED, PRESSURE = 2 * np.pi * 30.0, 0.15 * MPA
"""Distances in speed [rad/s] and pressure [Pa] over which it changes."""
SIZES = np.geomspace(1e-4, 0.3, 18)
"""Relative errors that are tried."""
USUAL = 0.01
"""Half of all models are taken to be better than this (half-Cauchy distribution)."""
MOST_NODES = 60
LEAST = 1e-6
"""Variance, relative to the largest, of directions that are left out."""


@dataclass(frozen=True, eq=False)
class ModelForm:
    """Orthonormal directions (n, m) of the error and its variances (m,) at tau = 1."""

    directions: np.ndarray
    variances: np.ndarray

    def projected(self, columns: np.ndarray) -> np.ndarray:
        """Components (m, ...) of whitened vectors (n, ...) in the directions."""
        return np.asarray(self.directions.T @ columns)

    def whitened(self, residual: np.ndarray, tau: float) -> np.ndarray:
        """A residual (n,) with the error of the form taken out of its directions, as far as its size goes."""
        taken = 1 - 1 / np.sqrt(self.inflation(tau))
        return np.asarray(residual - self.directions @ (taken * self.projected(residual)))

    def inflation(self, tau: float) -> np.ndarray:
        """Variances (m,) in the directions, 1 without an error of the form."""
        return np.asarray(1 + tau**2 * self.variances)


def weights() -> np.ndarray:
    """Prior probabilities (sizes,) of `SIZES`: half-Cauchy in tau, on a grid even in its logarithm."""
    density = SIZES / (1 + (SIZES / USUAL) ** 2)
    return np.asarray(density / density.sum())


def whitened_size(layout: Layout, response: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Magnitude (n,) of each line of a response (n,) [m] in floors sigma (n,) [m]; drifts have none."""
    size = modulus(layout, response) / sigma
    size[layout.drift] = 0.0
    return np.asarray(size)


def model_form(layout: Layout, trials: Sequence[Trial], size: np.ndarray) -> ModelForm:
    """Process of a comparison; size (n,) is the whitened magnitude that the error is relative to."""
    lines = lines_of(layout, trials)
    between = near(lines.points, smooth=lines.has_rows)
    nodes = _nodes(float(lines.frequency.max()))
    blocks = []
    for part in (part for channel in range(2) for part in _parts(layout, channel)):
        ones = [np.where(part, size * hat, 0.0) for hat in _hats(lines.frequency, nodes)]
        columns = [one[:, None] * between[lines.point] for one in ones if one.any()]
        blocks += [np.concatenate(columns, axis=1)] if columns else []
    blocks = blocks or [np.zeros((len(size), 1))]
    if not lines.has_rows:
        return ModelForm(*_principal(np.concatenate(blocks, axis=1)))
    found = [_principal(U) for U in blocks]  # rows make many columns, and no two parts share a number
    directions, s2 = np.concatenate([V for V, _ in found], axis=1), np.concatenate([s2 for _, s2 in found])
    kept = s2 > LEAST * max(float(s2.max()), 1e-300)
    return ModelForm(directions[:, kept], s2[kept])


@dataclass(frozen=True, eq=False)
class LinePlaces:
    """Frequency [Hz] and number of the operating point of every number (n,); points (p, 2) in `SPEED` and `PRESSURE`.

    `has_rows`: whether some are rows of vectors, each of which is a point; otherwise every record is one.
    """

    frequency: np.ndarray
    point: np.ndarray
    points: np.ndarray
    has_rows: bool


def lines_of(layout: Layout, trials: Sequence[Trial]) -> LinePlaces:
    """Where the numbers of a comparison lie."""
    frequency, point, points = layout.frequency.copy(), np.zeros(len(layout.record), int), list[tuple[float, float]]()
    for i, trial in enumerate(trials):
        rows, own = trial.rows_of_vectors, layout.record == i
        speeds = np.array([trial.speed_at(1 + k) for k in range(rows)])
        point[own] = len(points)
        points += [(speed / SPEED, trial.pressure / PRESSURE) for speed in speeds]
        if trial.orders:
            lines = own & (layout.frequency > 0)  # their numbers, from 1: all rows of the first order, of the next ...
            order, row = np.divmod(layout.frequency[lines].astype(int) - 1, rows)
            point[lines] += row
            frequency[lines] = np.array(trial.orders)[order] * np.abs(speeds[row]) / (2 * np.pi)
    return LinePlaces(frequency, point, np.array(points), any(t.orders for t in trials))


def near(points: np.ndarray, smooth: bool = False) -> np.ndarray:
    """Factor L (p, k) of the correlation L L' of the error between operating points (p, 2).

    Of a `smooth` one the parts are left out that rows close to each other do not determine.
    """
    apart = np.sum((points[:, None] - points[None]) ** 2, axis=2)
    values, vectors = answer(np.linalg.eigh, np.exp(-0.5 * apart))
    L = np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
    return L[:, values > LEAST * values.max()] if smooth else L


def _principal(U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal directions (n, m) of U U' and its eigenvalues (m,), of columns U (n, k)."""
    if U.shape[1] > len(U):
        s2, V = answer(np.linalg.eigh, U @ U.T)
        return V, s2
    s2, V = answer(np.linalg.eigh, U.T @ U)
    kept = s2 > LEAST * max(float(s2.max()), 1e-300)
    return U @ (V[:, kept] / np.sqrt(s2[kept])), s2[kept]


def _nodes(highest: float) -> np.ndarray:
    count = min(max(int(np.ceil(highest / BAND)), 1), MOST_NODES) + 1
    return np.linspace(0.0, max(highest, 1.0), count)


def _hats(frequency: np.ndarray, nodes: np.ndarray) -> list[np.ndarray]:
    """Linear interpolation functions (n,) of the nodes."""
    unit = np.eye(len(nodes))
    return [np.interp(frequency, nodes, row) for row in unit]


def _parts(layout: Layout, channel: int) -> list[np.ndarray]:
    """Masks (n,) of real (with the means) and of imaginary parts of a channel."""
    real = np.zeros(len(layout.record), bool)
    for i in np.unique(layout.record):
        own = np.flatnonzero((layout.record == i) & (layout.channel == channel))
        real[own[: 2 + (len(own) - 2) // 2]] = True
    mine = layout.channel == channel
    return [mine & real, mine & ~real]

r"""Runout and extended runout over the shaft angle, estimated from a run without excitation.

.. math:: \hat y(\varphi) = \sum_{k=1}^{n} a_k \cos k\varphi + b_k \sin k\varphi \qquad\text{or a table over } \varphi

At a slow roll it is the sensors' runout; at the speed of the experiment it is runout and imbalance response together
(thesis, section 2.6.2). The thesis takes a look-up table of the mean at every angle. At speeds that divide the sampling
frequency a record visits few angles, 60 at 5000 rpm and 5 kHz, so the table is interpolated around the turn.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.errors import UnfitError

HARMONICS, BINS, RARE = 12, 2000, 0.3
TURN = 2 * np.pi
KINDS = ("harmonic", "table")


@dataclass(frozen=True, eq=False)
class Runout:
    """`values`: coefficients (2 n, 2) of cosines and sines, or a table (bins, 2); both [m], over the shaft angle."""

    kind: str
    values: np.ndarray

    def at(self, angle: np.ndarray) -> np.ndarray:
        """Runout (n, 2) [m] at angles (n,) [rad]."""
        if self.kind == "harmonic":
            return harmonics(angle, len(self.values) // 2) @ self.values
        place = np.mod(angle, TURN) / TURN * len(self.values) - 0.5
        low = np.floor(place).astype(int)
        share = (place - low)[:, None]
        n = len(self.values)
        return (1 - share) * self.values[low % n] + share * self.values[(low + 1) % n]


def harmonics(angle: np.ndarray, count: int) -> np.ndarray:
    """Cosines and sines (n, 2 count) of multiples of the angle (n,)."""
    turns = np.exp(1j * np.outer(angle, np.arange(1, count + 1)))
    return np.hstack([turns.real, turns.imag])


def estimate_runout(
    angle: np.ndarray, y: np.ndarray, kind: str = "harmonic", count: int = HARMONICS, bins: int = BINS
) -> Runout:
    """Runout of displacements y (n, 2) [m] measured at shaft angles (n,) [rad]; its mean over a turn is zero.

    Raises
    ------
    UnfitError
        If the shaft does not turn at least twice.

    Examples
    --------
    >>> import rotorsim as rs
    >>> angle = np.linspace(0.0, 8 * np.pi, 400)
    >>> runout = rs.identification.estimate_runout(angle, 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)]))
    >>> float(abs(runout.values).max().round(9))
    1e-06
    """
    turns = abs(angle[-1] - angle[0]) / TURN
    if turns < 2:
        raise UnfitError(
            f"runout: the shaft turns {turns:.2g} times, the filter needs 2 turns or more; record longer at speed"
        )
    if kind == "harmonic":
        return Runout(kind, fit_harmonics(angle, y, fitting_count(angle, count)))
    if kind == "table":
        return Runout(kind, _table(angle, y, bins))
    raise UnfitError(f"runout: kind {kind!r}; choose 'harmonic' or 'table'")


def fit_harmonics(angle: np.ndarray, y: np.ndarray, count: int) -> np.ndarray:
    """Coefficients (2 count, 2) [m] of cosines and sines of y (n, 2) [m] over angles (n,) [rad], next to a mean."""
    basis = np.column_stack([np.ones(len(angle)), harmonics(angle, count)])
    return np.asarray(np.linalg.lstsq(basis, y, rcond=1e-8)[0][1:])


def fitting_count(angle: np.ndarray, count: int) -> int:
    """As many harmonics as stay below the Nyquist frequency."""
    step = abs(angle[-1] - angle[0]) / (len(angle) - 1)
    return max(1, min(count, int(0.95 * np.pi / step)))


def _table(angle: np.ndarray, y: np.ndarray, bins: int) -> np.ndarray:
    at = np.minimum((np.mod(angle, TURN) / TURN * bins).astype(int), bins - 1)
    visits = np.bincount(at, minlength=bins)
    # an encoder on the edge of a count fills a bin by chance now and then; one noisy visit is not a mean
    seen = np.flatnonzero(visits > RARE * visits[visits > 0].mean())
    table = np.empty((bins, 2))
    for axis in range(2):
        mean = np.bincount(at, y[:, axis], bins)[seen] / visits[seen]
        table[:, axis] = np.interp(np.arange(bins), seen, mean, period=bins)
    return table - table.mean(axis=0)


def on_angle(angle: np.ndarray, y: np.ndarray, per_turn: int = 256) -> tuple[np.ndarray, np.ndarray]:
    """Samples resampled evenly over the shaft angle: angles (k,) [rad] and values (k, 2) by straight lines.

    Examples
    --------
    >>> import rotorsim as rs
    >>> angle, values = rs.identification.on_angle(turning["angle"].values, turning["disc"].values, per_turn=64)
    >>> values.shape == (angle.size, 2)
    True
    """
    first, last = sorted((angle[0], angle[-1]))
    grid = np.arange(np.ceil(first * per_turn / TURN), np.floor(last * per_turn / TURN) + 1) * TURN / per_turn
    order = np.argsort(angle, kind="stable")
    return grid, np.column_stack([np.interp(grid, angle[order], column[order]) for column in y.T])

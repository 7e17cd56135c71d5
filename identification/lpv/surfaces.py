r"""Polynomial surfaces over the operating point q = (speed, pressure) (thesis, eqs. 2.6 to 2.8).

.. math:: \theta(q) = \sum_{i + j \le n} c_{ij}\, \bar q_1^i \bar q_2^j, \qquad \bar q = (q - q_{mid}) / q_{half}

Least squares over the points, each parameter alone; scaling to [-1, 1] keeps the columns apart.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.errors import UnfitError
from rotorsim.base.rounding import ALIKE

ORDERS = (1, 2, 3)
SAME = (0.5, 500.0)
"""Speeds [rad/s] and pressures [Pa] closer than this count as one grid line."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Monomials of scaled scheduling variables: exponents (t, 2), middle (2,) and half range (2,) [rad/s, Pa]."""

    exponents: np.ndarray
    middle: np.ndarray
    half: np.ndarray

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values (k, t) at operating points (k, 2) [rad/s, Pa]."""
        scaled = (np.atleast_2d(points) - self.middle) / self.half
        return np.asarray(np.prod(scaled[:, None, :] ** self.exponents[None], axis=2))


def grid_lines(values: np.ndarray, same: float) -> int:
    """Number of distinct values."""
    return 1 + int(np.count_nonzero(np.diff(np.sort(values)) > same))


def make_basis(points: np.ndarray, order: int) -> Basis:
    """Basis of total degree `order` for operating points (k, 2); a variable that never changes gets no terms.

    Raises
    ------
    UnfitError
        If points or grid lines are too few for the order, or the points lie on a curve that leaves it open.
    """
    points = np.atleast_2d(np.asarray(points, float))
    if not np.all(np.isfinite(points)):
        raise UnfitError("fit_lpv: a result has no speed or no pressure; give both in the record, constant if need be")
    if order not in range(0, 6):
        raise UnfitError(f"fit_lpv.order: {order}; choose 1, 2, 3 or 'hold-out'")
    lines = [grid_lines(points[:, i], SAME[i]) for i in range(2)]
    moving = [count > 1 for count in lines]
    exponents = [(i, j) for total in range(order + 1) for i in range(total, -1, -1) if (j := total - i) >= 0]
    exponents = [(i, j) for i, j in exponents if (moving[0] or not i) and (moving[1] or not j)]
    for name, count, moves in zip(("speeds", "pressures"), lines, moving, strict=True):
        if moves and count <= order:
            raise UnfitError(
                f"fit_lpv.order: {count} different {name}, order {order} needs {order + 1} or more; "
                "add points or lower the order"
            )
    if len(points) < len(exponents):
        raise UnfitError(
            f"fit_lpv.order: {len(points)} points, surfaces of order {order} need {len(exponents)} or more; "
            "add points or lower the order"
        )
    low, high = points.min(axis=0), points.max(axis=0)
    basis = Basis(np.array(exponents), (low + high) / 2, np.where(moving, (high - low) / 2, 1.0))
    singular = np.linalg.svd(basis.at(points), compute_uv=False)
    if singular[-1] < ALIKE * singular[0]:
        raise UnfitError(
            f"fit_lpv.order: the points lie on a curve over speed and pressure, along which surfaces of order {order} "
            "cannot be distinguished; add points near it or lower the order"
        )
    return basis


def fit_surfaces(basis: Basis, points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Coefficients (q, t) of the surfaces through values (k, q) at points (k, 2)."""
    return np.asarray(np.linalg.lstsq(basis.at(points), values, rcond=None)[0].T)


def rms(values: np.ndarray) -> np.ndarray:
    """Root mean square (q,) over the rows of (k, q)."""
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=0)))

"""Balanced truncation of a stable controller, its order chosen by the change of the loop's sensitivity S.

The Hankel values of a controller predict little of its loop; the order here is the smallest whose S differs from the
full one's, relative to the peak of the latter, by less than a tolerance, and whose loop is stable.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rotorsim.base.rounding import EPS, decays
from rotorsim.control.errors import DesignError
from rotorsim.control.loop.sampled_loop import closed_poles, loop_of
from rotorsim.control.numerics.systems import System, balanced_states, gramians, largest, stable, transformed


def balanced(system: System) -> tuple[System, np.ndarray]:
    """The system in balanced coordinates and its Hankel singular values; raises DesignError if it is unstable."""
    if not stable(system):
        raise DesignError("reduction: the controller is unstable and has no Gramians; keep its full order")
    system = _of_like_size(system)
    R, L = (_root(W) for W in gramians(system))
    U, hankel, Vt = np.linalg.svd(L.T @ R)
    alive = hankel > system.order * EPS * hankel[0]
    root = np.sqrt(hankel[alive])
    T, left = R @ Vt[alive].T / root, (L @ U[:, alive] / root).T
    return System(left @ system.A @ T, left @ system.B, system.C @ T, system.D), hankel[alive]


def _of_like_size(system: System) -> System:
    """The system in states that inputs move about as far as one another, so that none is lost next to larger ones."""
    system = balanced_states(system)
    size = np.sqrt(np.maximum(np.diag(gramians(system)[0]), 0.0))
    return transformed(system, 2.0 ** -np.round(np.log2(np.where(size > 0, size, 1.0))))


def _root(W: np.ndarray) -> np.ndarray:
    """R with R R' = W, which is positive semi-definite but for rounding."""
    values, vectors = np.linalg.eigh(W)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def truncated(system: System, order: int) -> System:
    """The first `order` balanced states, whatever they are worth."""
    full, _ = balanced(system)
    return System(full.A[:order, :order], full.B[:order], full.C[:, :order], full.D)


def reduced(
    system: System, plant: System, make: Callable[[System], System], Ts: float, order: int | None, tolerance: float
) -> tuple[System, float]:
    """Reduced controller and the largest change of S, relative to its peak.

    Parameters
    ----------
    system : continuous controller
    plant : sampled plant of the loop that judges
    make : continuous controller -> sampled controller
    Ts : sampling time [s]
    order : order, or None for the smallest within the tolerance
    tolerance : largest change of S over its peak

    Raises
    ------
    DesignError
        If no order (or not the one asked for) gives a stable loop.
    """
    full = loop_of(plant, make(system), Ts)
    peak = full.peak
    orders = range(1, system.order + 1) if order is None else [order]
    coordinates, _ = balanced(system)
    for n in orders:
        small = System(coordinates.A[:n, :n], coordinates.B[:n], coordinates.C[:, :n], coordinates.D)
        made = make(small)
        if not decays(closed_poles(plant, made)):
            continue
        change = float(largest(loop_of(plant, made, Ts).So - full.So).max() / peak)
        if order is not None or change < tolerance:
            return small, change
    raise DesignError(f"reduction: order {order} makes the loop unstable; allow more states")

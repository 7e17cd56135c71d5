"""Balanced truncation of a stable controller, its order judged by what it does to the sensitivity S of the loop.

The Hankel values of a controller say little about its loop; the order here is the smallest whose S differs from the
full one's, relative to the peak of the latter, by less than a tolerance, and whose loop is stable.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rotorsim.control.errors import DesignError
from rotorsim.control.loops import closed_poles, loop_of
from rotorsim.control.systems import System, gramians, largest, stable


def balanced(system: System) -> tuple[System, np.ndarray]:
    """The system in balanced coordinates and its Hankel singular values; raises DesignError if it is unstable."""
    if not stable(system):
        raise DesignError("reduction: the controller is unstable and has no Gramians; keep its full order")
    Wc, Wo = gramians(system)
    values, U = np.linalg.eigh(Wc)
    keep = values > 1e-14 * values.max()
    root = U[:, keep] * np.sqrt(values[keep])
    hankel, V = np.linalg.eigh(root.T @ Wo @ root)
    order = np.argsort(hankel)[::-1]
    hankel = np.sqrt(np.maximum(hankel[order], 0))
    alive = hankel > 1e-12 * hankel[0]
    hankel, V = hankel[alive], V[:, order][:, alive]
    T = root @ V / np.sqrt(hankel)
    left = np.linalg.pinv(T)
    return System(left @ system.A @ T, left @ system.B, system.C @ T, system.D), hankel


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
        if np.abs(closed_poles(plant, made)).max() >= 1:
            continue
        change = float(largest(loop_of(plant, made, Ts).So - full.So).max() / peak)
        if order is not None or change < tolerance:
            return small, change
    raise DesignError(f"reduction: order {order} makes the loop unstable; allow more states")

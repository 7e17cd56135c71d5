"""Correction weights: the unbalance that cancels the 1X vectors, in the holes that a disc has."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from rotorsim.balance.conditions import Plane
from rotorsim.balance.influence import Influence
from rotorsim.base.errors import DataError


@dataclass(frozen=True, eq=False)
class Correction:
    """Weights and what they leave.

    Attributes
    ----------
    wanted : complex unbalance to add in each plane (q,) [kg m]
    weights : for each plane the angle [rad] and mass [kg] of its weights; without a radius none
    given : complex unbalance of these weights (q,), `wanted` where there are none [kg m]
    before, after : 1X vectors (m,) [m 0-pk], the second predicted
    """

    wanted: np.ndarray
    weights: tuple[tuple[tuple[float, float], ...], ...]
    given: np.ndarray
    before: np.ndarray
    after: np.ndarray


def correction(found: Influence, vectors: np.ndarray, planes: tuple[Plane, ...]) -> Correction:
    """Weights against `vectors` (m,) [m], NaN where not measured, weighted by the errors of the coefficients.

    A weight goes into the two holes on either side of its angle, or anywhere on the radius without a number of holes.
    Raises DataError if fewer vectors are there than planes.

    Examples
    --------
    >>> import rotorsim as rs
    >>> unbalance = 1e-5 * np.arange(6)[:, None] + 0j
    >>> found = rs.balance.fit_influence(1e-6 + 0.1 * unbalance, unbalance)
    >>> disc = rs.balance.Plane("disc", radius=0.03, holes=16)
    >>> weights = rs.balance.correction(found, np.array([1e-6 + 0j]), (disc,)).weights
    >>> [round(mass * 1e6) for angle, mass in weights[0]]  # mg
    [333]
    """
    there = np.isfinite(vectors)
    H = found.coefficients[there]
    if H.shape[0] < H.shape[1]:
        raise DataError(f"{H.shape[0]} vectors cannot be balanced in {H.shape[1]} planes")
    wanted = -np.linalg.lstsq(H, vectors[there], rcond=None)[0]
    weights = tuple(in_holes(u, plane) for u, plane in zip(wanted, planes, strict=True))
    given = np.array([
        sum(m * (p.radius or 0.0) * np.exp(1j * a) for a, m in ws) if ws else u
        for u, p, ws in zip(wanted, planes, weights, strict=True)
    ])  # fmt: skip
    return Correction(wanted, weights, given, vectors, vectors + found.coefficients @ given)


def in_holes(unbalance: complex, plane: Plane) -> tuple[tuple[float, float], ...]:
    """Angle [rad] and mass [kg] of the weights that make an unbalance [kg m] in a plane; none without its radius."""
    if not plane.radius:
        return ()
    mass, angle = abs(unbalance) / plane.radius, float(np.angle(unbalance)) % (2 * pi)
    if not plane.holes:
        return ((angle, mass),)
    step = 2 * pi / plane.holes
    first = int(angle // step)
    share = np.array([np.sin((first + 1) * step - angle), np.sin(angle - first * step)]) / np.sin(step)
    return tuple(((first + k) % plane.holes * step, float(mass * share[k])) for k in range(2) if share[k] > 1e-9)

"""Influence of unbalance from a machine's physical model, with one complex factor a probe fitted to labelled records.

The model gives the whirl of the shaft at each probe for unbalance in each plane. What a probe makes of it, its angle,
its sensitivity, the origin of the angles, is one complex number that all planes and speeds share.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from fe_shaft.response import run_unbalance_response
from rotorsim.balance.conditions import Conditions, Plane, Reading
from rotorsim.balance.influence import Fit, Influence, fit_influence, influence_of
from rotorsim.base.errors import DataError
from rotorsim.base.sentences import listing
from rotorsim.machine import Machine
from rotorsim.plant.mesh import Mesh


def model_influence(machine: Machine, conditions: Conditions) -> np.ndarray:
    """Complex influence (speeds x readings, planes) [m/(kg m)] of the machine on linear bearings along each probe.

    A probe without an angle sees x, which its complex factor turns where the bearings are the same in x and y. Raises
    DataError for a position that is missing or not on the shaft, and for a gas film.
    """
    if machine.film is not None:
        raise DataError(f"{machine.name}: a balancing model needs linear bearings; this machine has a gas film")
    mesh = Mesh(machine)
    speed = np.nanmedian(conditions.speed, axis=0)
    columns = []
    for plane in conditions.planes:
        whirl = run_unbalance_response(mesh.rotor, _node(mesh, plane), 1.0, 0.0, speed)
        at = np.array([4 * _node(mesh, r) for r in conditions.readings])
        along = np.array([r.angle or 0.0 for r in conditions.readings])[:, None]
        seen = np.cos(along) * whirl.response[at] + np.sin(along) * whirl.response[at + 1]
        columns.append(seen.T.ravel())
    return np.stack(columns, axis=1)


def without_model(machine: Machine, conditions: Conditions) -> str:
    """Why a machine's model cannot serve these records; empty where it can."""
    if machine.film is not None:
        return f"{machine.name} has a gas film, and a balancing model needs linear bearings"
    bare = [plane.name for plane in conditions.planes if plane.position is None]
    bare += [reading.name for reading in conditions.readings if reading.position is None]
    return f"the mapping gives no position of {listing(bare)}" if bare else ""


def _node(mesh: Mesh, part: Plane | Reading) -> int:
    name, position = part.name, part.position
    if position is None:
        raise DataError(f"{name}: the mapping gives no position; the physical model needs one")
    shaft = mesh.machine.shaft
    if not shaft.start - 1e-9 <= position <= shaft.end + 1e-9:
        raise DataError(f"{name}: {1e3 * position:g} mm is not on the shaft")
    return mesh.node(position)


def fit_physical(machine: Machine, conditions: Conditions) -> Fit:
    """Fit of an Influence that keeps the machine's shape: a complex factor a probe, and the first vector of each.

    Examples
    --------
    >>> import rotorsim as rs
    >>> fit = rs.balance.fit_physical(rs.load_machine("plain_rotor"), conditions)
    >>> known = conditions.known
    >>> fit(conditions.flat[known], conditions.unbalance[known]).coefficients.shape
    (2, 1)
    """
    return partial(_fit, model_influence(machine, conditions), len(conditions.readings))


def _fit(model: np.ndarray, readings: int, vectors: np.ndarray, unbalance: np.ndarray) -> Influence:
    free = fit_influence(vectors, unbalance)
    predicted = unbalance @ model.T
    weight = 1.0 / np.diag(free.covariance).real  # all the same without freedom
    factors = np.zeros(readings, dtype=complex)
    away = predicted - predicted.mean(axis=0)
    measured = vectors - vectors.mean(axis=0)
    for k in range(readings):
        same = slice(k, None, readings)
        a, b = away[:, same], measured[:, same]
        factors[k] = (weight[same] * a.conj() * b).sum() / (weight[same] * np.abs(a) ** 2).sum()
    coefficients = model * np.tile(factors, model.shape[0] // readings)[:, None]
    return influence_of(coefficients, vectors, unbalance)

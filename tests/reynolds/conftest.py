"""Bearings shared by the film tests, and the fit of an order of convergence."""

from collections.abc import Sequence

import numpy as np

from reynolds import GasBearing, Injector
from shared import shared

RADIUS, LENGTH, CLEARANCE = 0.02, 0.04, 25e-6


def build_plain(n_theta: int = 64, n_z: int = 16, length: float = LENGTH, **options) -> GasBearing:
    """Plain bearing D = 40 mm, c = 25 um in air."""
    return GasBearing(RADIUS, length, CLEARANCE, n_theta=n_theta, n_z=n_z, **options)


def build_injected(n_theta: int = 32, n_z: int = 16, law: dict | None = None, **options) -> GasBearing:
    """The same with four injectors at its midplane: top, right, bottom, left."""
    angles = np.radians([90.0, 0.0, -90.0, 180.0])
    injectors = tuple(Injector(float(angle), **(law or {})) for angle in angles)
    return build_plain(n_theta, n_z, injectors=injectors, **options)


def fitted_order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of log error over log of the number of intervals or steps."""
    return -float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


plain = shared(build_plain)
injected = shared(build_injected)
order = shared(fitted_order)

"""Re-calibration with the noise floor: fit, determine the discretisation error at the fitted point, fit again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rotorsim.discrepancy.fit.calibration import LAW, MESH, calibration
from rotorsim.discrepancy.fit.least_squares import ParameterFit, fit, singular_directions
from rotorsim.discrepancy.fit.parameters import DIRECTIONS, FitParameter
from rotorsim.discrepancy.fit.stiffness_scan import nearest
from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.residuals.floor import TOLERANCE
from rotorsim.discrepancy.residuals.localise import flagged, table
from rotorsim.discrepancy.twin.sensitivity_cache import columns
from rotorsim.discrepancy.twin.twin import Twin

MOST_REPEATS = 2
IMPLAUSIBLE = 3.0
"""Standard deviations of its prior beyond which a calibration parameter is not believed."""
ROUGH = 0.02
"""Tolerance of the first fit, before the solver is proven."""


def recalibrate(
    comparison: TwinComparison,
    fine: Twin | None,
    tolerance: float = TOLERANCE,
    progress: Callable[[], None] = lambda: None,
    law: tuple[Twin, Mapping[FitParameter, float]] | None = None,
) -> ParameterFit:
    """Fit the calibration parameters; sets the comparison's noise floor and discretisation correction."""
    points = len({(round(t.speed, 1), round(t.pressure, -3)) for t in comparison.trials})
    parameters: tuple[FitParameter, ...] = calibration(comparison.twin, points)
    start = nearest(comparison, parameters, progress)
    comparison.set_floor(start, None, max(tolerance, ROUGH))
    raw = columns(comparison, start, parameters, progress)
    rough = fit(comparison, start, parameters, raw / comparison.sigma[:, None], steps=3, progress=progress)
    rough = closer(comparison, rough, progress)
    first = comparison.sigma.copy()
    comparison.set_floor(rough.point, fine, tolerance, *(law or ()))
    J = rough.J * (first / comparison.sigma)[:, None]
    for parameter in (MESH, LAW):
        if parameter.key in comparison.directions:
            parameters = (*parameters, parameter)
            J = np.column_stack([J, comparison.directions[parameter.key] / comparison.sigma])
    return fit(comparison, rough.point, parameters, J, progress=progress)


def null_vectors(there: ParameterFit, parameters: Sequence[FitParameter]) -> list[dict[str, float]]:
    """Combinations of calibration parameters that the records do not determine; Jacobian at the point."""
    free = [k for k in parameters if not k.trend and k not in (MESH, LAW)]
    return singular_directions(there.J[:, [there.parameters.index(k) for k in free]], free)


def closer(comparison: TwinComparison, rough: ParameterFit, progress: Callable[[], None]) -> ParameterFit:
    """Continue a fit that ended far from the records with new Jacobians, as long as the misfit falls."""
    for _ in range(MOST_REPEATS):
        if not flagged(table(comparison, rough.residual)):
            break
        J = comparison.jacobian(rough.point, rough.parameters, progress=progress)
        again = fit(comparison, rough.point, rough.parameters, J, rough.residual, progress=progress)
        enough = again.cost > 0.9 * rough.cost
        rough = again
        if enough:
            break
    return rough


def strained(base: ParameterFit) -> list[str]:
    """Names of the machine's calibration parameters that a fit has moved to their limits or beyond their priors.

    Not those that shift the data alone, nor trends.
    """
    found = []
    for parameter, value in zip(base.parameters, base.vector, strict=True):
        if parameter.trend or parameter.key in DIRECTIONS:
            continue
        at_limit = value <= parameter.low or value >= parameter.high
        if at_limit or abs(value) > IMPLAUSIBLE * parameter.sd:
            found.append(parameter.name)
    return found


def relinearised(
    comparison: TwinComparison, base: ParameterFit, progress: Callable[[], None] = lambda: None
) -> ParameterFit:
    """Repeat a fit with the Jacobian at its own solution."""
    J = comparison.jacobian(base.point, base.parameters, progress=progress)
    return fit(comparison, base.point, base.parameters, J, base.residual, steps=3, progress=progress)

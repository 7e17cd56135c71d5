"""Re-calibration, with the floor found on the way: fit, prove the solver at the fitted point, fit again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.calibration import LAW, MESH, calibration
from rotorsim.discrepancy.comparison import Comparison
from rotorsim.discrepancy.fit import Fit, fit, singular_directions
from rotorsim.discrepancy.floor import TOLERANCE
from rotorsim.discrepancy.knobs import Knob
from rotorsim.discrepancy.localise import flagged, table
from rotorsim.discrepancy.nearest import nearest
from rotorsim.discrepancy.store import columns
from rotorsim.discrepancy.twin import Twin

MOST_RENEWALS = 2
ROUGH = 0.02
"""Tolerance of the first fit, before the solver is proven."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Re-calibrated fit, null vectors."""

    fit: Fit
    null: list[dict[str, float]]


def recalibrate(
    comparison: Comparison,
    fine: Twin | None,
    tolerance: float = TOLERANCE,
    say: Callable[[], None] = lambda: None,
    law: tuple[Twin, float] | None = None,
) -> Calibrated:
    """Fit the calibration; sets the comparison's floor and correction."""
    points = len({(round(t.speed, 1), round(t.pressure, -3)) for t in comparison.trials})
    knobs: tuple[Knob, ...] = calibration(comparison.twin, points)
    start = nearest(comparison, knobs, say)
    comparison.set_floor(start, None, max(tolerance, ROUGH))
    raw = columns(comparison, start, knobs, say)
    rough = fit(comparison, start, knobs, raw / comparison.sigma[:, None], steps=3, say=say)
    rough = closer(comparison, rough, say)
    first = comparison.sigma.copy()
    comparison.set_floor(rough.point, fine, tolerance, *(law or ()))
    J = rough.J * (first / comparison.sigma)[:, None]
    for knob in (MESH, LAW):
        if knob.key in comparison.directions:
            knobs = (*knobs, knob)
            J = np.column_stack([J, comparison.directions[knob.key] / comparison.sigma])
    done = fit(comparison, rough.point, knobs, J, say=say)
    free = [i for i, k in enumerate(done.knobs) if not k.trend and k not in (MESH, LAW)]
    null = singular_directions(done.J[:, free], [done.knobs[i] for i in free])
    return Calibrated(done, null)


def closer(comparison: Comparison, rough: Fit, say: Callable[[], None]) -> Fit:
    """A fit that ended far from the records goes on with Jacobians taken where it stands, as long as that helps."""
    for _ in range(MOST_RENEWALS):
        if not flagged(table(comparison, rough.residual)):
            break
        J = comparison.jacobian(rough.point, rough.knobs, say=say)
        again = fit(comparison, rough.point, rough.knobs, J, rough.residual, say=say)
        enough = again.cost > 0.9 * rough.cost
        rough = again
        if enough:
            break
    return rough


def renewed(comparison: Comparison, base: Fit, say: Callable[[], None] = lambda: None) -> Fit:
    """The same fit with its Jacobian taken at its own point, and fitted once more."""
    J = comparison.jacobian(base.point, base.knobs, say=say)
    return fit(comparison, base.point, base.knobs, J, base.residual, steps=3, say=say)

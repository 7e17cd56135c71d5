"""Start of a re-calibration: scan of the shaft stiffness, in which sharp resonances are strongly nonlinear.

A resonance that is off by more than its own width gives Gauss-Newton no slope to go down. The shaft's stiffness moves
them all; it is tried in steps of about such a width over its prior, and the best is where the fit begins.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.residuals.comparison import ParameterPoint, TwinComparison

KEY = "shaft_stiffness"
REACH, STEPS, FINER = 2.5, 21, 2
"""Scan to so many standard deviations of the prior, in so many steps, and refine so many times."""


def nearest(
    comparison: TwinComparison, parameters: tuple[FitParameter, ...], progress: Callable[[], None]
) -> ParameterPoint:
    """Point with the shaft stiffness that best fits the excited lines; origin for a machine without it."""
    parameter = next((k for k in parameters if k.key == KEY), None)
    if parameter is None:
        return ParameterPoint()
    layout = comparison.layout
    bands = [i for i, name in enumerate(layout.groups) if name.endswith("band") or name == "resonance"]
    counted = np.isin(layout.group, bands) & (layout.frequency > 0)
    if not counted.any():
        counted = layout.frequency > 0
    tried: dict[float, float] = {}
    values = np.linspace(-REACH, REACH, STEPS) * parameter.sd
    for _ in range(1 + FINER):
        for value in values:
            v = float(np.round(np.clip(value, parameter.low, parameter.high), 6))
            if v not in tried:
                r = (comparison.measured - comparison.predict(ParameterPoint({parameter: v})))[counted]
                tried[v] = float(r @ r)
                progress()
        best = min(tried, key=lambda v: (tried[v], v))
        gap = abs(values[1] - values[0]) / 3
        values = best + gap * np.array([-1.0, 1.0])
    return ParameterPoint({parameter: best}) if best else ParameterPoint()

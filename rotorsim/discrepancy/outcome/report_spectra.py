"""Spectra of measurement and residuals for the report."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.discrepancy.residuals.comparison import Comparison, Point


def spectra_of(comparison: Comparison, points: list[Point | None]) -> list[dict[str, Any]]:
    """For each record: frequencies [Hz] and magnitudes [m] (2, lines) of measurement, residuals, floor."""
    layout, stages, last = comparison.layout, [], np.zeros(0)
    for point in points:
        if point is not None:
            last = comparison.measured - comparison.predict(point) - comparison.correction
        stages.append(last)
    out = []
    for i, trial in enumerate(comparison.trials):
        own = [np.flatnonzero((layout.record == i) & (layout.channel == c))[2:] for c in range(2)]
        half = len(own[0]) // 2

        def size(vector: np.ndarray, own: list[np.ndarray] = own, half: int = half) -> np.ndarray:
            return np.array([np.hypot(vector[o[:half]], vector[o[half:]]) for o in own])

        out.append(
            {
                "record": trial.name,
                "point": trial.point,
                "speed": trial.speed,
                "frequency": trial.frequencies[1:],
                "measured": size(comparison.measured),
                "stages": [size(s) for s in stages],
                "floor": size(comparison.sigma),
            }
        )
    return out

"""Spectra of measurement and residuals for the report."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.residuals.comparison import ParameterPoint, TwinComparison


def spectra_of(comparison: TwinComparison, points: list[ParameterPoint | None]) -> list[dict[str, Any]]:
    """For each record: frequencies [Hz] and magnitudes [m] (2, lines) of measurement, residuals, floor.

    Of vectors also orders, speeds (rows,) [rad/s] and complex amplitudes (2, orders, rows) [m], measured and simulated.
    """
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
                "channels": trial.channels,
                "frequency": trial.frequencies[1:],
                "measured": size(comparison.measured),
                "stages": [size(s) for s in stages],
                "floor": size(comparison.sigma),
            }
            | (_vectors(trial, own, comparison.measured, stages) if trial.orders else {"orders": ()})
        )
    return out


def _vectors(trial: Trial, own: list[np.ndarray], measured: np.ndarray, stages: list[np.ndarray]) -> dict[str, Any]:
    """Complex amplitudes of a run-up's table; `own` are the numbers of both channels in a data vector."""
    half, rows = len(own[0]) // 2, trial.rows_of_vectors

    def complexes(vector: np.ndarray) -> np.ndarray:
        return np.array([vector[o[:half]] + 1j * vector[o[half:]] for o in own]).reshape(2, -1, rows)

    return {
        "orders": trial.orders,
        "speeds": np.array([trial.speed_at(1 + line) for line in range(rows)]),
        "measured_vectors": complexes(measured),
        "simulated_vectors": [complexes(measured - left) for left in stages],
    }

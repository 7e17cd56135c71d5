"""Gap between simulation and measurement [um rms] by channel and operating point, at each stage of a diagnosis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorsim.discrepancy.residuals.comparison import ParameterPoint, TwinComparison

if TYPE_CHECKING:
    import xarray as xr

STAGES = ("nominal", "re-calibrated", "with effect", "floor")


def rms(comparison: TwinComparison, vector: np.ndarray) -> np.ndarray:
    """Time-domain rms (records, 2) [m] of a data vector (n,) [m], from its mean and lines; over all rows of vectors."""
    layout = comparison.layout
    power = np.where(layout.frequency == 0, vector**2, vector**2 / 2)
    power = np.where(layout.drift, 0.0, power) / np.array([t.rows_of_vectors for t in comparison.trials])[layout.record]
    out = np.zeros((len(comparison.trials), 2))
    np.add.at(out, (layout.record, layout.channel), power)
    return np.sqrt(out)


def gap_of(comparison: TwinComparison, points: list[ParameterPoint | None]) -> np.ndarray:
    """Gap (records, 2, stages) [m] at fitted points; None repeats the previous stage; the last is the floor."""
    out, last = [], np.zeros(0)
    for point in points:
        if point is not None:
            last = comparison.measured - comparison.predict(point) - comparison.correction
        out.append(rms(comparison, last))
    noise = np.zeros_like(comparison.sigma)
    if comparison.scatter is not None:
        scatter, means, _ = comparison.scatter
        for i, trial in enumerate(comparison.trials):
            for c in range(2):
                own = np.flatnonzero((comparison.layout.record == i) & (comparison.layout.channel == c))
                lines = scatter[i, c, 1 : trial.spectra.shape[2]]
                noise[own] = np.concatenate([[means[i, c], 0.0], lines, lines])
    out.append(rms(comparison, noise))
    return np.stack(out, axis=2)


def gap_dataset(parts: dict[str, tuple[TwinComparison, np.ndarray]]) -> xr.Dataset:
    """Gaps of all records as a Dataset: gap(record, axis, stage) [m] with role and operating point.

    Of a single probe x holds its reading, and y is NaN.
    """
    import xarray as xr

    names, roles, points, values = [], [], [], []
    for role, (comparison, gap) in parts.items():
        for trial, one in zip(comparison.trials, gap, strict=True):
            names.append(trial.name)
            roles.append(role)
            points.append(trial.point)
            one[len(trial.channels) :] = np.nan
            values.append(one)
    coords = {"record": names, "axis": ["x", "y"], "stage": list(STAGES)}
    data = np.array(values).reshape(len(names), 2, len(STAGES))
    attrs = {"units": "m", "long_name": "rms of measured less simulated"}
    dataset = xr.Dataset({"gap": (("record", "axis", "stage"), data, attrs)}, coords, {"kind": "gap"})
    return dataset.assign_coords(role=("record", roles), point=("record", points))


def reduction(dataset: xr.Dataset, role: str = "untouched") -> float:
    """Reduction of the gap from re-calibrated to with effect, as a fraction, scatter subtracted.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.discrepancy.reduction(rs.diagnose("dtu_gas_bearing", "puzzle/records").gap)  # doctest: +SKIP
    """
    chosen = dataset["gap"].values[dataset["role"].values == role]
    if not len(chosen):
        return float("nan")
    squares = np.nansum(chosen**2, axis=(0, 1))
    before, after = squares[1] - squares[3], squares[2] - squares[3]
    return float(1 - np.sqrt(max(after, 0.0) / before)) if before > 0 else 0.0

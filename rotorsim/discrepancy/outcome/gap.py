"""Gap between simulation and measurement at each stage of a diagnosis: rms, spectra, bands that the model misses.

The rms [um] is that by channel and operating point. Of a run-up's vectors an amplitude is missed by more than a tenth
of the order's largest one, a phase by more than 15 deg. Phases of amplitudes, and orders, that are hardly above their
floor do not count.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.twin.parameters import ParameterPoint
from rotorsim.discrepancy.twin.plant import NO_SOLUTION

if TYPE_CHECKING:
    import xarray as xr

STAGES = ("nominal", "re-calibrated", "with effect", "floor")
"""Stages of a diagnosis whose gap is shown."""
MISSED_AMPLITUDE, MISSED_PHASE = 0.10, np.deg2rad(15.0)
"""Share of an order's largest amplitude, and phase [rad], by which a row is missed."""
ABOVE = 3.0
"""Amplitude over its floor below which it has no phase."""
NEAR_BANDS = 0.05
"""Distance of two bands, as a share of all rows, below which they are one."""


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


def spectra_of(comparison: TwinComparison, points: list[ParameterPoint | None]) -> list[dict[str, Any]]:
    """Frequencies [Hz] and magnitudes [m] (2, lines) of measurement, residuals and floor, record by record.

    Of vectors also orders, speeds (rows,) [rad/s] and complex amplitudes (2, orders, rows) [m], measured and simulated.
    """
    stages, last = [], np.zeros(0)
    for point in points:
        if point is not None:
            last = comparison.measured - comparison.predict(point) - comparison.correction
        stages.append(last)
    out = []
    for i, trial in enumerate(comparison.trials):
        measured = comparison.lines_of(i, comparison.measured)
        left = [comparison.lines_of(i, stage) for stage in stages]
        out.append(
            {
                "record": trial.name,
                "point": trial.point,
                "speed": trial.speed,
                "channels": trial.channels,
                "frequency": trial.frequencies[1:],
                "measured": _size(measured),
                "stages": [_size(lines) for lines in left],
                "floor": _size(comparison.lines_of(i, comparison.sigma)),
            }
            | (_vectors(trial, measured, left) if trial.orders else {"orders": ()})
        )
    return out


def _size(lines: np.ndarray) -> np.ndarray:
    """Magnitudes of complex lines."""
    return np.hypot(lines.real, lines.imag)


def _vectors(trial: Trial, measured: np.ndarray, left: list[np.ndarray]) -> dict[str, Any]:
    """Complex amplitudes of a run-up's table, from its measured lines and what each stage leaves (2, k) [m]."""
    rows = trial.rows_of_vectors
    return {
        "orders": trial.orders,
        "speeds": np.array([trial.speed_at(1 + line) for line in range(rows)]),
        "measured_vectors": measured.reshape(2, -1, rows),
        "simulated_vectors": [(measured - one).reshape(2, -1, rows) for one in left],
    }


def missed_bands(shown: Iterable[dict[str, Any]], model: str = "the model") -> list[str]:
    """Sentences on the rows of vectors that `spectra_of` shows, an order and channel each; none for records."""
    parts = [one for one in shown if one["orders"]]
    tables: dict[str, list[dict[str, Any]]] = {}
    for one in parts:
        tables.setdefault(one["record"].rpartition(",")[0], []).append(one)
    return [
        f"{name}, {channel}, {order}X: {model} misses {missed}"
        for name, own in tables.items()
        for k, order in enumerate(own[0]["orders"])
        for c, channel in enumerate(own[0]["channels"])
        if (missed := _missed(*_rows(own, c, k)))
    ]


def _rows(parts: Sequence[dict[str, Any]], channel: int, number: int) -> tuple[np.ndarray, ...]:
    """Speeds (k,) [rad/s] that rise, measured and simulated vectors and floors (k,) [m] of all parts of a table."""
    speed = np.concatenate([one["speeds"] for one in parts])
    measured = np.concatenate([one["measured_vectors"][channel, number] for one in parts])
    simulated = np.concatenate([one["simulated_vectors"][-1][channel, number] for one in parts])
    floor = np.concatenate([one["floor"][channel].reshape(-1, len(one["speeds"]))[number] for one in parts])
    rising = np.argsort(speed)
    return speed[rising], measured[rising], simulated[rising], floor[rising]


def _missed(speed: np.ndarray, measured: np.ndarray, simulated: np.ndarray, floor: np.ndarray) -> str:
    """Text on the missed amplitude and phase: largest miss and bands of speed; empty where nothing is missed."""
    clear = np.abs(measured) > ABOVE * floor
    if not clear.any():
        return ""
    if np.abs(simulated).max() > NO_SOLUTION / 2:
        return f"all: it has no solution at {_bands(speed, np.abs(simulated) > NO_SOLUTION / 2)}"
    top = float(np.abs(measured).max())
    off = np.abs(np.abs(simulated) - np.abs(measured))
    turned = np.where(clear, np.abs(np.angle(simulated * np.conj(measured))), 0.0)
    found = []
    if off.max() > MISSED_AMPLITUDE * top:
        worst = f"up to {off.max() * TO_UM:.3g} um ({100 * off.max() / top:.0f} % of its peak)"
        found.append(f"the amplitude by {worst} at {_bands(speed, off > MISSED_AMPLITUDE * top)}")
    if turned.max() > MISSED_PHASE:
        found.append(f"the phase by up to {np.rad2deg(turned.max()):.0f} deg at {_bands(speed, turned > MISSED_PHASE)}")
    return " and ".join(found)


def _bands(speed: np.ndarray, missed: np.ndarray) -> str:
    """Bands of speeds as text: rows that are missed, those near to each other joined."""
    rows = np.flatnonzero(missed)
    near = max(2, round(NEAR_BANDS * len(speed)))
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > near) + 1)
    rpm = speed * TO_RPM
    ends = [(f"{rpm[run[0]]:.0f}", f"{rpm[run[-1]]:.0f}") for run in runs]
    return ", ".join(low if low == high else f"{low}-{high}" for low, high in ends) + " rpm"

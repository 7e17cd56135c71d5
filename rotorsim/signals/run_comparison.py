"""Orders of several runs over the speed, side by side: their peaks, and how these differ from the first run's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.signals.order_tracking import find_resonances, track_orders
from rotorsim.signals.prepare import prepared

NEAR = 0.2
"""Peaks of two runs belong together where their speeds differ by less than this share."""


@dataclass(frozen=True, eq=False)
class RunComparison:
    """Orders by the name of the run: `amplitude` (window, order, axis) complex [m, 0-pk] over `speed` [rad/s]."""

    tracked: Mapping[str, xr.Dataset]
    order: int

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes that some run has."""
        every = {str(axis) for one in self.tracked.values() for axis in one["axis"].values}
        return tuple(sorted(every))

    def peaks(self) -> list[dict[str, Any]]:
        """Peaks of the order: run, axis, rpm, um (0-pk), phase_lag_deg, and rpm_change, um_change from the first run.

        A change is a share of the first run's value, None where that has no peak near; a phase lag is within half a
        turn of that of the near peak.
        """
        rows: list[dict[str, Any]] = []
        first = next(iter(self.tracked))
        for name, tracked in self.tracked.items():
            for axis in self.axes:
                for peak in _peaks(tracked, self.order, axis):
                    own = [p for p in rows if p["run"] == first and p["axis"] == axis]
                    rows.append({"run": name, **peak, **(_change(peak, own) if name != first else {})})
        return rows


def compare_runs(runs: Mapping[str, xr.Dataset], order: int = 1) -> RunComparison:
    """Track an order of several runs, which may be records over time or run-up vectors.

    Parameters
    ----------
    runs : Datasets by name
        At least two; the first is what the others are compared with.
    order : int
        Multiple of the shaft speed.

    Raises
    ------
    DataError
        For fewer than two runs, a run without displacement or angle, without a turning shaft, or without the order.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.signals.compare_runs({"before": runup, "after": runup}).peaks()[0]["run"]
    'before'
    """
    if isinstance(runs, xr.Dataset) or not isinstance(runs, Mapping):
        raise DataError(
            f"runs: a {type(runs).__name__}; give Datasets by name, e.g. {{'before': first, 'after': second}}"
        )
    if len(runs) < 2:
        raise DataError(f"compare: {len(runs)} run; give at least two")
    return RunComparison({name: _orders(name, run, order) for name, run in runs.items()}, order)


def _orders(name: str, run: xr.Dataset, order: int) -> xr.Dataset:
    """The order over the speed, of a record or of a table of vectors."""
    if "speed" in run.dims:
        if order not in run["order"].values:
            raise DataError(f"{name}: holds no {order}X; its orders are {', '.join(map(str, run['order'].values))}")
        found = run.sel(order=[order]).rename(speed="window")
        amplitude = found["amplitude"] * np.exp(-1j * found["phase"])
        coords = {"speed": ("window", run["speed"].values), "time": ("window", np.full(run.sizes["speed"], np.nan))}
        return xr.Dataset({"amplitude": amplitude.drop_vars("window")}, coords)
    try:
        found = track_orders(prepared(run), [order])
    except DataError as error:
        raise DataError(f"{name}: {error}") from error
    if not found.sizes["window"]:
        raise DataError(f"{name}: the shaft does not turn for eight revolutions; there is no {order}X")
    return found[["amplitude"]]


def _peaks(tracked: xr.Dataset, order: int, axis: str) -> list[dict[str, Any]]:
    if axis not in tracked["axis"].values:
        return []
    kept = ("axis", "rpm", "um", "phase_lag_deg", "local_maximum")
    return [{key: peak[key] for key in kept} for peak in find_resonances(tracked, order, axis)]


def _change(peak: dict[str, Any], of_first: list[dict[str, Any]]) -> dict[str, float | None]:
    """Relative changes of speed and amplitude from the nearest peak of the first run, and the phase lag next to its."""
    near = min(of_first, key=lambda p: abs(p["rpm"] - peak["rpm"]), default=None)
    if near is None or abs(near["rpm"] - peak["rpm"]) > NEAR * abs(peak["rpm"]) or not near["um"]:
        return {"rpm_change": None, "um_change": None}
    turns = round((peak["phase_lag_deg"] - near["phase_lag_deg"]) / 360)
    return {
        "phase_lag_deg": peak["phase_lag_deg"] - 360 * turns,
        "rpm_change": peak["rpm"] / near["rpm"] - 1,
        "um_change": peak["um"] / near["um"] - 1,
    }

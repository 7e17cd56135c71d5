"""Slow roll: whole revolutions at low speed, where the sensors measure runout and no vibration.

The thesis (section 2.6.2) takes less than 200 rpm, where the vibration is negligible, and averages over revolutions.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.units import TO_UM, show
from rotorsim.experiments.experiment import PointExperiment, pair, param, register
from rotorsim.experiments.functions import as_function

if TYPE_CHECKING:
    import xarray as xr

SLOW = 2 * np.pi * 100 / 60
"""100 rpm [rad/s]."""
SLOWEST = 1e-5
"""Speed [rad/s] at which a revolution takes a week."""
SHOWN = 4
"""Number of orders of the runout in a summary."""
LEAST = 0.05
"""Amplitude of an order of the runout in a summary, over that of the largest."""


@register
@dataclass(frozen=True)
class SlowRoll(PointExperiment):
    """Whole revolutions so slowly that the sensors see runout; ends with the sample that completes them.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.SlowRoll(speed=60.0, pressure=0.5e6, revolutions=2).samples
    1048
    """

    name: ClassVar[str] = "slow_roll"
    example: ClassVar[str] = "--speed '100 rpm' --revolutions 5"
    figures: ClassVar[tuple[str, ...]] = ("runout_profile", "spectra", "against_time")
    speed: float = param("rad/s", "Shaft speed.", SLOW, above=0)
    revolutions: int = param("1", "Whole revolutions.", 5, low=1, multiple=1)

    def check(self) -> None:
        """Refuse revolutions that never end."""
        if self.speed < SLOWEST:
            raise DataError(f"speed = {show(self.speed, 'rad/s')}: a revolution would last over a week; turn faster")

    @property
    def samples(self) -> int:
        """Length in samples."""
        return ceil(self.revolutions * 2 * np.pi / (self.speed * self.Ts) * (1 - 1e-12))

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        return self.held(count)

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Runout [um] by order of the shaft angle, why it is none, and the sensors' readings less the true motion."""
        from rotorsim.signals.record_blocks import blocks

        found = runout_of(record)
        if "disc" not in record or "disc_measured" not in record:
            return found
        pairs = blocks(record, ["disc", "disc_measured"])
        apart = np.max([np.abs(block["disc_measured"] - block["disc"]).max(axis=0) for block in pairs], axis=0)
        return found | {"sensor_error_peak_um": (apart * TO_UM).tolist()}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Rows of the runout and of the sensors' error."""
        rows = []
        if peak := summary.get("runout_peak_um"):
            rows.append(("Runout: peak", pair(peak, "µm")))
        rows += [(f"Runout: {row['order']}X", pair(row["um"], "µm 0-pk")) for row in summary.get("runout_orders", ())]
        if why := summary.get("no_slow_roll"):
            rows.append(("No slow roll", why))
        found = summary.get("sensor_error_peak_um")
        return rows + ([("Measured less true displacement: peak", pair(found, "µm"))] if found else [])


def runout_of(record: xr.Dataset) -> dict[str, Any]:
    """Runout of a slow roll as a law would take it off: peaks [um], the largest orders, and why it is none."""
    from rotorsim.control.runout import runout_table

    try:
        table = runout_table(record)
    except RotorsimError as error:
        return {"no_slow_roll": str(error).removeprefix("runout: ")}
    size = 2 * np.abs(np.fft.rfft(table.values, axis=0)) / len(table.values)
    largest = size.max(axis=1)
    orders = sorted(np.argsort(-largest)[:SHOWN].tolist())
    return {
        "runout_peak_um": (table.peak * TO_UM).tolist(),
        "runout_orders": [
            {"order": n, "um": (size[n] * TO_UM).tolist()} for n in orders if largest[n] > LEAST * largest.max()
        ],
    }


slow_roll = as_function(SlowRoll)

"""Staircase of the reference up and down, for static gain and hysteresis (thesis C.3.1, C.8).

From 0 up to +amplitude, down to -amplitude and up to 0 again, so that all levels but the ends are met in either
direction; on both axes one after the other. `static_gain_map` makes the static characteristic of it.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_UM
from rotorsim.experiments.experiment import DRIVEN, REFERENCE_LIMIT, PointExperiment, pair, param, register
from rotorsim.experiments.functions import as_function

if TYPE_CHECKING:
    import xarray as xr

MOST = 100_000
"""Steps from 0 to the amplitude."""
SLACK = 1e-5
"""Relative error of a step written with six digits."""


@register
@dataclass(frozen=True)
class Staircase(PointExperiment):
    """Reference stepwise up to the amplitude, down to its negative and back to 0, for static gains and hysteresis.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Staircase(pressure=0.5e6, axis="x", amplitude=1.0, step=0.5, hold=0.02).samples
    900
    """

    name: ClassVar[str] = "staircase"
    drives_reference: ClassVar[bool] = True
    example: ClassVar[str] = "--pressure '0.6 MPa' --axis both --amplitude '2 V' --step '0.5 V'"
    figures: ClassVar[tuple[str, ...]] = ("static_gain", "hysteresis_loops", "excitation", "against_time")
    axis: str = param("1", "Driven axis; both drives y after x.", "x", choices=tuple(DRIVEN))
    amplitude: float = param("V", "Highest level.", 2.0, above=0, high=REFERENCE_LIMIT)
    step: float = param("V", "Height of a step.", 0.5, above=0)
    hold: float = param("s", "Time at a level.", 0.5, above=0, samples=True)

    def check(self) -> None:
        """Refuse steps that do not add up to the amplitude."""
        steps = self.amplitude / self.step
        fault = ""
        if steps > MOST:
            fault = f"makes more than {MOST} steps up to the amplitude of {self.amplitude:g} V"
        elif abs(steps - round(steps)) > min(SLACK * steps, 0.01) or round(steps) < 1:
            fault = f"does not divide the amplitude of {self.amplitude:g} V"
        if fault:
            raise DataError(
                f"step: '{self.step:g} V' {fault}; give e.g. '{self._near_step()} V'", argument="step", value=self.step
            )

    def _near_step(self) -> str:
        """A step that divides the amplitude, of few digits and near to the one given."""
        near = [f"{self.amplitude / n:.6g}" for n in range(1, 101)]
        return min(near, key=lambda text: (max(len(text), 4), abs(float(text) - self.step)))

    def levels(self) -> np.ndarray:
        """Reference (n, 2) [V] of every step."""
        n = round(self.amplitude / self.step)
        path = np.concatenate([np.arange(n + 1), np.arange(n - 1, -n - 1, -1), np.arange(1 - n, 1)])
        axes = DRIVEN[self.axis]
        levels = np.zeros((len(axes) * len(path), 2))
        for turn, axis in enumerate(axes):
            levels[turn * len(path) : (turn + 1) * len(path), axis] = path * self.step
        return levels

    @property
    def samples(self) -> int:
        """Length in samples."""
        n = round(self.amplitude / self.step)
        return len(DRIVEN[self.axis]) * (4 * n + 1) * self.samples_in(self.hold)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        rows[:, 2:4] = self.levels()[(first + np.arange(count)) // self.samples_in(self.hold)]
        return rows

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Static gains and deviations from them [um/V, um] by driven axis; none of steps that are too short or few."""
        from rotorsim.signals.static_gain import static_gain_map

        if record.attrs.get("ended", "complete") != "complete":
            return {}
        try:
            found = static_gain_map(record)
        except DataError:
            return {}
        gains: dict[str, Any] = {}
        for axis in found["input"].values:
            column = found.sel(input=axis)
            gains[str(axis)] = {"gain_um_per_v": (column["gain"].values * TO_UM).tolist()} | {
                f"{name}_um": (column[name].values * TO_UM).tolist()
                for name in ("deviation_max", "deviation_rms", "hysteresis")
            }
        return {"static_gain": gains}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Rows of the static gains."""
        rows = []
        for axis, found in summary.get("static_gain", {}).items():
            rows.append((f"Static gain of r_{axis} on x, y", pair(found["gain_um_per_v"], "µm/V")))
            rows.append(("  largest deviation from linear", pair(found["deviation_max_um"], "µm")))
            rows.append(("  rms deviation from linear", pair(found["deviation_rms_um"], "µm")))
            rows.append(("  opening between up and down", pair(found["hysteresis_um"], "µm")))
        return rows


staircase = as_function(Staircase)

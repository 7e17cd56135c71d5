r"""Impact hammer: half-sine pulses of force on the disc or elsewhere on the shaft.

.. math:: F(t) = A \sin(\pi t/T), \quad 0 \le t \le T, \qquad \int F\,dt = 2 A T/\pi

Force is held during a sample, so a sample gets the pulse's mean over it: the impulse is exact whatever T and whenever
the pulse begins. The record's `disc_force` is what a force transducer in the hammer's tip would show; its attribute
`force_position` [m] states where the shaft was hit if that was not the disc.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.units import show
from rotorsim.experiments.experiment import PointExperiment, generator, pair, param, register, sequence
from rotorsim.experiments.functions import as_function

if TYPE_CHECKING:
    import xarray as xr

KEY = 3
"""First key of this experiment's random numbers."""


@register
@dataclass(frozen=True)
class Impact(PointExperiment):
    """Half-sine hits of an impact hammer.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Impact(pressure=0.5e6, peak=20.0, hits=2, spacing=0.1).samples
    1500
    """

    name: ClassVar[str] = "impact"
    example: ClassVar[str] = "--peak '20 N' --width '1 ms' --angle '90 deg' --hits 5"
    figures: ClassVar[tuple[str, ...]] = ("ring_down", "response_to_force", "excitation", "against_time")
    peak: float = param("N", "Peak of the force.", 20.0, above=0)
    width: float = param("s", "Duration of a hit.", 1e-3, low=0, sampled=True)
    angle: float = param("rad", "Direction of the force: 0 is x, 90 deg is y.", 0.0)
    hits: int = param("1", "Number of hits.", 1, low=1, multiple=1)
    spacing: float = param("s", "Time from hit to hit, also after the last.", 1.0, above=0, samples=True)
    lead: float = param("s", "Time before the first hit.", 0.1, low=0, samples=True)
    jitter: float = param("s", "A hit is late by a random time up to this.", 0.0, low=0)
    scatter: float = param("1", "A hit is stronger or weaker by a random share up to this.", 0.0, low=0, high=1)
    sequence: int = sequence()
    position: float | None = param(
        "m", "Position of the hits along the shaft; the disc's by default.", None, attribute="force_position"
    )

    def check(self) -> None:
        """Refuse hits that run into each other."""
        if self.width + self.jitter > self.spacing:
            raise DataError(
                f"spacing = {show(self.spacing, 's')}: is shorter than a hit with its jitter; "
                f"give at least {show(self.width + self.jitter, 's')}"
            )

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.lead) + self.hits * self.samples_in(self.spacing)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        edges = (first + np.arange(count + 1)) * self.Ts
        lowest = max(floor((edges[0] - self.lead) / self.spacing) - 1, 0)
        highest = min(ceil((edges[-1] - self.lead) / self.spacing), self.hits - 1)
        force = np.zeros(count)
        for hit in range(lowest, highest + 1):
            force += self.pulse(edges, hit)
        direction = np.round([np.cos(self.angle), np.sin(self.angle)], 15)  # nothing along x at 90 deg
        rows[:, 4:6] = force[:, None] * direction
        return rows

    def pulse(self, edges: np.ndarray, hit: int) -> np.ndarray:
        """Mean force (n,) [N] of one hit between the edges (n + 1,) [s] of the samples."""
        late, off = generator(self.sequence, KEY, hit).uniform(size=2) if self.jitter or self.scatter else (0.0, 0.5)
        begin = self.lead + hit * self.spacing + self.jitter * late
        peak = self.peak * (1 + self.scatter * (2 * off - 1))
        turned = np.clip((edges - begin) / self.width, 0.0, 1.0)
        return np.diff(-np.cos(np.pi * turned)) * (peak * self.width / (np.pi * self.Ts))

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Impulse [N s] of all hits along x and y."""
        from identification.records.sampling import nominal_rate
        from rotorsim.signals.record_blocks import blocks

        total = sum(block["disc_force"].sum(axis=0) for block in blocks(record, ["disc_force"]))
        return {"impulse_n_s": np.asarray(total / nominal_rate(record["time"].values)).tolist()}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Row of the impulse."""
        return [("Impulse of all hits x, y", pair(summary["impulse_n_s"], "N s"))]


impact = as_function(Impact)

"""Steady running at constant speed and supply pressure, without excitation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rotorsim.experiments.experiment import AtPoint, samples_in
from rotorsim.experiments.parameters import param
from rotorsim.experiments.running import run

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.plant.plant import Plant


@dataclass(frozen=True)
class Steady(AtPoint):
    """Steady running at constant speed and supply pressure."""

    name: ClassVar[str] = "steady"
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)

    @property
    def samples(self) -> int:
        """Length in samples."""
        return samples_in(self.duration)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        return self.held(count)


def steady(
    plant: Plant,
    speed: float = 0.0,
    pressure: float = 0.3e6,
    duration: float = 10.0,
    seed: int = 0,
    progress: bool = False,
) -> xr.Dataset:
    """Run at constant `speed` [rad/s] and gauge `pressure` [Pa] for `duration` [s] and return the record."""
    return run(plant, Steady(speed, pressure, duration), seed, progress)

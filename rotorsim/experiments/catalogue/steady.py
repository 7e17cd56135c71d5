"""Steady running at constant speed and supply pressure, without excitation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rotorsim.experiments.experiment import PointExperiment, register
from rotorsim.experiments.functions import as_function
from rotorsim.experiments.parameters import param


@register
@dataclass(frozen=True)
class Steady(PointExperiment):
    """Steady running at constant speed and supply pressure.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Steady(speed=300.0, pressure=0.5e6, duration=0.1).samples
    500
    """

    name: ClassVar[str] = "steady"
    example: ClassVar[str] = "--speed '3000 rpm' --pressure '0.3 MPa' --duration '10 s'"
    figures: ClassVar[tuple[str, ...]] = ("spectrum", "filtered", "waterfall", "overview")
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.duration)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        return self.held(count)


steady = as_function(Steady)

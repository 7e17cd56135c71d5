r"""Pseudo-random binary excitation of both axes, as in the thesis (sections B.4.4, C.3.4).

Each axis jumps between -amplitude and +amplitude, independently of the other, and only at the ticks of a clock of
period `hold`. The thesis gives the levels of 1 V, the "fixed sampling instants" and the 2000 samples without excitation
at the beginning, whose mean is the bias of inputs and outputs, but not the clock. Here a tick comes every 5 ms unless
set otherwise: a held random binary signal has the power density :math:`a^2 T\,\mathrm{sinc}^2(f T)`, which at T = 5 ms
reaches past the rig's natural frequencies at 105 to 132 Hz (a quarter of that at 0 Hz) with its first zero at 200 Hz.

The bits are drawn in groups of 256 with as many of either sign, so a record is balanced; any group can be drawn alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import REFERENCE_LIMIT, PointExperiment, generator, param, register, sequence
from rotorsim.experiments.functions import as_function

GROUP = 256
"""Bits drawn together."""
KEY = 1
"""First key of this experiment's random numbers."""


@register
@dataclass(frozen=True)
class Prbs(PointExperiment):
    """Pseudo-random binary references, independent on x and y, after a time without excitation.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Prbs(speed=300.0, pressure=0.5e6, duration=0.2, bias=0.1).samples
    1000
    """

    name: ClassVar[str] = "prbs"
    drives_reference: ClassVar[bool] = True
    example: ClassVar[str] = "--speed '3000 rpm' --pressure '0.6 MPa' --amplitude '1 V' --duration '10 s' --seed 1"
    figures: ClassVar[tuple[str, ...]] = ("response_to_reference", "excitation", "spectra", "against_time")
    amplitude: float = param("V", "Level of the reference, plus and minus.", 1.0, above=0, high=REFERENCE_LIMIT)
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)
    bias: float = param("s", "Time without excitation at the beginning.", 0.4, low=0, samples=True)
    hold: float = param("s", "Period of the clock: the shortest time between jumps.", 5e-3, above=0, samples=True)
    sequence: int = sequence()

    def check(self) -> None:
        """Refuse a record without excitation."""
        if self.bias >= self.duration:
            raise DataError(
                f"bias = {self.bias:g} s: leaves nothing of the duration of {self.duration:g} s; make the record longer"
            )

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.duration)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        since = first + np.arange(count) - self.samples_in(self.bias)
        excited = since >= 0
        if excited.any():
            ticks = since[excited] // self.samples_in(self.hold)
            for axis in range(2):
                rows[excited, 2 + axis] = self.amplitude * bits(self.sequence, axis, ticks)
        return rows


prbs = as_function(Prbs)


def bits(sequence: int, axis: int, ticks: np.ndarray) -> np.ndarray:
    """Signs (n,) at ascending ticks of the clock."""
    lowest, highest = int(ticks[0]) // GROUP, int(ticks[-1]) // GROUP
    balanced = np.repeat([-1.0, 1.0], GROUP // 2)
    drawn = [generator(sequence, KEY, axis, group).permutation(balanced) for group in range(lowest, highest + 1)]
    return np.concatenate(drawn)[ticks - lowest * GROUP]

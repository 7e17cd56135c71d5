r"""Chirp: swept sine of the reference.

.. math:: r(t) = a \sin 2\pi \int_0^t f\,d\tau, \qquad f = f_0 + (f_1 - f_0)\,t/T
          \quad\text{or}\quad f = f_0 (f_1/f_0)^{t/T}

On both axes the sweeps come one after the other, because at once and with the same signal the columns of the frequency
response could not be separated.

Cites: ljung_1999.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import DRIVEN, REFERENCE_LIMIT, PointExperiment, param, register
from rotorsim.experiments.functions import as_function


@register
@dataclass(frozen=True)
class Chirp(PointExperiment):
    """A swept sine of the reference; on both axes one after the other.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Chirp(speed=300.0, pressure=0.5e6, high=200.0, duration=0.2, bias=0.1).samples
    1500
    """

    name: ClassVar[str] = "chirp"
    drives_reference: ClassVar[bool] = True
    example: ClassVar[str] = "--low '20 Hz' --high '300 Hz' --duration '20 s' --axis both"
    figures: ClassVar[tuple[str, ...]] = ("response_to_reference", "excitation", "spectra", "against_time")
    amplitude: float = param("V", "Amplitude of the reference, 0-pk.", 1.0, above=0, high=REFERENCE_LIMIT)
    low: float = param("Hz", "Frequency at the beginning.", 1.0, above=0, sampled=True)
    high: float = param("Hz", "Frequency at the end.", 400.0, above=0, sampled=True)
    duration: float = param("s", "Length of a sweep.", 10.0, above=0, samples=True)
    axis: str = param("1", "Driven axis; both sweeps y after x.", "x", choices=tuple(DRIVEN))
    law: str = param("1", "How the frequency grows.", "linear", choices=("linear", "logarithmic"))
    bias: float = param("s", "Time without excitation at the beginning.", 0.4, low=0, samples=True)

    def check(self) -> None:
        """Refuse a sweep that stands still."""
        if self.low == self.high:
            raise DataError(f"low and high are both {self.low:g} Hz; give a range to sweep")

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.bias) + len(DRIVEN[self.axis]) * self.samples_in(self.duration)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        since = first + np.arange(count) - self.samples_in(self.bias)
        length = self.samples_in(self.duration)
        for turn, axis in enumerate(DRIVEN[self.axis]):
            now = (since >= turn * length) & (since < (turn + 1) * length)
            rows[now, 2 + axis] = self.amplitude * np.sin(self.phase((since[now] - turn * length) * self.Ts))
        return rows

    def phase(self, time: np.ndarray) -> np.ndarray:
        """Phase [rad] of the sine at a time [s] after the sweep's beginning."""
        if self.law == "linear":
            return 2 * np.pi * time * (self.low + 0.5 * (self.high - self.low) * time / self.duration)
        growth = np.log(self.high / self.low) / self.duration
        return 2 * np.pi * self.low * np.expm1(growth * time) / growth


chirp = as_function(Chirp)

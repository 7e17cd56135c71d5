r"""Multisine excitation of x and y at once, on interleaved frequency lines.

.. math:: r(t) = s \sum_k \cos(2\pi k t/T + \varphi_k), \qquad k \in L_x \text{ or } L_y,\ L_x \cap L_y = \emptyset

Lines are multiples of 1/T, so whole periods have no leakage and every line of the response belongs to one input. All
lines of an axis are equally strong, phases are random; of some draws the one with the lowest crest factor is taken.

Cites: schroeder_1970.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor
from typing import ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import REFERENCE_LIMIT, AtPoint, generator
from rotorsim.experiments.parameters import param, sequence

KEY = 2
"""First key of this experiment's random numbers."""


@dataclass(frozen=True)
class Multisine(AtPoint):
    """Whole periods of multisine references on both axes at once, each with frequency lines of its own.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Multisine(pressure=0.5e6, high=200.0, period=0.1, periods=2).samples
    1000
    """

    name: ClassVar[str] = "multisine"
    drives_reference: ClassVar[bool] = True
    amplitude: float = param("V", "Largest value of the reference.", 1.0, above=0, high=REFERENCE_LIMIT)
    low: float = param("Hz", "Lowest frequency.", 1.0, above=0, sampled=True)
    high: float = param("Hz", "Highest frequency.", 400.0, above=0)
    period: float = param("s", "Period; lines are multiples of its inverse.", 1.0, above=0, high=100.0, samples=True)
    periods: int = param("1", "Whole periods of the record.", 10, low=1, multiple=1)
    spacing: int = param("1", "Distance of neighbouring lines in multiples of 1/period.", 1, low=1, multiple=1)
    tries: int = param(
        "1", "Draws of phases of which the lowest crest factor is taken.", 20, low=1, high=1000, multiple=1
    )
    bias: float = param("s", "Time without excitation at the beginning.", 0.0, low=0, samples=True)
    sequence: int = sequence()

    def check(self) -> None:
        """Refuse lines beyond Nyquist's frequency, and an axis without lines."""
        if self.high >= 0.5 / self.Ts:
            raise DataError(
                f"high = {self.high:g} Hz: is not below half the sampling rate; give less than {0.5 / self.Ts:g} Hz"
            )
        if min(len(axis) for axis in self.lines()) == 0:
            raise DataError(
                f"multisine: fewer than two lines from {self.low:g} to {self.high:g} Hz in steps of "
                f"{self.spacing / self.period:g} Hz; widen the range or take a longer period"
            )

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.bias) + self.periods * self.samples_in(self.period)

    def lines(self) -> tuple[np.ndarray, np.ndarray]:
        """Excited lines of x and of y as multiples of 1/period; disjoint."""
        least, most = ceil(self.low * self.period * (1 - 1e-12)), floor(self.high * self.period * (1 + 1e-12))
        lines = np.arange(least, most + 1, self.spacing)
        return lines[0::2], lines[1::2]

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        since = first + np.arange(count) - self.samples_in(self.bias)
        one = one_period(self)
        rows[:, 2:4] = np.where((since >= 0)[:, None], one[since % len(one)], 0.0)
        return rows


@lru_cache(maxsize=4)
def one_period(sines: Multisine) -> np.ndarray:
    """Reference (n, 2) [V] of one period."""
    n = sines.samples_in(sines.period)
    return np.column_stack([_flattest(sines, generator(sines.sequence, KEY, axis), n, axis) for axis in range(2)])


def _flattest(sines: Multisine, rng: np.random.Generator, n: int, axis: int) -> np.ndarray:
    """The draw with the lowest crest factor, scaled to the amplitude."""
    lines = sines.lines()[axis]
    best = np.full(n, np.inf)
    for _ in range(sines.tries):
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[lines] = np.exp(1j * rng.uniform(0, 2 * np.pi, len(lines)))
        drawn = np.fft.irfft(spectrum, n)
        if np.abs(drawn).max() < np.abs(best).max():
            best = drawn
    return np.asarray(best * (sines.amplitude / np.abs(best).max()))

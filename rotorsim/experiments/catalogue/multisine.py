r"""Multisine excitation of x and y at once, on interleaved frequency lines, or of one axis; about a constant reference.

.. math:: r(t) = m + s \sum_k \cos(2\pi k t/T + \varphi_k), \qquad k \in L_x \text{ or } L_y,\ L_x \cap L_y = \emptyset

Lines are multiples of 1/T, so whole periods have no leakage and every line of the response belongs to one input. All
lines of an axis are equally strong, phases are random; of some draws the one with the lowest crest factor is taken. The
mean m is held from the first sample on: what its step excites dies out during `bias`.

Cites: schroeder_1970.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor
from typing import ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import (
    DRIVEN,
    REFERENCE_LIMIT,
    PointExperiment,
    generator,
    param,
    register,
    sequence,
)
from rotorsim.experiments.functions import as_function

KEY = 2
"""First key of this experiment's random numbers."""


@register
@dataclass(frozen=True)
class Multisine(PointExperiment):
    """Whole periods of multisine references on both axes at once, each with frequency lines of its own, or on one.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Multisine(pressure=0.5e6, high=200.0, period=0.1, periods=2).samples
    1000
    """

    name: ClassVar[str] = "multisine"
    drives_reference: ClassVar[bool] = True
    example: ClassVar[str] = "--low '2 Hz' --high '300 Hz' --period '2 s' --periods 10"
    figures: ClassVar[tuple[str, ...]] = ("response_to_reference", "excitation", "spectra", "against_time")
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
    axis: str = param("1", "Driven axis; both share the lines between them.", "both", choices=tuple(DRIVEN))
    mean_x: float = param("V", "Constant part of the reference of x.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)
    mean_y: float = param("V", "Constant part of the reference of y.", 0.0, low=-REFERENCE_LIMIT, high=REFERENCE_LIMIT)

    def check(self) -> None:
        """Refuse lines beyond Nyquist's frequency, a driven axis without lines, references beyond the limit."""
        if self.high >= 0.5 / self.Ts:
            raise DataError(
                f"high = {self.high:g} Hz: is not below half the sampling rate; give less than {0.5 / self.Ts:g} Hz"
            )
        driven = DRIVEN[self.axis]
        if min(len(self.lines()[axis]) for axis in driven) == 0:
            few = "no line" if len(driven) == 1 else "fewer than two lines"
            raise DataError(
                f"multisine: {few} from {self.low:g} to {self.high:g} Hz in steps of "
                f"{self.spacing / self.period:g} Hz; widen the range or take a longer period"
            )
        for axis in driven:
            self._check_mean("xy"[axis], self.means[axis])

    def _check_mean(self, axis: str, mean: float) -> None:
        if abs(mean) + self.amplitude > REFERENCE_LIMIT * (1 + 1e-12):
            raise DataError(
                f"mean_{axis} = {mean:g} V: reaches {abs(mean) + self.amplitude:g} V with the amplitude of "
                f"{self.amplitude:g} V; keep both together within {REFERENCE_LIMIT:g} V"
            )

    @property
    def means(self) -> tuple[float, float]:
        """Constant part of the reference [V] of x and y."""
        return self.mean_x, self.mean_y

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.bias) + self.periods * self.samples_in(self.period)

    def lines(self) -> tuple[np.ndarray, np.ndarray]:
        """Excited lines of x and of y as multiples of 1/period; disjoint, all on the axis that alone is driven."""
        least, most = ceil(self.low * self.period * (1 - 1e-12)), floor(self.high * self.period * (1 + 1e-12))
        lines = np.arange(least, most + 1, self.spacing)
        if self.axis != "both":
            return (lines, lines[:0]) if self.axis == "x" else (lines[:0], lines)
        return lines[0::2], lines[1::2]

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        since = first + np.arange(count) - self.samples_in(self.bias)
        one = one_period(self)
        rows[:, 2:4] = np.where((since >= 0)[:, None], one[since % len(one)], 0.0) + self.means
        return rows


multisine = as_function(Multisine)


@lru_cache(maxsize=4)
def one_period(sines: Multisine) -> np.ndarray:
    """Reference (n, 2) [V] of one period, without its mean."""
    period = np.zeros((sines.samples_in(sines.period), 2))
    for axis in DRIVEN[sines.axis]:
        period[:, axis] = _flattest(sines, generator(sines.sequence, KEY, axis), len(period), axis)
    return period


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

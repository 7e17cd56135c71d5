r"""Quantisation of the displacement readings: rounding to the converter's step.

.. math:: s \to q\,\lfloor s/q + \tfrac12 \rfloor

Source: Widrow & Kollar (2008).
"""

import math

import numpy as np

from reynolds.jit import inlined
from rotorsim.effects.base import Effect, param, register


@inlined
def quantisation(w, reading, state, seed, sample, p):
    """Round the displacements read."""
    if p.step > 0.0:
        for axis in range(2):
            w[reading + axis] = p.step * math.floor(w[reading + axis] / p.step + 0.5)


@register
class Quantisation(Effect):
    """Resolution of the displacement readings."""

    port = "sensor"
    kernel = quantisation
    cites = ("widrow_2008",)
    role = "scatter"
    ends_chain = True
    step: float = param("m", bounds=(0.0, 1e-4), doc="Step of the converter.")

    def scatter(self, readings: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Readings (n, 2) [m] rounded to the converter's step."""
        return np.round(readings / self.step) * self.step if self.step else readings

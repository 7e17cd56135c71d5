r"""Noise of the displacement sensors: white, normal, independent in both axes.

.. math:: s = x + \sigma\,n_i

n_i depends on (seed of the run, channel, number of the sample) alone; see `rotorsim.effects.sensors`. sigma is that
of a reading at any sampling rate f_s: white up to f_s / 2 with the one-sided density 2 sigma^2 / f_s.

Who knows the density of a probe and not its standard deviation writes sigma = sqrt(density f_s / 2).

Source: thesis 2.1, noise of about +-1 um at the disc.
"""

import numpy as np

from reynolds.jit import inlined
from rotorsim.effects.base import Effect, param, register
from rotorsim.effects.sensors import normal


@inlined
def noise(w, reading, state, seed, sample, p):
    """Add noise to the displacements read."""
    if p.sigma > 0.0:
        for axis in range(2):
            w[reading + axis] += p.sigma * normal(seed, axis * 1.0, sample)


@register
class Noise(Effect):
    """Noise of the displacement sensors."""

    port = "sensor"
    kernel = noise
    cites = ("thesis",)
    single = True
    role = "scatter"
    random_part = "sigma"
    sigma: float = param("m", bounds=(0.0, 1e-3), doc="Standard deviation of a reading, whatever the sampling rate.")

    def scatter(self, readings: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Readings (n, 2) [m] with noise of `rng`."""
        return readings + rng.normal(0, self.sigma, readings.shape)

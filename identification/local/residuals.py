r"""Residual tests: whiteness and correlation with the inputs (Ljung 1999, section 16.6).

Autocorrelations and cross-correlations are normalised; under the hypothesis each lies within +-2.58/sqrt(n) in 99 % of
cases, the cross-correlations wider by the colour of both signals (Bartlett's formula). Output-error residuals need not
be white, but what is left of the input in them is what the model misses. Neighbouring cross-correlations with a held
input are nearly the same number, so their share outside the band means little; their largest is judged, by a band that
all lags and pairs together leave in 1 % of cases (Bonferroni).
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

LAGS, NORMAL_99 = 100, 2.576
ALLOWED = 0.05
"""Share of lags that may lie outside the 99 % band."""


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """autocorrelation (lags, 2), bound; cross (2 lags + 1, 2, 2) from input j to residual i, cross_bound (2, 2)."""

    autocorrelation: np.ndarray
    bound: float
    cross: np.ndarray
    cross_bound: np.ndarray

    @property
    def outside(self) -> np.ndarray:
        """Share (2,) of autocorrelations outside the 99 % band."""
        return np.asarray(np.mean(np.abs(self.autocorrelation) > self.bound, axis=0))

    @property
    def cross_outside(self) -> np.ndarray:
        """Share (2, 2) of cross-correlations outside their band, residual by input."""
        return np.asarray(np.mean(np.abs(self.cross) > self.cross_bound, axis=0))

    @property
    def white(self) -> bool:
        """Whether residuals of both outputs pass as white."""
        return bool(np.all(self.outside <= ALLOWED))

    @property
    def independent(self) -> bool:
        """Whether residuals pass as independent of the inputs: no lag lies far out."""
        wide = NormalDist().inv_cdf(1 - 0.005 / self.cross.size) / NORMAL_99
        return bool(np.all(np.abs(self.cross) <= wide * self.cross_bound))


def residual_tests(residual: np.ndarray, u: np.ndarray, lags: int = LAGS) -> ResidualTests:
    """Tests of residuals (n, 2) against themselves and inputs u (n, 2)."""
    n = len(residual)
    lags = min(lags, n // 4)
    e, v = (_unit(values) for values in (residual, u))
    size = 1 << (2 * n - 1).bit_length()
    E, V = np.fft.rfft(e, size, axis=0), np.fft.rfft(v, size, axis=0)
    auto = np.fft.irfft(np.abs(E) ** 2, size, axis=0)
    auto_u = np.fft.irfft(np.abs(V) ** 2, size, axis=0)
    cross = np.fft.irfft(E[:, :, None] * V[:, None, :].conj(), size, axis=0)
    both = np.concatenate([cross[-lags:], cross[: lags + 1]])
    wide = min(n // 4, 10 * lags)
    colour = 1 + 2 * np.einsum("ki,kj->ij", auto[1:wide], auto_u[1:wide])
    return ResidualTests(
        auto[1 : lags + 1], NORMAL_99 / np.sqrt(n), both, NORMAL_99 * np.sqrt(np.maximum(colour, 1) / n)
    )


def _unit(values: np.ndarray) -> np.ndarray:
    values = values - values.mean(axis=0)
    return np.asarray(values / np.maximum(np.linalg.norm(values, axis=0), 1e-300))

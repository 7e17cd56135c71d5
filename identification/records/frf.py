r"""Frequency responses from records: H1 estimate and multiple coherence (Bendat and Piersol 2010, chapter 7).

.. math:: G(\omega) = S_{yu} S_{uu}^{-1}, \qquad \gamma_i^2 = \frac{G_i S_{uu} G_i^H}{S_{y_i y_i}}

with spectra averaged over overlapping segments. Noise on the outputs does not bias H1; noise on the inputs does.

Cites: bendat_2010.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

RESOLUTION = 1.5
"""Aimed distance of the lines [Hz]."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """omega (f,) [rad/s], G (f, p, m) [m/V], coherence (f, p) of each output with all inputs, power (f, p) [m^2]
    that the inputs explain, up to a factor, the segments averaged, and the variance (f, p, m) of G."""

    omega: np.ndarray
    G: np.ndarray
    coherence: np.ndarray
    power: np.ndarray
    segments: int
    variance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))


def frequency_response(u: np.ndarray, y: np.ndarray, Ts: float, resolution: float = RESOLUTION) -> FrequencyResponse:
    """H1 estimate from inputs u (n, m) and outputs y (n, p) sampled every Ts [s], lines `resolution` [Hz] apart.

    Examples
    --------
    >>> import rotorsim as rs
    >>> u, y = record["reference"].values, record["disc"].values
    >>> found = rs.identification.frequency_response(u, y, 2e-4)
    """
    length = int(min(1 / (resolution * Ts), len(u) // 4))
    window = ShortTimeFFT(hann(length, sym=False), max(length // 2, 1), 1 / Ts)
    low, high = window.lower_border_end[1], window.upper_border_begin(len(u))[1]
    inputs, outputs = (window.stft(values.T - values.mean(axis=0)[:, None])[..., low:high] for values in (u, y))
    Suu, Syu = (np.einsum("aft,bft->fab", values, inputs.conj()) for values in (inputs, outputs))
    Syy = np.sum(np.abs(outputs) ** 2, axis=-1).T
    ridge = 1e-9 * np.trace(Suu, axis1=1, axis2=2).real[:, None, None] * np.eye(Suu.shape[1]) + 1e-300 * np.eye(
        Suu.shape[1]
    )
    inverse = np.linalg.inv(Suu + ridge)
    G = Syu @ inverse
    explained = np.einsum("fpm,fpm->fp", Syu, G.conj()).real
    coherence = np.clip(explained / np.maximum(Syy, 1e-300), 0, 1)
    left = np.maximum(Syy - explained, 0) / max(high - low - u.shape[1], 1)
    variance = left[:, :, None] * np.diagonal(inverse, axis1=1, axis2=2).real[:, None, :]
    omega = 2 * np.pi * window.f
    return FrequencyResponse(omega[1:], G[1:], coherence[1:], explained[1:], high - low, variance[1:])

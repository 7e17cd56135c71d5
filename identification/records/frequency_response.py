r"""Frequency responses from records: H1 estimate with multiple coherence, and line by line of a periodic excitation.

.. math:: G(\omega) = S_{yu} S_{uu}^{-1}, \qquad \gamma_i^2 = \frac{G_i S_{uu} G_i^H}{S_{y_i y_i}}, \qquad
          \mathrm{var}\, G_{ij} = \frac{(1 - \gamma_i^2)\, S_{y_i y_i}}{N - m}\, (S_{uu}^{-1})_{jj}

with spectra averaged over N overlapping segments, Hann windows and m inputs (Bendat and Piersol 2010, chapter 7; half
overlapped, 19 segments count as 18). Noise on the outputs does not bias H1; noise on the inputs and modes narrower than
a few lines do. Whole periods have no leakage: the mean over P of them is the response, their scatter its variance.

Cites: bendat_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy  # loads its packages where they are first used: `scipy.signal` takes half a second

from rotorsim.base.errors import UnfitError

RESOLUTION = 1.5
"""Aimed distance of the lines [Hz]."""
OVERLAPPED = 18 / 19
"""Independent segments per Hann segment that overlaps its neighbours by half."""
FEWEST = 16
"""Samples of a stretch: four segments of four."""
DRIVEN, ALONE = 1e-3, 1e-4
"""A line of periodic excitation has this share of the strongest line's power; of other inputs less than that of its."""
RIDGE = 1e-9
"""Share of the inputs' power at a line that is added to each, so that lines without excitation have a response."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """omega (f,) [rad/s], G (f, p, m) [m/V], coherence (f, p) of each output with all inputs, power (f, p) [m^2]
    that the inputs explain, up to a factor, the segments averaged, variance (f, p, m) of G, its absolute value squared,
    where it is known, and the period Ts [s] of samples and held references, 0 for a response of continuous time.

    Elements of G that were not measured are NaN.
    """

    omega: np.ndarray
    G: np.ndarray
    coherence: np.ndarray
    power: np.ndarray
    segments: int
    variance: np.ndarray | None = None
    Ts: float = 0.0


@dataclass(frozen=True, eq=False)
class CrossSpectra:
    """Spectra summed over `count` segments: of inputs uu (f, m, m), of outputs with inputs yu (f, p, m), powers of the
    outputs yy (f, p)."""

    uu: np.ndarray
    yu: np.ndarray
    yy: np.ndarray
    count: int

    @classmethod
    def of(cls, u: np.ndarray, y: np.ndarray) -> CrossSpectra:
        """Sums over the transforms u (m, f, segments) and y (p, f, segments)."""
        uu, yu = (np.einsum("aft,bft->fab", values, u.conj()) for values in (u, y))
        return cls(uu, yu, np.sum(np.abs(y) ** 2, axis=-1).T, u.shape[-1])

    def __add__(self, other: CrossSpectra) -> CrossSpectra:
        """Sums over the segments of both."""
        return CrossSpectra(
            self.uu + other.uu, self.yu + other.yu, self.yy + other.yy, self.count + other.count
        )  # fmt: skip

    def at(self, lines: np.ndarray, inputs: np.ndarray | slice = slice(None)) -> CrossSpectra:
        """Sums at some lines, of some of the inputs."""
        uu, yu = self.uu[lines], self.yu[lines]
        return CrossSpectra(uu[:, inputs][:, :, inputs], yu[:, :, inputs], self.yy[lines], self.count)

    def h1(self, ridge: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """H1 estimate (f, p, m), and the inverse (f, m, m) of the inputs' spectra with a ridge of a share of them."""
        eye = np.eye(self.uu.shape[1])
        inverse = np.linalg.inv(
            self.uu + ridge * np.trace(self.uu, axis1=1, axis2=2).real[:, None, None] * eye + 1e-300 * eye
        )
        return self.yu @ inverse, inverse

    def explained(self, H: np.ndarray) -> np.ndarray:
        """Power (f, p) of the outputs that the inputs explain through the response H (f, p, m)."""
        return np.asarray(np.einsum("fpm,fpm->fp", self.yu, H.conj()).real)


def segments_of(length: int, Ts: float) -> scipy.signal.ShortTimeFFT:
    """Hann segments of `length` samples every `Ts` [s] that overlap by half."""
    window = scipy.signal.windows.hann(length, sym=False)
    return scipy.signal.ShortTimeFFT(window, max(length // 2, 1), 1 / Ts)


def transforms(
    window: scipy.signal.ShortTimeFFT, values: np.ndarray, detrend: Literal["constant"] | None = None
) -> np.ndarray:
    """Transforms (channels, f, segments) of the whole segments of values (n, channels), each less its mean if asked."""
    first, last = window.lower_border_end[1], window.upper_border_begin(len(values))[1]
    return np.asarray(window.stft_detrend(values.T, detrend, p0=first, p1=last))


def frequency_response(
    u: np.ndarray, y: np.ndarray, Ts: float, resolution: float = RESOLUTION, parts: Sequence[slice] = ()
) -> FrequencyResponse:
    """H1 estimate from inputs u (n, m) and outputs y (n, p) sampled every Ts [s], lines `resolution` [Hz] apart.

    Where the samples are those of several stretches, `parts` are these; no segment crosses from one to the next.
    Samples that are not finite are gaps between stretches.

    Raises
    ------
    UnfitError
        If u and y are no tables of as many rows, no stretch of FEWEST finite samples is left, or `resolution` is not
        above zero and at most a quarter of the sampling rate.

    Examples
    --------
    >>> import rotorsim as rs
    >>> u, y = record["reference"].values, record["disc"].values
    >>> found = rs.identification.frequency_response(u, y, 2e-4)
    """
    parts, coarsest = _finite_parts(u, y, parts or [slice(0, len(u))]), 1 / (FEWEST / 4 * Ts)
    if not 0 < resolution <= coarsest:
        raise UnfitError(
            f"frequency_response: lines {resolution:g} Hz apart; give more than 0 and at most {coarsest:g} Hz",
            argument="resolution",
            value=resolution,
        )
    length = int(min(1 / (resolution * Ts), max(at.stop - at.start for at in parts) // 4))
    window = segments_of(length, Ts)
    long = [at for at in parts if at.stop - at.start >= length]
    inputs, outputs = (
        np.concatenate([transforms(window, values[at] - values[at].mean(axis=0)) for at in long], axis=-1)
        for values in (u, y)
    )
    sums = CrossSpectra.of(inputs, outputs)
    G, inverse = sums.h1(RIDGE)
    explained = sums.explained(G)
    coherence = np.clip(explained / np.maximum(sums.yy, 1e-300), 0, 1)
    free = max(sums.count * OVERLAPPED - u.shape[1], 0.5)
    variance = ((1 - coherence) * sums.yy / free)[:, :, None] * np.einsum("fmm->fm", inverse).real[:, None, :]
    return FrequencyResponse(
        2 * np.pi * window.f[1:], G[1:], coherence[1:], explained[1:], sums.count, variance[1:], Ts
    )


def _finite_parts(u: np.ndarray, y: np.ndarray, parts: Sequence[slice]) -> Sequence[slice]:
    """Parts without the samples that are not finite."""
    if np.ndim(u) != 2 or np.ndim(y) != 2 or len(u) != len(y):
        raise UnfitError(
            f"frequency_response: u {np.shape(u)}, y {np.shape(y)}; give (n, m) and (n, p), one row a sample"
        )
    whole = np.isfinite(u).all(axis=1) & np.isfinite(y).all(axis=1)
    if not whole.all():
        edges = [at.start + np.flatnonzero(np.diff(np.r_[False, whole[at], False])) for at in parts]
        parts = [slice(int(a), int(b)) for one in edges for a, b in one.reshape(-1, 2)]
    longest = max((at.stop - at.start for at in parts), default=0)
    if longest < FEWEST:
        raise UnfitError(
            f"frequency_response: {longest} samples in the longest stretch of finite ones; give {FEWEST} or more"
        )
    return parts


def measured_response(
    omega: np.ndarray, G: np.ndarray, sd: np.ndarray | None = None, Ts: float = 0.0
) -> FrequencyResponse:
    """A frequency response from elsewhere, such as an analyser.

    Parameters
    ----------
    omega : ndarray, shape (f,)
        Frequencies [rad/s], ascending.
    G : ndarray, shape (f, p, m)
        Outputs [m] per input [V], NaN where nothing was measured.
    sd : ndarray or None, shape (f, p, m)
        Root mean square of its error, real and imaginary part together [m/V].
    Ts : float
        Period [s] of samples and held references, 0 for continuous time.

    Raises
    ------
    UnfitError
        If shapes do not fit, frequencies are not positive and ascending, or standard deviations not positive.

    Examples
    --------
    >>> import rotorsim as rs
    >>> model = rs.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    >>> omega = np.linspace(0.1, 10.0, 50)
    >>> rs.identification.measured_response(omega, model.transfer(omega)).segments
    1
    """
    omega, G = np.asarray(omega, float), np.asarray(G, complex)
    sd = None if sd is None else np.asarray(sd, float)
    if G.ndim != 3 or omega.shape != G.shape[:1] or not (len(omega) and omega[0] > 0 and np.all(np.diff(omega) > 0)):
        raise UnfitError(
            f"measured_response: omega {omega.shape}, G {G.shape}; give (f,) ascending, above zero, and (f, p, m)"
        )
    variance = None if sd is None else sd**2
    if sd is not None and (np.shape(sd) != G.shape or not np.all((sd > 0) | np.isnan(sd))):
        raise UnfitError(f"measured_response.sd: shape {np.shape(sd)}; give {G.shape}, each above zero")
    size = np.nan_to_num(np.abs(G) ** 2)
    power, noise = size.sum(axis=2), 0.0 if variance is None else np.nan_to_num(variance).sum(axis=2)
    return FrequencyResponse(omega, G, power / np.maximum(power + noise, 1e-300), power, 1, variance, Ts)


def periodic_response(u: np.ndarray, y: np.ndarray, Ts: float, period: float) -> FrequencyResponse:
    """Response at the lines of a periodic excitation whose lines belong to one input each, such as a multisine.

    Parameters
    ----------
    u, y : ndarray, shape (n, m), (n, p)
        Inputs [V] and outputs [m]; the last whole periods are taken, all but the first one.
    Ts, period : float
        Sampling time and period [s].

    Returns
    -------
    FrequencyResponse
        At each line NaN for the inputs that it does not belong to.

    Raises
    ------
    UnfitError
        If the period is no whole number of samples, there are fewer than three, a sample is not finite, or no line
        belongs to one input alone.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sines = rs.experiments.multisine(plant, pressure=0.5e6, period=0.1, periods=4)
    >>> u, y = sines["reference"].values, sines["disc_measured"].values
    >>> rs.identification.periodic_response(u, y, 2e-4, 0.1).segments
    3
    """
    if not (np.isfinite(u).all() and np.isfinite(y).all()):
        raise UnfitError("periodic_response: u or y holds NaN or infinite samples; cut them out by whole periods")
    length = round(period / Ts)
    count = len(u) // max(length, 1) - 1
    if abs(length * Ts - period) > 1e-6 * period or count < 2:
        raise UnfitError(
            f"periodic_response: {len(u)} samples of {Ts:g} s, period {period:g} s; give a whole number of samples as "
            "period and three periods or more, of which the first settles"
        )
    U, Y = (
        np.fft.rfft(values[len(values) - count * length :].reshape(count, length, -1), axis=1)[:, 1:]
        for values in (u, y)
    )
    power = np.mean(np.abs(U) ** 2, axis=0)
    strongest = np.argmax(power, axis=1)
    own = power[np.arange(len(power)), strongest]
    lines = np.flatnonzero((own > DRIVEN * own.max()) & (power.sum(axis=1) - own < ALONE * own))
    if not len(lines):
        raise UnfitError("periodic_response: no line belongs to one input alone; excite x and y at lines of their own")
    return _of_lines(U[:, lines], Y[:, lines], strongest[lines], 2 * np.pi * (lines + 1) / (length * Ts), Ts)


def _of_lines(U: np.ndarray, Y: np.ndarray, drive: np.ndarray, omega: np.ndarray, Ts: float) -> FrequencyResponse:
    """Response from transforms (periods, lines, channels), of input `drive` (lines,) at each line."""
    at, count = np.arange(len(omega)), len(U)
    u, mean = U[:, at, drive].mean(axis=0), Y.mean(axis=0)
    scatter = np.sum(np.abs(Y - mean) ** 2, axis=0) / (count * (count - 1))
    G = np.full((len(omega), Y.shape[2], U.shape[2]), np.nan + 0j)
    variance = np.full(G.shape, np.nan)
    G[at, :, drive] = mean / u[:, None]
    variance[at, :, drive] = scatter / np.abs(u[:, None]) ** 2
    explained = np.abs(mean) ** 2
    coherence = explained / np.maximum(explained + count * scatter, 1e-300)
    return FrequencyResponse(omega, G, coherence, explained, count, variance, Ts)

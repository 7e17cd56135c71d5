r"""Two-stage method for records of a closed loop with a recorded external reference (Van den Hof and Schrama 1993).

The disturbances reach the total reference u through the law, the external reference r knows nothing of them. First u is
replaced by the part of it that r explains, by a long finite impulse response H without any knowledge of the law,

.. math:: \hat u_k = \sum_{i=0}^{m} H_i r_{k-i}, \qquad
          \min_\theta \sum_k \| L(q) (y_k - G(\theta) \hat u_k) \|^2,

then the model is fitted as in open loop. The law leaves little of u where it damps, so that a model of low order would
be fitted elsewhere; the zero-phase filter L gives the input of the fit the spectrum of r, the weight of an open loop.

Cites: van_den_hof_1993, ljung_1999.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve, welch

from identification.errors import UnfitError
from identification.local.goodness import ceiling, fit_of, noise_free_fit, project, simulated
from identification.local.residuals import residual_tests
from identification.local.result import Identification
from identification.local.stretches import parts_of
from identification.records.prefilter import Signals, rest_length

TAPS = (100, 200, 400, 800)
"""Lengths of impulse responses that are tried; Akaike's criterion chooses."""
SAMPLES = 30
"""Least samples for each coefficient of them."""
RIDGE = 1e-7
"""Of the mean diagonal: a held binary signal leaves directions without power."""
RAISED = 10.0
"""L stays within this factor of its median."""


@dataclass(frozen=True, eq=False)
class Lags:
    """Sums over samples of lagged references: T (2 m, 2 m), b (2 m, c) with the values, v'v (c,), number of samples."""

    T: np.ndarray
    b: np.ndarray
    square: np.ndarray
    samples: int

    def response(self, taps: int) -> tuple[np.ndarray, float]:
        """H (2, taps, c) and Akaike's criterion of the first two channels, the references."""
        longest = len(self.T) // 2
        at = np.concatenate([np.arange(taps), longest + np.arange(taps)])
        T = self.T[np.ix_(at, at)]
        H = np.linalg.solve(T + RIDGE * np.trace(T) / len(T) * np.eye(len(T)), self.b[at])
        left = self.square[:2] - 2 * np.sum(self.b[at, :2] * H[:, :2], 0) + np.sum(H[:, :2] * (T @ H[:, :2]), 0)
        left = np.maximum(left, 1e-12 * self.square[:2]) / self.samples
        return H.reshape(2, taps, -1), float(np.sum(np.log(left)) + 2 * 2 * 2 * taps / self.samples)


def two_stage(signals: Signals, external: np.ndarray) -> tuple[Signals, str]:
    """Signals of an equivalent open loop, and a sentence.

    Parameters
    ----------
    signals : Signals
        Of one record, its reference the total one.
    external : ndarray, shape (n, 2)
        External reference [V].

    Returns
    -------
    staged : Signals
        Inputs, pins and outputs for an output-error fit, shorter by the memory of the filters; without truth.
    text : str
        How it was done.

    Raises
    ------
    UnfitError
        If the record is too short.
    """
    resting = rest_length(external)
    r = external - (external[0] if resting > 1 else external.mean(axis=0))
    given = [signals.u] if signals.pins is None else [signals.u, signals.pins]
    values = project(np.hstack(given), signals.Q)
    longest, starts = _longest(signals, resting), [0, *signals.breaks]
    lags = _lags(r, values, list(parts_of(signals.breaks, len(r))), longest, resting)
    H = min((lags.response(taps) for taps in TAPS if taps <= longest), key=lambda found: found[1])[0]
    taps = H.shape[1]
    known = np.vstack([_explained(r[at], H) for at in parts_of(signals.breaks, len(r))])
    L = _weight(r[min(resting, len(r) // 2) :], known[min(resting, len(r) // 2) :, :2], signals.Ts, taps)
    y, kept, breaks = project(signals.y, signals.Q), [], []
    filtered_ = []
    for at, start in zip(parts_of(signals.breaks, len(r)), starts, strict=True):
        first = start if start == 0 and resting >= taps else start + taps
        if at.stop - first < 3 * len(L):
            continue
        both = fftconvolve(np.hstack([known, y])[first : at.stop], L[:, None], mode="valid", axes=0)
        filtered_.append(both)
        kept.append(np.arange(first + len(L) // 2, first + len(L) // 2 + len(both)))
        breaks.append(len(both))
    if not kept:
        raise UnfitError(f"record: no stretch as long as {3 * len(L) + taps} samples; record longer")
    both, index = np.vstack(filtered_), np.concatenate(kept)
    staged = replace(
        signals, u=np.ascontiguousarray(both[:, :2]), y=np.ascontiguousarray(both[:, -2:]), truth=None,
        pins=None if signals.pins is None else np.ascontiguousarray(both[:, 2:-2]),
        Q=np.linalg.qr(signals.Q[index])[0], rest=max(resting - int(index[0]), 0),
        breaks=tuple(np.cumsum(breaks)[:-1].tolist()),
    )  # fmt: skip
    share = np.linalg.norm(known[:, :2]) ** 2 / max(float(np.sum((values[:, :2]) ** 2)), 1e-300)
    return staged, (
        f"two-stage: the external reference explains {100 * min(share, 1.0):.0f} % of the reference's power "
        f"({taps} coefficients an axis), the fit has the rest for noise"
    )


def _longest(signals: Signals, resting: int) -> int:
    """Most coefficients an axis that the record's length allows."""
    samples = len(signals.u) - resting
    allowed = [taps for taps in TAPS if 2 * taps * SAMPLES <= samples]
    if not allowed:
        raise UnfitError(
            f"record: {samples} samples with external reference; a closed loop needs {2 * TAPS[0] * SAMPLES} or more, "
            "record longer"
        )
    return allowed[-1]


def _lags(r: np.ndarray, values: np.ndarray, parts: list[slice], m: int, resting: int) -> Lags:
    """Sums over all samples whose m last references are known; exact least squares by correlations and their edges."""
    T, b = np.zeros((2 * m, 2 * m)), np.zeros((2 * m, values.shape[1]))
    square, samples = np.zeros(values.shape[1]), 0
    for part in parts:
        v, w = r[part], values[part]
        if len(v) < 3 * m:
            continue
        own_T, own_b = _correlations(v, w, m)
        own_T -= (tail := _regressors(np.vstack([v[-m:], np.zeros((m, 2))]), m)[m:]).T @ tail
        head = 0 if part.start == 0 and resting >= m else m
        if head:
            X = _regressors(v[:m], m)
            own_T -= X.T @ X
            own_b -= X.T @ w[:m]
        T, b = T + own_T, b + own_b
        square += np.sum(w[head:] ** 2, axis=0)
        samples += len(v) - head
    if not samples:
        raise UnfitError(f"record: no stretch as long as {3 * m} samples; record longer")
    return Lags(T, b, square, samples)


def _correlations(v: np.ndarray, w: np.ndarray, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums of products of lagged v (n, 2) with each other and with w (n, c), v zero before and after the stretch."""
    size = 1 << (len(v) + m).bit_length()
    V, W = np.fft.rfft(v, size, axis=0), np.fft.rfft(w, size, axis=0)
    T, k = np.empty((2 * m, 2 * m)), np.arange(m)
    for i in range(2):
        for j in range(2):
            c = np.fft.irfft(V[:, i].conj() * V[:, j], size)
            T[i * m : (i + 1) * m, j * m : (j + 1) * m] = c[(k[:, None] - k) % size]
    b = [np.fft.irfft(V[:, [i]].conj() * W, size, axis=0)[:m] for i in range(2)]
    return T, np.vstack(b)


def _regressors(v: np.ndarray, m: int) -> np.ndarray:
    """Lagged values (n, 2 m) of v (n, 2), zero before it."""
    padded = np.vstack([np.zeros((m - 1, 2)), v])
    windows = np.lib.stride_tricks.sliding_window_view(padded, m, axis=0)[..., ::-1]
    return np.ascontiguousarray(windows).reshape(len(v), 2 * m)


def _explained(r: np.ndarray, H: np.ndarray) -> np.ndarray:
    """Sum over lags of H (2, taps, c) and r (n, 2)."""
    return np.asarray(sum(fftconvolve(r[:, [i]], H[i], axes=0)[: len(r)] for i in range(2)))


def _weight(r: np.ndarray, u: np.ndarray, Ts: float, taps: int) -> np.ndarray:
    """Impulse response (taps + 1,) of the zero-phase filter that gives u (n, 2) the power density of r."""
    spectra = [welch(v, 1 / Ts, nperseg=min(2 * taps, len(r)), axis=0)[1].sum(axis=1) for v in (r, u)]
    L = np.sqrt(spectra[0] / np.maximum(spectra[1], 1e-300 + 1e-12 * spectra[1].max()))
    usual = float(np.median(L))
    L = np.clip(L, usual / RAISED, usual * RAISED)
    L[0] = L[1]
    h = np.fft.fftshift(np.fft.irfft(L))
    middle, half = len(h) // 2, taps // 2
    return np.asarray(h[middle - half : middle + half + 1] * np.hanning(2 * half + 3)[1:-1])


def judged(found: Identification, signals: Signals, external: np.ndarray) -> Identification:
    """The result with fits against the record itself, and residuals tested against the external reference."""
    y = project(signals.y, signals.Q)
    left = y - project(simulated(found.model, signals), signals.Q)
    return replace(
        found, method="two-stage", fit=fit_of(found.model, signals), ceiling=ceiling(y, signals.noise),
        noise_free_fit=noise_free_fit(found.model, signals), residuals=residual_tests(left, external),
        rms_residual=left.std(axis=0),
    )  # fmt: skip

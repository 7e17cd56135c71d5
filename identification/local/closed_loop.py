r"""Two-stage method for records of a closed loop with a recorded external reference (Van den Hof and Schrama 1993).

The disturbances reach the total reference u through the law, the external reference r knows nothing of them. First u is
replaced by the part of it that r explains, by a long finite impulse response H without any knowledge of the law,

.. math:: \hat u_k = \sum_{i=0}^{m} H_i r_{k-i}, \qquad
          \min_\theta \sum_k \| L(q) (y_k - G(\theta) \hat u_k) \|^2,

then the model is fitted as in open loop. The law leaves little of u where it damps, so that a model of low order would
be fitted elsewhere; the zero-phase filter L gives the input of the fit the spectrum of r, the weight of an open loop.

Cites: van_den_hof_1993, ljung_1999.
"""

from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve, welch

from identification.local.confidence import ceiling, fit_of, noise_free_fit, project, residual_tests, simulated
from identification.local.greybox import DELAYED, RATED, peak_frequency
from identification.local.result import Identification
from identification.records.frequency_response import frequency_response
from identification.records.prefilter import Signals, parts_of, rest_length
from rotorsim.base.errors import UnfitError

PERIODS = 9.0
"""Length of the impulse responses, in periods of the frequency at which the displacement moves fastest. Shorter ones,
as Akaike's criterion chooses them, cost accuracy."""
TAPS, FEWEST = (400, 1000), 100
"""Least and most coefficients of them; so few where the record is short."""
SAMPLES = 30
"""Least samples for each coefficient."""
FACTOR = 4
"""Shorter stretches, in lengths of the impulse responses, are left out."""
RIDGE = 1e-7
"""Share of the mean diagonal that is added to it: a held binary signal leaves directions without power."""
RAISED = 10.0
"""L stays within this factor of its median."""
NO_BIAS = "record of a closed loop: intervals are those of the standard deviations alone and hold no bias"
COARSE = (
    "Model 3 of a closed loop: on the virtual rig its damping ratios were off by up to 27 %; take Model 2-rate where "
    "pins are measured"
)
"""Warnings about results of the two stages."""


def two_stage(signals: Signals, external: np.ndarray) -> tuple[Signals, str]:
    """Signals of an equivalent open loop for an output-error fit, and a sentence on how it was done.

    `external` is the reference (n, 2) [V] from outside the loop, that of `signals` the total one. The signals are
    shorter by the memory of the filters, without truth, their noise as the filter leaves white one. Raises UnfitError
    if the record is too short.
    """
    resting = rest_length(external)
    r = external - (external[0] if resting > 1 else external.mean(axis=0))
    given = project(np.hstack([signals.u] if signals.pins is None else [signals.u, signals.pins]), signals.Q)
    excited, taps = slice(min(resting, len(r) // 2), None), _memory(signals, r, resting)
    parts = [part for part in parts_of(signals.breaks, len(r)) if part.stop - part.start >= FACTOR * taps]
    if not parts:
        raise UnfitError(f"record: no stretch of {FACTOR * taps} samples without a gap, which a closed loop needs")
    H = _response(r, given, parts, taps, resting)
    known = np.vstack([_explained(r[at], H) for at in parts_of(signals.breaks, len(r))])
    L = _weight(r[excited], known[excited, :2], signals.Ts, taps)
    every = np.hstack([known, project(signals.y, signals.Q), given])
    both, index, breaks = _weighted(every, L, parts, taps, resting)
    k = known.shape[1]
    staged = replace(
        signals, u=np.ascontiguousarray(both[:, :2]), y=np.ascontiguousarray(both[:, k : k + 2]), truth=None,
        pins=None if signals.pins is None else np.ascontiguousarray(both[:, 2:k]), acting=both[:, k + 2 :],
        Q=np.linalg.qr(signals.Q[index])[0], rest=max(resting - int(index[0]), 0), breaks=breaks,
        noise=signals.noise * float(np.linalg.norm(L)),
    )  # fmt: skip
    share = float(np.sum(known[excited, :2] ** 2)) / max(float(np.sum(given[excited, :2] ** 2)), 1e-300)
    return staged, (
        f"two-stage: the external reference explains {100 * min(share, 1.0):.0f} % of the reference's power "
        f"({taps} coefficients an axis), the fit has the rest for noise"
    )


def acted_of(signals: Signals) -> Signals | None:
    """Staged signals with the reference and pins that acted in place of the explained ones; None in open loop.

    The response H is off by what noise n in the loop adds to u, which feeds back the same n that y shows. So the error
    of the fit is made not by y - G u^, where the law has damped the noise, but by y - G u.
    """
    if signals.acting is None:
        return None
    u, pins = np.ascontiguousarray(signals.acting[:, :2]), np.ascontiguousarray(signals.acting[:, 2:])
    return replace(signals, u=u, pins=pins if signals.pins is not None else None, acting=None)


def _memory(signals: Signals, r: np.ndarray, resting: int) -> int:
    """Even number of coefficients an axis of the impulse responses."""
    samples = len(r) - resting
    first = min(resting, len(r) // 2)
    peak = peak_frequency(frequency_response(r[first:], signals.y[first:], signals.Ts))
    wanted = int(np.clip(PERIODS * 2 * np.pi / (peak * signals.Ts), *TAPS))
    allowed = samples // (2 * SAMPLES)
    if allowed < FEWEST:
        raise UnfitError(
            f"record: {samples} samples with external reference; a closed loop needs {2 * FEWEST * SAMPLES} or more, "
            "record longer"
        )
    return 2 * (min(wanted, allowed) // 2)


def _response(r: np.ndarray, values: np.ndarray, parts: list[slice], m: int, resting: int) -> np.ndarray:
    """H (2, m, c) by least squares over all samples whose m last references are known."""
    T, b = np.zeros((2 * m, 2 * m)), np.zeros((2 * m, values.shape[1]))
    for part in parts:
        v, w = r[part], values[part]
        own_T, own_b = _correlations(v, w, m)
        tail = _regressors(np.vstack([v[-m:], np.zeros((m, 2))]), m)[m:]
        own_T -= tail.T @ tail
        if not _begins_at_rest(part, m, resting):
            head = _regressors(v[:m], m)
            own_T -= head.T @ head
            own_b -= head.T @ w[:m]
        T, b = T + own_T, b + own_b
    return np.asarray(np.linalg.solve(T + RIDGE * np.trace(T) / len(T) * np.eye(len(T)), b).reshape(2, m, -1))


def _begins_at_rest(part: slice, m: int, resting: int) -> bool:
    return part.start == 0 and resting >= m


def _weighted(
    values: np.ndarray, L: np.ndarray, parts: list[slice], m: int, resting: int
) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
    """Filtered values whose past is known, the samples they belong to, and where the later stretches begin."""
    filtered, index = [], []
    for part in parts:
        first = part.start + (0 if _begins_at_rest(part, m, resting) else m)
        filtered.append(fftconvolve(values[first : part.stop], L[:, None], mode="valid", axes=0))
        index.append(first + len(L) // 2 + np.arange(len(filtered[-1])))
    breaks = np.cumsum([len(one) for one in filtered])[:-1]
    return np.vstack(filtered), np.concatenate(index), tuple(breaks.tolist())


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
    """The result with fits against the record itself, and residuals tested against the external reference.

    It states no bias, which `bias` reads from records of an open loop.
    """
    y = project(signals.y, signals.Q)
    left = y - project(simulated(found.model, signals), signals.Q)
    remarks = (
        (NO_BIAS, COARSE) if found.kind in ("3", DELAYED) else (NO_BIAS,) if found.kind in ("1", "2", RATED) else ()
    )
    return replace(
        found, method="two-stage", fit=fit_of(found.model, signals), ceiling=ceiling(y, signals.noise),
        noise_free_fit=noise_free_fit(found.model, signals), residuals=residual_tests(left, external),
        rms_residual=left.std(axis=0), bias=None,
        warnings=(*found.warnings, *remarks, *orbit_remark(signals, external)),
    )  # fmt: skip


def orbit_remark(signals: Signals, external: np.ndarray) -> tuple[str, ...]:
    """A sentence where the references move more at harmonics of the shaft angle than external (n, 2) [V] ones do."""
    moved = signals.u - signals.u.mean(axis=0)
    orbit, added = float((moved - project(moved, signals.Q)).std()), float(np.std(external - external.mean(axis=0)))
    if not orbit > added:
        return ()
    return (
        f"the references follow the orbit with {orbit:.2g} V (RMS), more than the external ones' {added:.2g} V: a film "
        "answers such strokes with another stiffness and damping; take them away by harmonics of the speed next to the "
        "law, as rotorsim.experiments.without_orbit does",
    )

r"""Evidence of an explanation: Laplace's approximation with an inferred error of the model's form.

.. math:: \ln Z = -\tfrac12\big(\ln|C_\tau| / T + \ln|I + S^{1/2} J' C_\tau^{-1} J S^{1/2} / T| + q\big), \quad
          q = \min_v (r_0 - J v)' C_\tau^{-1} (r_0 - J v) / T + v' S^{-1} v

about the re-fitted point; S holds the prior variances of calibration and sizes, C_tau the floor (1) with the model's
form error, whose size tau is integrated out. The likelihood is raised to 1/T: of T lines one is taken to be
independent. The term n ln 2 pi is common to all explanations and left out. A size that cannot be negative has half a
normal distribution, which adds ln 2 Phi(m / s) for its most probable value m and standard deviation s.

The error of the form is a stationary process over lines and operating points, relative to the response:

.. math:: r = r_0 + U z, \quad z \sim N(0, \tau^2 I), \quad U U' = \mathrm{diag}(y)\,(K_f \otimes K_o)\,\mathrm{diag}(y)

r is the whitened residual, y the whitened magnitude of the response at each line. K_f holds hat functions over
frequency, K_o falls with the distance of two operating points in speed and pressure; real and imaginary part and both
channels have processes of their own. Each row of a run-up's vectors is an operating point, its order n lies at the
frequency n Omega / 2 pi: so it shares its error with the same order in a record at that speed. tau is the relative
error; it is not declared but inferred (`SIZES`, by `weights`).

An explanation's parameters have the posterior distribution of the tangent at the re-fitted point,

.. math:: H = J' C_\tau^{-1} J / T + S^{-1}, \qquad v \sim N(\hat v, H^{-1})

Sources: MacKay (2003), chapter 28; Kennedy & O'Hagan (2001), with a process that is relative to the response; Gruenwald
(2012) for the power of the likelihood.

Cites: mackay_2003, kennedy_2001, gruenwald_2012.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from rotorsim.base.rounding import answer
from rotorsim.base.units import MPA
from rotorsim.discrepancy.calibration import FitParameter
from rotorsim.discrepancy.data_vector import DataLayout, modulus
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.trial import Trial

BAND = 25.0
"""Distance [Hz] over which the relative error of a response changes."""
SPEED, PRESSURE = 2 * np.pi * 30.0, 0.15 * MPA
"""Distances in speed [rad/s] and pressure [Pa] over which it changes."""
SIZES = np.geomspace(1e-4, 0.3, 18)
"""Relative errors that are tried."""
USUAL = 0.01
"""Median relative error of a model's form (half-Cauchy distribution)."""
MOST_NODES = 60
"""Most intervals of the hat functions over frequency."""
LEAST = 1e-6
"""Variance, relative to the largest, of directions that are left out."""
WIDE = 1e290
"""Prior standard deviation from which on a parameter has none of its own."""
SHARES, EXCESSES = np.geomspace(1e-3, 0.5, 10), np.geomspace(1.0, 300.0, 16)
"""Shares of the lines that something beyond the catalogue touches, and its size there in floors."""


@dataclass(frozen=True, eq=False)
class ModelForm:
    """Orthonormal directions (n, m) of the error and its variances (m,) at tau = 1."""

    directions: np.ndarray
    variances: np.ndarray

    def projected(self, columns: np.ndarray) -> np.ndarray:
        """Components (m, ...) of whitened vectors (n, ...) in the directions."""
        return np.asarray(self.directions.T @ columns)

    def whitened(self, residual: np.ndarray, tau: float) -> np.ndarray:
        """A residual (n,) with the error of the form taken out of its directions, as far as its size goes."""
        taken = 1 - 1 / np.sqrt(self.inflation(tau))
        return np.asarray(residual - self.directions @ (taken * self.projected(residual)))

    def inflation(self, tau: float) -> np.ndarray:
        """Variances (m,) in the directions, 1 without an error of the form."""
        return np.asarray(1 + tau**2 * self.variances)


def weights() -> np.ndarray:
    """Prior probabilities (sizes,) of `SIZES`: half-Cauchy in tau, on a grid even in its logarithm."""
    density = SIZES / (1 + (SIZES / USUAL) ** 2)
    return np.asarray(density / density.sum())


def whitened_size(layout: DataLayout, response: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Magnitude (n,) of each line of a response (n,) [m] in floors sigma (n,) [m]; drifts have none."""
    size = modulus(layout, response) / sigma
    size[layout.drift] = 0.0
    return np.asarray(size)


def model_form(layout: DataLayout, trials: Sequence[Trial], size: np.ndarray) -> ModelForm:
    """Process of a comparison; size (n,) is the whitened magnitude that the error is relative to."""
    lines = lines_of(layout, trials)
    between = near(lines.points, smooth=lines.has_rows)
    highest = float(lines.frequency.max())
    nodes = np.linspace(0.0, max(highest, 1.0), min(max(int(np.ceil(highest / BAND)), 1), MOST_NODES) + 1)
    hats = [np.interp(lines.frequency, nodes, row) for row in np.eye(len(nodes))]  # linear interpolation
    blocks = []
    for part in (part for channel in range(2) for part in _parts(layout, channel)):
        ones = [np.where(part, size * hat, 0.0) for hat in hats]
        columns = [one[:, None] * between[lines.point] for one in ones if one.any()]
        blocks += [np.concatenate(columns, axis=1)] if columns else []
    blocks = blocks or [np.zeros((len(size), 1))]
    if not lines.has_rows:
        return ModelForm(*_principal(np.concatenate(blocks, axis=1)))
    found = [_principal(U) for U in blocks]  # rows make many columns, and no two parts share a number
    directions, s2 = np.concatenate([V for V, _ in found], axis=1), np.concatenate([s2 for _, s2 in found])
    kept = s2 > LEAST * max(float(s2.max()), 1e-300)
    return ModelForm(directions[:, kept], s2[kept])


@dataclass(frozen=True, eq=False)
class LinePlaces:
    """Frequency [Hz] and number of the operating point of every number (n,); points (p, 2) in `SPEED` and `PRESSURE`.

    `has_rows`: whether some are rows of vectors, each of which is a point; otherwise every record is one.
    """

    frequency: np.ndarray
    point: np.ndarray
    points: np.ndarray
    has_rows: bool


def lines_of(layout: DataLayout, trials: Sequence[Trial]) -> LinePlaces:
    """Frequencies and operating points of the numbers of a comparison."""
    frequency, point, points = layout.frequency.copy(), np.zeros(len(layout.record), int), list[tuple[float, float]]()
    for i, trial in enumerate(trials):
        rows, own = trial.rows_of_vectors, layout.record == i
        speeds = np.array([trial.speed_at(1 + k) for k in range(rows)])
        point[own] = len(points)
        points += [(speed / SPEED, trial.pressure / PRESSURE) for speed in speeds]
        if trial.orders:
            lines = own & (layout.frequency > 0)  # their numbers, from 1: all rows of the first order, of the next ...
            order, row = np.divmod(layout.frequency[lines].astype(int) - 1, rows)
            point[lines] += row
            frequency[lines] = np.array(trial.orders)[order] * np.abs(speeds[row]) / (2 * np.pi)
    return LinePlaces(frequency, point, np.array(points), any(t.orders for t in trials))


def near(points: np.ndarray, smooth: bool = False) -> np.ndarray:
    """Factor L (p, k) of the correlation L L' of the error between operating points (p, 2).

    Of a `smooth` one the parts are left out that rows close to each other do not determine.
    """
    apart = np.sum((points[:, None] - points[None]) ** 2, axis=2)
    values, vectors = answer(np.linalg.eigh, np.exp(-0.5 * apart))
    L = np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
    return L[:, values > LEAST * values.max()] if smooth else L


def _principal(U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal directions (n, m) of U U' and its eigenvalues (m,), of columns U (n, k)."""
    if U.shape[1] > len(U):
        s2, V = answer(np.linalg.eigh, U @ U.T)
        return V, s2
    s2, V = answer(np.linalg.eigh, U.T @ U)
    kept = s2 > LEAST * max(float(s2.max()), 1e-300)
    return U @ (V[:, kept] / np.sqrt(s2[kept])), s2[kept]


def _parts(layout: DataLayout, channel: int) -> list[np.ndarray]:
    """Masks (n,) of real (with the means) and of imaginary parts of a channel."""
    real = np.zeros(len(layout.record), bool)
    for i in np.unique(layout.record):
        own = np.flatnonzero((layout.record == i) & (layout.channel == channel))
        real[own[: 2 + (len(own) - 2) // 2]] = True
    mine = layout.channel == channel
    return [mine & real, mine & ~real]


@dataclass(frozen=True)
class Evidence:
    """Logarithm of the evidence, the most probable relative error of the model's form, and parameters there.

    value, sd : most probable parameters (k,) and their standard deviations (k,), both in prior standard deviations
    """

    log: float
    error: float
    value: np.ndarray
    sd: np.ndarray


def prior_sizes(parameters: Sequence[FitParameter], found: np.ndarray) -> np.ndarray:
    """Prior standard deviations (k,) of the calibration, and of effects' sizes by their statement and the size
    `found`.

    A size has a prior with a long tail, a normal one whose scale is as likely large as small: its density at the size
    `found` (k,) is that of the scale that goes with it. Otherwise a large effect would count as impossible.
    """
    own = [p.sd if p.sd < WIDE else float(np.hypot(p.prior_size, v)) for p, v in zip(parameters, found, strict=True)]
    return np.array(own)


def likely_sizes(origin: np.ndarray, J: np.ndarray, parameters: Sequence[FitParameter]) -> np.ndarray:
    """Parameters (k,) of least squares with the priors of the calibration alone, for residuals (n,) at 0."""
    p = np.array([1 / k.sd if k.sd < WIDE else 0.0 for k in parameters])
    size = np.sqrt((J**2).sum(axis=0) + p**2)
    size[size == 0] = 1.0
    A = np.vstack([J / size, np.diag(p / size)])
    b = np.concatenate([origin, np.zeros(len(p))])
    return np.asarray(answer(np.linalg.lstsq, A, b, rcond=1e-10)[0] / size)


def log_evidence(
    form: ModelForm, origin: np.ndarray, J: np.ndarray, sd: np.ndarray, temperature: float = 1.0
) -> Evidence:
    """Evidence of a linear model with normal priors of standard deviations `sd` (k,).

    `origin` (n,) is the whitened residual at parameters of 0, by the tangent at the re-fitted point, `J` (n, k) the
    whitened derivatives of the response there; the logarithm of the likelihood is divided by `temperature`.
    """
    A = J * sd
    sums = float(origin @ origin), A.T @ origin, A.T @ A, form.projected(origin), form.projected(A)
    parts = [_at(form.inflation(tau), temperature, *sums) for tau in SIZES]
    total = np.array([part[0] for part in parts]) + np.log(weights())
    best = int(total.argmax())
    _, value, M = parts[best]
    log = float(total[best]) + float(np.log(np.exp(total - total[best]).sum()))
    variance = np.diag(answer(np.linalg.inv, M))
    return Evidence(log, float(SIZES[best]), value, np.sqrt(np.maximum(variance, 0.0)))


def one_sided(evidence: Evidence, parameters: Sequence[FitParameter]) -> float:
    """Contribution of sizes that cannot be negative to the logarithm of the evidence."""
    return float(
        sum(
            np.log(2.0) + log_ndtr(m / max(s, 1e-300))
            for m, s, p in zip(evidence.value, evidence.sd, parameters, strict=True)
            if p.sd >= WIDE and p.low == 0.0
        )
    )


def settled(form: ModelForm, origin: np.ndarray, J: np.ndarray, sd: np.ndarray, found: Evidence) -> np.ndarray:
    """Whitened residual (n,) where the parameters are most probable, the form's error taken out as far as it goes."""
    return form.whitened(origin - J @ (sd * found.value), found.error)


def _at(
    inflation: np.ndarray, T: float, plain: float, a: np.ndarray, H: np.ndarray, r: np.ndarray, W: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Log evidence with a given size of the form's error, most probable parameters, and their inverse covariance.

    From sums over all numbers (`plain`, `a`, `H`) and over the directions (`r`, `W`).
    """
    taken = 1 - 1 / inflation
    a = (a - W.T @ (taken * r)) / T
    M = np.eye(len(a)) + (H - (W.T * taken) @ W) / T
    value = answer(np.linalg.solve, M, a)
    q = (plain - float(taken @ r**2)) / T - float(a @ value)
    return -0.5 * (float(np.log(inflation).sum()) / T + float(answer(np.linalg.slogdet, M)[1]) + q), value, M


def unexplained_gain(residual: np.ndarray, lines: np.ndarray, temperature: float = 1.0) -> float:
    r"""Gain of the log evidence by freely placed excess on a share of the lines: 'something else is missing'.

    .. math:: \ln\,\Big\langle \prod_l \Big(1 - \epsilon + \epsilon\,
              \frac{N(r_l; 0, 1 + s^2)}{N(r_l; 0, 1)}\Big)^{1/T} \Big\rangle_{\epsilon, s}

    A share epsilon of the lines has an excess of s floors, both inferred (`SHARES`, `EXCESSES`, each as likely): it has
    no structure that an effect would have to have. `lines` (n,) numbers the line that each value belongs to.
    """
    power = np.bincount(lines, weights=residual**2)
    count = np.bincount(lines)
    power, count = power[count > 0], count[count > 0]
    found = []
    for s in EXCESSES:
        ratio = -0.5 * count * np.log1p(s * s) + 0.5 * power * (1 - 1 / (1 + s * s))
        found += [float(np.logaddexp(np.log1p(-e), np.log(e) + ratio).sum()) / temperature for e in SHARES]
    total = np.array(found)
    return float(total.max() + np.log(np.mean(np.exp(total - total.max()))))


def posterior_root(form: ModelForm, fit: ParameterFit, error: float, temperature: float) -> np.ndarray:
    """Root R (k, k) of the covariance R R' of a fit's parameters [their units].

    `error` is the relative error of the model's form along its directions, `temperature` what the logarithm of the
    likelihood is divided by. Raises NoAnswerError where the covariance has no root.
    """
    sd = prior_sizes(fit.parameters, fit.vector)
    A = fit.J * sd
    W, taken = form.projected(A), 1 - 1 / form.inflation(error)
    M = np.eye(A.shape[1]) + (A.T @ A - (W.T * taken) @ W) / temperature
    L = answer(np.linalg.cholesky, M)
    return np.asarray(sd[:, None] * answer(np.linalg.inv, L).T)

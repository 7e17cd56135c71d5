r"""Evidence of an explanation: Laplace's approximation with the full covariance, error of the model's form inferred.

.. math:: \ln Z = -\tfrac12\big(\ln|C_\tau| / T + \ln|I + S^{1/2} J' C_\tau^{-1} J S^{1/2} / T| + q\big), \quad
          q = \min_v (r_0 - J v)' C_\tau^{-1} (r_0 - J v) / T + v' S^{-1} v

about the re-fitted point; S holds the prior variances of calibration and sizes, C_tau the floor (1) with the model's
form error, whose size tau is integrated out. The likelihood is raised to 1/T: of T lines one is taken to be
independent. What n ln 2 pi adds is common to all explanations and left out. A size that cannot be negative has half a
normal distribution, which adds ln 2 Phi(m / s) for its most probable value m and standard deviation s.

Sources: MacKay (2003), chapter 28; Kennedy & O'Hagan (2001); Gruenwald (2012) for the power of the likelihood.

Cites: mackay_2003, kennedy_2001, gruenwald_2012.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.linear_algebra import answer
from rotorsim.discrepancy.odds.model_form import SIZES, ModelForm, weights

WIDE = 1e290
"""Prior standard deviation from which on a parameter has none of its own."""
SHARES, EXCESSES = np.geomspace(1e-3, 0.5, 10), np.geomspace(1.0, 300.0, 16)
"""Shares of the lines that something beyond the catalogue touches, and its size there in floors."""


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
    """Prior standard deviations (k,): those of the calibration; of sizes of effects what they state and what is found.

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
    """Evidence of a linear model with normal priors.

    Parameters
    ----------
    form : ModelForm
        Directions of the form's error.
    origin : (n,)
        Whitened residual at parameters of 0, by the tangent at the re-fitted point.
    J : (n, k)
        Whitened derivatives of the response there.
    sd : (k,)
        Prior standard deviations.
    temperature : float
        T, by which the logarithm of the likelihood is divided.
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
    """What sizes that cannot be negative add to the logarithm of the evidence."""
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
    r"""By how much freely placed excess on a share of the lines raises the log evidence: 'something else is missing'.

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

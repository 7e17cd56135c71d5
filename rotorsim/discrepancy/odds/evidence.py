r"""Evidence of an explanation: Laplace's approximation with the full covariance, error of the model's form inferred.

.. math:: \ln Z = -\tfrac12\big(\ln|C_\tau| + \ln|I + S^{1/2} J' C_\tau^{-1} J S^{1/2}| + q\big), \quad
          q = \min_v (r_0 - J v)' C_\tau^{-1} (r_0 - J v) + v' S^{-1} v

about the re-fitted point; S holds the prior variances of calibration and sizes, C_tau the floor (1) with the model's
form error, whose size tau is integrated out. What n ln 2 pi adds is common to all explanations and left out.

Sources: MacKay (2003), chapter 28; Kennedy & O'Hagan (2001).

Cites: mackay_2003, kennedy_2001.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.linear_algebra import answer
from rotorsim.discrepancy.odds.model_form import SIZES, ModelForm, weights

WIDE = 1e290
"""Prior standard deviation from which on a parameter has none of its own."""
STEPS = 10.0
"""Prior standard deviation of an effect's size in steps; one moves a response by a few tenths of a micrometre."""


SHARES, EXCESSES = np.geomspace(1e-3, 0.5, 10), np.geomspace(1.0, 300.0, 16)
"""Shares of the lines that something beyond the catalogue touches, and its size there in floors."""


def prior_sizes(parameters: Sequence[FitParameter], found: np.ndarray) -> np.ndarray:
    """Prior standard deviations (k,): those of the calibration; of sizes of effects `STEPS` steps and what is found.

    A size has a prior with a long tail, a normal one whose scale is as likely large as small: its density at the size
    `found` (k,) is that of the scale that goes with it. Otherwise a large effect would count as impossible.
    """
    own = [p.sd if p.sd < WIDE else float(np.hypot(STEPS * p.step, v)) for p, v in zip(parameters, found, strict=True)]
    return np.array(own)


def likely_sizes(origin: np.ndarray, J: np.ndarray, parameters: Sequence[FitParameter]) -> np.ndarray:
    """Parameters (k,) of least squares with the priors of the calibration alone, for residuals (n,) at 0."""
    p = np.array([1 / k.sd if k.sd < WIDE else 0.0 for k in parameters])
    size = np.sqrt((J**2).sum(axis=0) + p**2)
    size[size == 0] = 1.0
    A = np.vstack([J / size, np.diag(p / size)])
    b = np.concatenate([origin, np.zeros(len(p))])
    return np.asarray(answer(np.linalg.lstsq, A, b, rcond=1e-10)[0] / size)


def log_evidence(form: ModelForm, origin: np.ndarray, J: np.ndarray, sd: np.ndarray) -> tuple[float, float]:
    """Logarithm of the evidence and the most probable relative error of the model's form.

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
    """
    A = J * sd
    plain, a, H = float(origin @ origin), A.T @ origin, A.T @ A
    r, W = form.projected(origin), form.projected(A)
    found = np.array([_at(form.inflation(tau), plain, a, H, r, W) for tau in SIZES])
    total = found + np.log(weights())
    top = float(total.max())
    return top + float(np.log(np.exp(total - top).sum())), float(SIZES[int(total.argmax())])


def settled(form: ModelForm, origin: np.ndarray, J: np.ndarray, sd: np.ndarray, tau: float) -> np.ndarray:
    """Whitened residual (n,) where the parameters are most probable with an error tau of the model's form."""
    A = J * sd
    taken = 1 - 1 / form.inflation(tau)
    r, W = form.projected(origin), form.projected(A)
    M = np.eye(A.shape[1]) + A.T @ A - (W.T * taken) @ W
    v = answer(np.linalg.solve, M, A.T @ origin - W.T @ (taken * r))
    return form.whitened(origin - A @ v, tau)


def _at(inflation: np.ndarray, plain: float, a: np.ndarray, H: np.ndarray, r: np.ndarray, W: np.ndarray) -> float:
    """Log evidence with a given size of the form's error, from sums over all numbers and over the directions."""
    taken = 1 - 1 / inflation
    a = a - W.T @ (taken * r)
    M = np.eye(len(a)) + H - (W.T * taken) @ W
    q = plain - float(taken @ r**2) - float(a @ answer(np.linalg.solve, M, a))
    return -0.5 * (float(np.log(inflation).sum()) + float(answer(np.linalg.slogdet, M)[1]) + q)


def unexplained_gain(residual: np.ndarray, lines: np.ndarray) -> float:
    r"""By how much freely placed excess on a share of the lines raises the log evidence: 'something else is missing'.

    .. math:: \ln\,\Big\langle \prod_l \Big(1 - \epsilon + \epsilon\,
              \frac{N(r_l; 0, 1 + s^2)}{N(r_l; 0, 1)}\Big) \Big\rangle_{\epsilon, s}

    A share epsilon of the lines has an excess of s floors, both inferred (`SHARES`, `EXCESSES`, each as likely): it has
    no structure that an effect would have to have. `lines` (n,) numbers the line that each value belongs to.
    """
    power = np.bincount(lines, weights=residual**2)
    count = np.bincount(lines)
    power, count = power[count > 0], count[count > 0]
    found = []
    for s in EXCESSES:
        ratio = -0.5 * count * np.log1p(s * s) + 0.5 * power * (1 - 1 / (1 + s * s))
        found += [float(np.logaddexp(np.log1p(-e), np.log(e) + ratio).sum()) for e in SHARES]
    total = np.array(found)
    return float(total.max() + np.log(np.mean(np.exp(total - total.max()))))

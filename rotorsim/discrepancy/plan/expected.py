r"""Odds that a new record should leave: predictive distributions of the rivals, entropy after re-fitting them.

.. math:: p(y \mid k) = N\big(y;\, m_k,\, \Sigma + J_k V_k J_k'\big), \qquad
          E[H] = \sum_k P_k \int p(y \mid k)\, H\big[P(\cdot \mid y)\big]\, dy

m_k is the response of explanation k at its fitted point, V_k the covariance of its parameters after the records there
are, J_k their sensitivities in the new run: what a rival can be re-fitted to is no difference. Sigma is the floor with
the error of the model's form. The integral is a mean over draws; a plug-in estimate without J_k V_k J_k' is wrong by
factors. Sources: Lindley (1956); MacKay (2003), chapter 28.

Cites: lindley_1956, mackay_2003.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.linear_algebra import answer

DRAWS = 48
"""Draws of a new record for each explanation."""


@dataclass(frozen=True)
class Predicted:
    """An explanation's response (n,) in a new run, and its sensitivities times a root of the covariance (n, k)."""

    mean: np.ndarray
    spread: np.ndarray


@dataclass(frozen=True)
class Outlook:
    """What a run should leave: entropy [bit], chance that the truth has `SURE`, mean probability (k,) of each truth."""

    entropy: float
    decided: float
    truths: np.ndarray


SURE = 0.95
"""Probability at which an explanation is settled."""


def entropy(p: np.ndarray) -> np.ndarray:
    """Entropy [bit] of probabilities along the last axis."""
    return np.asarray(-(p * np.log2(np.maximum(p, 1e-300))).sum(axis=-1))


def outlook(
    odds: np.ndarray, predicted: Sequence[Predicted], sigma: np.ndarray, temperature: float, seed: int = 0
) -> Outlook:
    """What a new record should leave of the odds (k,).

    Parameters
    ----------
    odds : (k,)
        Probabilities today, which sum to 1.
    predicted : k explanations
    sigma : (n,)
        Standard deviation [m] of every number of the record.
    temperature : float
        By which logarithms of the evidence are divided.
    seed : int
        Of the draws: the same for every run, so that plans compare.
    """
    rng = np.random.default_rng([seed, 22])
    scaled = [Predicted(p.mean / sigma, p.spread / sigma[:, None]) for p in predicted]
    inner = [np.eye(p.spread.shape[1]) + p.spread.T @ p.spread for p in scaled]
    roots = [answer(np.linalg.cholesky, M) for M in inner]
    entropies, decided, truths = np.zeros(len(odds)), np.zeros(len(odds)), np.zeros(len(odds))
    for k, truth in enumerate(scaled):
        shape = (DRAWS, truth.spread.shape[1])
        drawn = truth.mean + rng.normal(size=shape) @ truth.spread.T + rng.normal(size=(DRAWS, len(sigma)))
        logs = np.stack([_log_density(drawn, p, L) for p, L in zip(scaled, roots, strict=True)], axis=1)
        p = np.log(odds) + logs / temperature
        p = np.exp(p - p.max(axis=1, keepdims=True))
        p /= p.sum(axis=1, keepdims=True)
        entropies[k], truths[k] = float(entropy(p).mean()), float(p[:, k].mean())
        decided[k] = float((p[:, k] >= SURE).mean())
    return Outlook(float(odds @ entropies), float(odds @ decided), truths)


def separation(predicted: Sequence[Predicted], sigma: np.ndarray) -> np.ndarray:
    """Sums of squares (k, k) between the responses of explanations, each re-fitted to the other's mean."""
    out = np.zeros((len(predicted), len(predicted)))
    for k, p in enumerate(predicted):
        S = p.spread / sigma[:, None]
        M = np.eye(S.shape[1]) + S.T @ S
        for i, other in enumerate(predicted):
            d = (other.mean - p.mean) / sigma
            a = S.T @ d
            out[i, k] = max(float(d @ d - a @ answer(np.linalg.solve, M, a)), 0.0)
    return np.maximum(out, out.T)


def _log_density(drawn: np.ndarray, p: Predicted, root: np.ndarray) -> np.ndarray:
    """Logarithm of the density of draws (d, n), less n ln 2 pi / 2."""
    r = drawn - p.mean
    along = answer(np.linalg.solve, root, p.spread.T @ r.T)
    return np.asarray(-0.5 * ((r**2).sum(axis=1) - (along**2).sum(axis=0)) - np.log(np.diag(root)).sum())

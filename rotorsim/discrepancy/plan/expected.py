r"""Odds that a new record should leave: predictive distributions of the rivals, entropy after re-fitting them.

.. math:: \ln p(y \mid k) = -\tfrac12\big(\ln|C| / T + \ln|I + F' C^{-1} F / T| + r' (T C + F F')^{-1} r\big), \quad
          C = \Sigma + U U', \quad F F' = J V J'

with r = y - m_k, the same power 1/T of the likelihood as in the evidence: it is the change of its logarithm by the new
record. m_k is the response of explanation k at its fitted point, V the covariance of its parameters after the records
there are, J their sensitivities in the new run: a rival differs by what it cannot be re-fitted to. Sigma is the floor,
U the error of the model's form. The expected entropy is a mean over draws; a plug-in estimate without J V J' is wrong
by factors. Explanations that are not followed are counted with the rival whose response they share so far:
a run leaves their ratio to it as it is. Sources: Lindley (1956); MacKay (2003), chapter 28.

Cites: lindley_1956, mackay_2003.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.linear_algebra import answer
from rotorsim.discrepancy.odds.explanation import SURE

DRAWS = 48
"""Draws of a new record for each explanation."""


@dataclass(frozen=True)
class PredictedResponse:
    """An explanation's response (n,) [m] in a new run and what leaves it open.

    spread : sensitivities times a root of the parameters' covariance (n, k) [m]
    form : directions of the model's form error, as large as it is (n, m) [m]
    """

    mean: np.ndarray
    spread: np.ndarray
    form: np.ndarray

    @property
    def open(self) -> np.ndarray:
        """Everything that leaves it open (n, k + m) [m]."""
        return np.concatenate([self.spread, self.form], axis=1)


@dataclass(frozen=True)
class Outlook:
    """What a run should leave.

    entropy : bit
    decided : chance that the truth is settled
    of_effects : the same if one of the rivals that name effects is true; 0 if there are none
    truths, chances : for each rival as the truth its mean probability (k,), and the chance that it is settled (k,)
    """

    entropy: float
    decided: float
    of_effects: float
    truths: np.ndarray
    chances: np.ndarray


@dataclass(frozen=True)
class CurrentOdds:
    """Odds before a run; with `rest` they sum to 1.

    odds : probabilities (k,) of the rivals
    rest : probabilities (k,) of what is not followed, by the rival whose response it shares so far
    effects : which rivals (k,) name effects; what is not followed fares as those do on average
    beyond : the part of `rest` that is not in the catalogue, which no run settles
    """

    odds: np.ndarray
    rest: np.ndarray
    effects: np.ndarray
    beyond: float = 0.0

    @classmethod
    def of(cls, *odds: float) -> CurrentOdds:
        """Of rivals that name effects, with nothing left out."""
        return cls(np.array(odds), np.zeros(len(odds)), np.ones(len(odds), bool))

    @property
    def entropy(self) -> float:
        """Entropy [bit]."""
        return float(entropy(np.concatenate([self.odds, self.rest])))


def entropy(p: np.ndarray) -> np.ndarray:
    """Entropy [bit] of probabilities along the last axis."""
    return np.asarray(-(p * np.log2(np.maximum(p, 1e-300))).sum(axis=-1))


def outlook(
    today: CurrentOdds, predicted: Sequence[PredictedResponse], sigma: np.ndarray, temperature: float, seed: int = 0,
    sure: float = SURE,
) -> Outlook:  # fmt: skip
    """What a new record should leave of the odds.

    Parameters
    ----------
    today : CurrentOdds
        Odds of k rivals, and of what is not followed.
    predicted : k explanations
    sigma : (n,)
        Standard deviation [m] of every number of the record.
    temperature : float
        By which logarithms of the evidence are divided.
    seed : int
        Of the draws: the same for every run, so that plans compare.
    sure : float
        Probability at which an explanation is settled.

    Raises
    ------
    NoAnswerError
        Where a covariance has no inverse.
    """
    rng = np.random.default_rng([seed, 22])
    scaled = [PredictedResponse(p.mean / sigma, p.spread / sigma[:, None], p.form / sigma[:, None]) for p in predicted]
    densities = [PredictiveDensity.of(p, temperature) for p in scaled]
    odds, whole = today.odds, today.odds + today.rest
    entropies, chances, truths = np.zeros(len(odds)), np.zeros(len(odds)), np.zeros(len(odds))
    for k, truth in enumerate(scaled):
        S = truth.open
        drawn = truth.mean + rng.normal(size=(DRAWS, S.shape[1])) @ S.T + rng.normal(size=(DRAWS, len(sigma)))
        p = np.log(whole) + np.stack([density.log(drawn) for density in densities], axis=1)
        p = np.exp(p - p.max(axis=1, keepdims=True))
        p /= p.sum(axis=1, keepdims=True)
        own, rest = p * odds / whole, p * today.rest / whole
        entropies[k], truths[k] = float(entropy(np.hstack([own, rest])).mean()), float(own[:, k].mean())
        chances[k] = float((own[:, k] >= sure).mean())
    of_effects = _of_effects(today, chances)
    decided = _expected(today, chances) - today.beyond * of_effects
    return Outlook(_expected(today, entropies), decided, of_effects, truths, chances)


def _expected(today: CurrentOdds, values: np.ndarray) -> float:
    """Mean over the truths (k,); what is not followed has that of the rivals which name effects."""
    others = _of_effects(today, values) if today.effects.any() else float(today.odds @ values / today.odds.sum())
    return float(today.odds @ values + today.rest.sum() * others)


def _of_effects(today: CurrentOdds, values: np.ndarray) -> float:
    """Mean over the truths (k,) that name effects; 0 if there are none."""
    named = today.odds * today.effects
    return float(named @ values / named.sum()) if named.any() else 0.0


@dataclass(frozen=True)
class PredictiveDensity:
    """Predictive density of a whitened record: mean (n,), what leaves it open S (n, k), its constant, temperature."""

    mean: np.ndarray
    S: np.ndarray
    inner: np.ndarray
    constant: float
    temperature: float

    @classmethod
    def of(cls, p: PredictedResponse, temperature: float) -> PredictiveDensity:
        """Of a prediction in standard deviations; raises NoAnswerError where it has none."""
        S = np.concatenate([p.form, p.spread / np.sqrt(temperature)], axis=1)
        inner = np.eye(S.shape[1]) + S.T @ S
        m = p.form.shape[1]
        whole = float(answer(np.linalg.slogdet, inner)[1])
        form = float(answer(np.linalg.slogdet, inner[:m, :m])[1]) if m else 0.0
        return cls(p.mean, S, inner, -0.5 * (form / temperature + whole - form), temperature)

    def log(self, drawn: np.ndarray) -> np.ndarray:
        """Its logarithm at records (d, n), less what n ln 2 pi adds."""
        r = drawn - self.mean
        a = r @ self.S
        q = (r**2).sum(axis=1) - (a * answer(np.linalg.solve, self.inner, a.T).T).sum(axis=1)
        return np.asarray(self.constant - 0.5 * q / self.temperature)


def separation(predicted: Sequence[PredictedResponse], sigma: np.ndarray) -> np.ndarray:
    """Sums of squares (k, k) between the responses of explanations, each re-fitted to the other's mean."""
    out = np.zeros((len(predicted), len(predicted)))
    for k, p in enumerate(predicted):
        S = p.open / sigma[:, None]
        M = np.eye(S.shape[1]) + S.T @ S
        for i, other in enumerate(predicted):
            d = (other.mean - p.mean) / sigma
            a = S.T @ d
            out[i, k] = max(float(d @ d - a @ answer(np.linalg.solve, M, a)), 0.0)
    return np.maximum(out, out.T)

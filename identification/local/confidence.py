r"""Statistics of a fit: goodness, covariance of its parameters, residual tests, parameters that data cannot show apart.

The goodness is the normalised root mean square error, and the ceiling the highest one that the noise allows.

.. math:: \mathrm{fit}_i = 1 - \frac{\|y_i - \hat y_i\|_2}{\|y_i - \bar y_i\|_2}, \qquad
          \mathrm{ceiling}_i = 1 - \frac{\sigma_i \sqrt{n}}{\|y_i - \bar y_i\|_2}

The thesis prints a ratio of sums of absolute values (eq. 2.3) under this name. No model that only knows the inputs
passes the ceiling on long records, but by chance.

The covariance under coloured residuals is the sandwich estimator (White 1980, Newey and West 1987).

.. math:: \mathrm{cov} = N^{-1} \Big( \sum_{|l| < L} (1 - |l|/L) \sum_k g_k g_{k+l}^T \Big) N^{-1}, \quad
          g_k = J_k^T e_k,\; N = \sum_k J_k^T J_k

From this `spread` separates what white sensor noise of known size makes, by the same formula without correlations; the
rest comes from what is neither noise nor model (distortion). The classical covariance sigma^2 N^{-1} is too small where
residuals keep their sign for long, as they do after an output-error fit of a lightly damped rotor.

Residuals are tested for whiteness and correlation with the inputs (Ljung 1999, section 16.6). Autocorrelations and
cross-correlations are normalised; under the hypothesis each lies within +-2.58/sqrt(n) in 99 % of cases, the
cross-correlations wider by the colour of both signals (Bartlett's formula). Output-error residuals need not be white,
but what is left of the input in them is what the model misses. Neighbouring cross-correlations with a held input are
nearly the same number, so their share outside the band means little; their largest is judged, by a band that all lags
and pairs together leave in 1 % of cases (Bonferroni).

Parameters that data cannot show apart lie in the null space of the scaled Fisher matrix.

.. math:: F = S^{-1} J^T J S^{-1}, \quad S = \mathrm{diag}(\|J_i\|); \qquad F v = 0

With sensitivities J of unit length, what nuisance parameters such as the initial state explain taken out, a singular
value near zero is a direction v = S dtheta that leaves the response as it is. Directions of several independent
ambiguities mix in v; the projection onto all of them does not, and its blocks are the groups of parameters.

Cites: ljung_1999, newey_1987, thesis, white_1980.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from identification.local.models import LinearModel
from identification.records.prefilter import Signals, parts_of, regressors_of
from rotorsim.base.rounding import least_squares


def nrmse(y: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Fit (p,) of simulated to measured outputs (n, p); 1 is perfect, 0 as good as the mean.

    Examples
    --------
    >>> import rotorsim as rs
    >>> y = np.array([[0.0], [1.0], [2.0]])
    >>> rs.identification.nrmse(y, y).tolist()
    [1.0]
    """
    spread = np.linalg.norm(y - y.mean(axis=0), axis=0)
    return np.asarray(1 - np.linalg.norm(y - simulated, axis=0) / np.maximum(spread, 1e-300))


def ceiling(y: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Largest fit (p,) that noise (p,) of known standard deviation allows.

    Examples
    --------
    >>> import rotorsim as rs
    >>> signals = rs.identification.filtered(record)
    >>> bool((rs.identification.ceiling(signals.y, signals.noise) > 0.9).all())
    True
    """
    return np.asarray(1 - noise / np.maximum((y - y.mean(axis=0)).std(axis=0), 1e-300))


def project(values: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Values (n, p) less what the orthonormal regressors Q (n, h) explain."""
    return np.asarray(values - Q @ (Q.T @ values))


def simulated(model: LinearModel, signals: Signals, y: np.ndarray | None = None) -> np.ndarray:
    """Outputs (n, p) of the model for the signals' inputs, with the initial state that fits best."""
    y = signals.y if y is None else y
    if signals.breaks:
        found = []
        for at in parts_of(signals.breaks, len(y)):
            Q, u = np.linalg.qr(regressors_of(signals.Q, at)[0])[0], np.ascontiguousarray(signals.u[at])
            found.append(simulated(model, replace(signals, u=u, y=signals.y[at], Q=Q, breaks=()), y[at]))
        return np.concatenate(found)
    sampled = model.discrete(signals.Ts)
    forced = sampled.simulate(signals.u, signals.Ts)
    quiet = np.zeros((len(y), signals.u.shape[1]))
    free = np.stack([sampled.simulate(quiet, signals.Ts, x) for x in np.eye(model.order)], axis=-1)
    free = free.reshape(len(y), -1)
    J = (free - signals.Q @ (signals.Q.T @ free)).reshape(-1, model.order)
    x0 = least_squares(J, project(y - forced, signals.Q).ravel())
    return np.asarray(forced + free.reshape(len(y), y.shape[1], -1) @ x0)


def fit_of(model: LinearModel, signals: Signals) -> np.ndarray:
    """Fit (p,) of a model on signals, offsets and harmonics of the angle taken out of both.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.fit_of(lpv.at(300.0, 0.5e6), rs.identification.filtered(record)).shape
    (2,)
    """
    return nrmse(project(signals.y, signals.Q), project(simulated(model, signals), signals.Q))


def noise_free_fit(model: LinearModel, signals: Signals) -> np.ndarray | None:
    """Fit (p,) against the true displacement, None where the record does not hold it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.noise_free_fit(lpv.at(300.0, 0.5e6), rs.identification.filtered(record)).shape
    (2,)
    """
    if signals.truth is None:
        return None
    return nrmse(project(signals.truth, signals.Q), project(simulated(model, signals, signals.truth), signals.Q))


WINDOW = 0.1
"""Correlations of residuals are counted up to this lag [s]."""


class Spread(NamedTuple):
    """Covariance (q, q) of the parameters and the part of it that is not sensor noise."""

    covariance: np.ndarray
    distortion: np.ndarray

    def first(self, count: int) -> Spread:
        """The spread of the first parameters alone."""
        return Spread(*(M[:count, :count] for M in self))

    def joined(self, other: Spread) -> Spread:
        """The spread of two independent sets of parameters."""
        return Spread(*(block_diag(*pair) for pair in zip(self, other, strict=True)))


def spread(residual: np.ndarray, J: np.ndarray, Ts: float, noise: np.ndarray) -> Spread:
    """Covariance by `sandwich` and what noise (p,) of known standard deviation leaves unexplained of it."""
    whole = sandwich(residual, J, Ts)
    scale = np.sqrt(np.maximum(np.sum(J**2, axis=(0, 1)), 1e-300))
    unit = J / scale
    inverse = np.linalg.pinv(np.einsum("kpq,kpr->qr", unit, unit), rcond=1e-12, hermitian=True)
    meat = np.einsum("p,kpq,kpr->qr", noise**2, unit, unit)
    rest = whole * np.outer(scale, scale) - inverse @ meat @ inverse
    values, vectors = np.linalg.eigh((rest + rest.T) / 2)
    kept = (vectors * np.maximum(values, 0)) @ vectors.T
    return Spread(whole, kept / np.outer(scale, scale))


def sandwich(residual: np.ndarray, J: np.ndarray, Ts: float, window: float = WINDOW) -> np.ndarray:
    """Covariance (q, q) of the parameters from residual (n, p) and Jacobian (n, p, q)."""
    flat = J.reshape(-1, J.shape[2])
    scale = np.sqrt(np.maximum(np.sum(flat**2, axis=0), 1e-300))
    scores = np.einsum("kp,kpq->kq", residual, J) / scale
    lag = int(np.clip(window / Ts, 1, max(len(scores) // 20, 1)))
    summed = np.cumsum(np.vstack([np.zeros((lag, len(scale))), scores, np.zeros((lag, len(scale)))]), axis=0)
    blocks = summed[lag:] - summed[:-lag]
    meat = blocks.T @ blocks / lag
    inverse = np.linalg.pinv(flat.T @ flat / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return np.asarray(inverse @ meat @ inverse / np.outer(scale, scale))


def propagate(function: Callable[[np.ndarray], np.ndarray], theta: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard deviations of function(theta) to first order, by central differences."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0))
    columns = []
    for i in range(len(theta)):
        step = 1e-3 * sd[i] + 1e-7 * abs(theta[i]) + 1e-300
        high, low = theta.copy(), theta.copy()
        high[i] += step
        low[i] -= step
        columns.append((np.ravel(function(high)) - np.ravel(function(low))) / (2 * step))
    slope = np.array(columns).T
    return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, covariance, slope), 0))


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

    @property
    def verdict(self) -> str:
        """Meaning of the tests: colour is allowed for, what is left of the inputs is missing from the model."""
        if not self.independent:
            return "correlated with the inputs: the model lacks part of the response"
        good = "independent of the inputs: the model holds their response"
        return good if self.white else f"{good}, and the standard deviations allow for the colour"


def residual_tests(residual: np.ndarray, u: np.ndarray, lags: int = LAGS) -> ResidualTests:
    """Tests of residuals (n, 2) against themselves and inputs u (n, 2)."""
    n = len(residual)
    lags = min(lags, n // 4)
    e, v = (values - values.mean(axis=0) for values in (residual, u))
    e, v = (values / np.maximum(np.linalg.norm(values, axis=0), 1e-300) for values in (e, v))
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


SINGULAR = 1e-6
"""Singular value, of sensitivities of unit length, below which a direction leaves the response as it is."""
NEGLIGIBLE = 1e-9
"""Effect of a parameter, as a share of the strongest one's, below which it has none."""
LINKED = 1e-3
"""Elements of the projection above this link two parameters."""


def without_nuisance(J: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Sensitivities (samples, q) of J (n, p, q + k) to parameters beyond what the k others explain.

    sizes (q,) are those of the parameters, 0 where one is not known. Columns are of the length that they have relative
    to their full one, which is 1, or 0 without any effect.
    """
    flat, q = J.reshape(-1, J.shape[2]), len(sizes)
    own, others = flat[:, :q], flat[:, q:]
    length = np.linalg.norm(own, axis=0)
    effect = length * sizes
    none = (length == 0) | ((sizes > 0) & (effect < NEGLIGIBLE * effect.max(initial=0.0)))
    own = np.where(none, 0.0, own / np.where(none, 1.0, length))
    if not others.shape[1]:
        return own
    Q = np.linalg.qr(others / np.maximum(np.linalg.norm(others, axis=0), 1e-300))[0]
    return np.asarray(own - Q @ (Q.T @ own))


def indistinguishable(J: np.ndarray, names: Sequence[str]) -> list[str]:
    """A text for each group of parameters that sensitivities J (samples, q), of unit length, do not show apart."""
    if not len(names):
        return []
    length = np.linalg.norm(J, axis=0)
    dead = length < SINGULAR
    scaled = np.where(dead, 0.0, J / np.where(dead, 1.0, length))
    values, vectors = np.linalg.svd(np.linalg.qr(scaled, mode="r"))[1:]
    null = vectors[values < SINGULAR]
    return [_text([names[i] for i in group]) for group in _groups(null.T @ null)]


def _groups(P: np.ndarray) -> list[list[int]]:
    """Indices that the projection (q, q) links, group by group."""
    left, found = [i for i in range(len(P)) if P[i, i] > LINKED**2], []
    while left:
        group, ahead = [], [left[0]]
        while ahead:
            group.append(i := ahead.pop())
            left.remove(i)
            ahead += [j for j in left if abs(P[i, j]) > LINKED and j not in ahead]
        found.append(sorted(group))
    return found


def _text(group: list[str]) -> str:
    if len(group) == 1:
        return f"{group[0]} does not change the response"
    return f"{', '.join(group[:-1])} and {group[-1]} change it only together, in one combination"

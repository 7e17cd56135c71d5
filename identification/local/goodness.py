r"""Goodness of fit (NRMSE) and the highest fit that the noise allows.

.. math:: \mathrm{fit}_i = 1 - \frac{\|y_i - \hat y_i\|_2}{\|y_i - \bar y_i\|_2}, \qquad
          \mathrm{ceiling}_i = 1 - \frac{\sigma_i \sqrt{n}}{\|y_i - \bar y_i\|_2}

The thesis prints a ratio of sums of absolute values (eq. 2.3) and calls it the normalised root mean square error, which
is what stands here. No model that only knows the inputs passes the ceiling on long records, but by chance.

Cites: ljung_1999, thesis.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.local.models import LinearModel
from identification.records.stretches import Signals, parts_of, regressors_of
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
        parts = [_part(signals, at) for at in parts_of(signals.breaks, len(y))]
        return np.concatenate([simulated(model, one, y[at]) for one, at in parts])
    sampled = model.discrete(signals.Ts)
    forced = sampled.simulate(signals.u, signals.Ts)
    quiet = np.zeros((len(y), signals.u.shape[1]))
    free = np.stack([sampled.simulate(quiet, signals.Ts, x) for x in np.eye(model.order)], axis=-1)
    free = free.reshape(len(y), -1)
    J = (free - signals.Q @ (signals.Q.T @ free)).reshape(-1, model.order)
    x0 = least_squares(J, project(y - forced, signals.Q).ravel())
    return np.asarray(forced + free.reshape(len(y), y.shape[1], -1) @ x0)


def _part(signals: Signals, at: slice) -> tuple[Signals, slice]:
    shown = np.linalg.qr(regressors_of(signals.Q, at)[0])[0]
    return replace(signals, u=np.ascontiguousarray(signals.u[at]), y=signals.y[at], Q=shown, breaks=()), at


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

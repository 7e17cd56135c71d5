r"""Posterior distribution of an explanation's parameters, by its tangent at the re-fitted point.

.. math:: H = J' C_\tau^{-1} J / T + S^{-1}, \qquad v \sim N(\hat v, H^{-1})

with the priors S, the floor with the model's form error C_tau and the temperature T of the evidence. Source: MacKay
(2003), chapter 28.

Cites: mackay_2003.
"""

from __future__ import annotations

import numpy as np

from rotorsim.discrepancy.fit.least_squares import ParameterFit
from rotorsim.discrepancy.linear_algebra import answer
from rotorsim.discrepancy.odds.evidence import prior_sizes
from rotorsim.discrepancy.odds.model_form import ModelForm


def posterior_root(form: ModelForm, fit: ParameterFit, error: float, temperature: float) -> np.ndarray:
    """Root R (k, k) of the covariance R R' of a fit's parameters [their units].

    Parameters
    ----------
    form : ModelForm
        Directions of the form's error.
    fit : Fit
        With the Jacobian (n, k) at its point.
    error : float
        Relative error of the model's form.
    temperature : float
        By which the logarithm of the likelihood is divided.

    Raises
    ------
    NoAnswerError
        Where the covariance has no root.
    """
    sd = prior_sizes(fit.parameters, fit.vector)
    A = fit.J * sd
    W, taken = form.projected(A), 1 - 1 / form.inflation(error)
    M = np.eye(A.shape[1]) + (A.T @ A - (W.T * taken) @ W) / temperature
    L = answer(np.linalg.cholesky, M)
    return np.asarray(sd[:, None] * answer(np.linalg.inv, L).T)

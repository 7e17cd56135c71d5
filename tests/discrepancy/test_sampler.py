"""Laplace's approximation against samples of the plant's own posterior, on five hidden cases of a plain rotor.

The posterior is that of the odds: likelihood to the power 1/T, form error at its most probable size, priors of
calibration and sizes. A sampler (emcee, Foreman-Mackey et al. 2013) runs the plant at every point; the evidence is
taken again by importance sampling from a wider normal distribution.
"""

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import ParameterPoint, calibration
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.data_vector import TOLERANCE
from rotorsim.discrepancy.evidence import SIZES, log_evidence, model_form, prior_sizes, weights, whitened_size
from rotorsim.discrepancy.fit import ParameterFit, fit_parameters
from rotorsim.discrepancy.records import make_trials, open_records
from rotorsim.discrepancy.verdict import TEMPERATURE

pytestmark = pytest.mark.nightly
CASES = [("coupling.force_2x", 4), ("runout.amplitude_1x", 6), ("runout.amplitude_2x", 7), ("shaft_bow.bow", 8),
         ("runout.amplitude_3x", 9)]  # fmt: skip
WIDER, OUTSIDE = 1.15, -1e6
"""Importance sampling's distribution relative to Laplace's; logarithm below which a point is beyond a limit."""
WALKERS, STEPS, BURNT, DRAWS = 36, 120, 50, 300


class Posterior:
    """Logarithm of the posterior of a fit's parameters, in prior standard deviations, with the plant at every point."""

    def __init__(self, comparison: TwinComparison, fitted: ParameterFit):
        self.comparison, self.fitted = comparison, fitted
        self.sd = prior_sizes(fitted.parameters, fitted.vector)
        size = whitened_size(comparison.layout, comparison.predict(fitted.point), comparison.sigma)
        self.form = model_form(comparison.layout, comparison.trials, size)
        origin = fitted.residual + fitted.J @ fitted.vector
        self.laplace = log_evidence(self.form, origin, fitted.J, self.sd, TEMPERATURE)

    def __call__(self, value: np.ndarray) -> float:
        values = dict(zip(self.fitted.parameters, value * self.sd, strict=True))
        if any(not p.low <= v <= p.high for p, v in values.items()):
            return 2 * OUTSIDE - float(value @ value)
        residual = self.comparison.residual(ParameterPoint(values, self.fitted.point.fixed))
        r = self.form.whitened(residual, self.laplace.error)
        return float(-0.5 * r @ r / TEMPERATURE - 0.5 * value @ value)

    @property
    def covariance(self) -> np.ndarray:
        """Laplace's covariance, in prior standard deviations."""
        A, taken = self.fitted.J * self.sd, 1 - 1 / self.form.inflation(self.laplace.error)
        W = self.form.projected(A)
        return np.linalg.inv(np.eye(len(self.sd)) + (A.T @ A - (W.T * taken) @ W) / TEMPERATURE)


@pytest.fixture(scope="module", params=CASES, ids=[name for name, _ in CASES])
def posterior(request, machine, models, recorded):
    """Posterior of the hidden effect's own explanation."""
    name, seed = request.param
    records, truth = recorded((name,), seed)
    few = [r for r in records if r.attrs["record"] == "fit_3"]
    trials = make_trials(machine, open_records(few), "fit")
    comparison = TwinComparison(models.twin, trials, threads=1)
    form = next(f for f in candidates(models.twin) if f.label == truth.forms[0].label)
    parameters = (*calibration(models.twin, len(trials)), *form.parameters)
    hidden = {p.name: value for p, value in truth.point.values.items()}
    point = ParameterPoint({p: hidden.get(p.name, 0.0) for p in parameters}, dict(form.fixed))
    comparison.set_floor(point, models.fine, TOLERANCE)
    for _ in range(3):
        found = fit_parameters(comparison, point, parameters, comparison.jacobian(point, parameters))
        point = found.point
    J = comparison.jacobian(point, parameters, central=True)
    return Posterior(comparison, ParameterFit(parameters, point, found.residual, J, found.cost)), len(form.parameters)


def test_sizes_and_their_standard_deviations_are_those_of_the_sampler(posterior):
    emcee = pytest.importorskip("emcee")
    of, count = posterior
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(of.covariance)
    start = of.laplace.value + rng.normal(size=(WALKERS, len(of.sd))) @ root.T
    sampler = emcee.EnsembleSampler(WALKERS, len(of.sd), of)
    sampler.random_state = np.random.RandomState(2).get_state()
    sampler.run_mcmc(start, STEPS)
    chain = sampler.get_chain(discard=BURNT, flat=True)[:, -count:]
    sd = np.sqrt(np.diag(of.covariance))[-count:]
    assert np.all(np.abs(chain.mean(axis=0) - of.laplace.value[-count:]) < 0.5 * sd)
    assert np.all(np.abs(np.log(chain.std(axis=0) / sd)) < np.log(2.0))  # limits of the bearings cut it off


def test_the_evidence_is_that_of_importance_sampling(posterior):
    of, _ = posterior
    rng = np.random.default_rng(3)
    wide = WIDER * np.linalg.cholesky(of.covariance)
    drawn = rng.normal(size=(DRAWS, len(of.sd)))
    logs = np.array([of(of.laplace.value + wide @ z) for z in drawn])
    likely = np.exp(-0.5 * (WIDER**2 - 1) * (drawn**2).sum(axis=1))
    within = np.log(likely[logs > OUTSIDE].sum() / likely.sum())
    logs += 0.5 * (drawn**2).sum(axis=1) + np.linalg.slogdet(wide)[1]
    top = logs.max()
    sampled = top + np.log(np.mean(np.exp(logs - top)))
    inflation = of.form.inflation(of.laplace.error)
    at = int(np.argmin(np.abs(SIZES - of.laplace.error)))
    r0 = of.fitted.residual + of.fitted.J @ of.fitted.vector
    alone = log_evidence(of.form, r0, of.fitted.J, of.sd, TEMPERATURE)
    r = of.form.whitened(r0 - of.fitted.J @ (of.sd * alone.value), alone.error)
    q = r @ r / TEMPERATURE + alone.value @ alone.value
    there = -0.5 * (q - np.linalg.slogdet(of.covariance)[1])
    # limits of the bearings cut off a part of the normal distribution; the difference that stays, .7 to 1.7 in the five
    # cases, is as measured: its cause is not established
    assert sampled == pytest.approx(there + within, abs=2.0)
    assert alone.log == pytest.approx(
        there - 0.5 * np.log(inflation).sum() / TEMPERATURE + np.log(weights()[at]), abs=3.0
    )

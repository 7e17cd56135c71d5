"""Evidence against the exact marginal likelihood, excess on lines, and odds that are as often right as they say."""

import numpy as np
import pytest

from rotorsim.discrepancy.odds import evidence, model_form
from rotorsim.discrepancy.odds.evidence import log_evidence, unexplained_gain
from rotorsim.discrepancy.odds.explanation import shown_share
from rotorsim.discrepancy.odds.model_form import SIZES, ModelForm, weights


def directions(rng, n, m):
    Q, _ = np.linalg.qr(rng.normal(size=(n, m)))
    return ModelForm(Q, rng.uniform(10.0, 1e4, m))


def exact(form, origin, J, sd, tau):
    """Logarithm of N(origin; 0, C + J S J') without n ln 2 pi, with dense matrices."""
    U = form.directions * np.sqrt(form.variances)
    C = np.eye(len(origin)) + tau**2 * U @ U.T + (J * sd**2) @ J.T
    return -0.5 * (np.linalg.slogdet(C)[1] + origin @ np.linalg.solve(C, origin))


def test_the_evidence_of_a_linear_model_is_its_marginal_likelihood():
    rng = np.random.default_rng(1)
    form, J, sd = directions(rng, 60, 7), rng.normal(size=(60, 4)), rng.uniform(0.1, 10.0, 4)
    origin = 3 * rng.normal(size=60)
    found, size = log_evidence(form, origin, J, sd)
    each = np.array([exact(form, origin, J, sd, tau) for tau in SIZES])
    assert found == pytest.approx(np.log(np.sum(np.exp(each - each.max()) * weights())) + each.max(), rel=1e-10)
    assert size == SIZES[np.argmax(each + np.log(weights()))]


def test_the_size_of_the_form_error_is_inferred():
    rng = np.random.default_rng(2)
    form, J = directions(rng, 400, 40), np.zeros((400, 1))
    for tau in (1e-3, 0.02, 0.2):
        z = tau * np.sqrt(form.variances) * rng.normal(size=40)
        _, size = log_evidence(form, rng.normal(size=400) + form.directions @ z, J, np.ones(1))
        assert size <= 2e-2 if tau < 1e-2 else 0.5 * tau < size < 2 * tau


def test_scatter_has_no_excess_and_a_few_loud_lines_have_one():
    rng = np.random.default_rng(3)
    lines = np.repeat(np.arange(2000), 2)
    quiet = rng.normal(size=4000)
    assert -6 < unexplained_gain(quiet, lines) < 3
    loud = quiet.copy()
    loud[:20] += 30.0
    assert unexplained_gain(loud, lines) > 2000


def test_probabilities_are_right_as_often_as_they_say():
    """Machines drawn from the priors: of what is given 60 to 80 % about 70 % is true."""
    rng = np.random.default_rng(4)
    form, n, kinds = directions(rng, 40, 3), 40, 5
    columns = [rng.normal(size=(n, 1)) * 0.3 for _ in range(kinds)]
    given, true = [], []
    for _ in range(1500):
        k = int(rng.integers(kinds))
        tau = rng.choice(SIZES, p=weights())
        data = rng.normal(size=n) + form.directions @ (tau * np.sqrt(form.variances) * rng.normal(size=3))
        data += columns[k] @ rng.normal(size=1) * 2.0
        z = np.array([log_evidence(form, data, J, np.array([2.0]))[0] for J in columns])
        p = np.exp(z - z.max()) / np.exp(z - z.max()).sum()
        given += list(p)
        true += [j == k for j in range(kinds)]
    bins = np.minimum((np.array(given) * 5).astype(int), 4)
    gaps = [abs(np.mean(np.array(true)[bins == b]) - np.mean(np.array(given)[bins == b])) for b in range(5)]
    assert np.average(gaps, weights=np.bincount(bins, minlength=5)) < 0.02


def test_near_certainty_is_not_shown_as_certainty():
    assert [shown_share(p) for p in (0.99999, 0.995, 0.42, 0.004)] == ["> 99.9 %", "99.5 %", "42 %", "0.4 %"]
    assert evidence.STEPS > 1 and model_form.USUAL < 0.05

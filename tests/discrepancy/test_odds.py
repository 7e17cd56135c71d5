"""Evidence against the exact marginal likelihood, excess on lines, and odds that are as often right as they say."""

import numpy as np
import pytest
from scipy.integrate import quad

from rotorsim.base.errors import DataError
from rotorsim.discrepancy.calibration import STEPS, FitParameter
from rotorsim.discrepancy.candidates import candidates, prior_sizes
from rotorsim.discrepancy.evidence import SIZES, USUAL, ModelForm, log_evidence, one_sided, unexplained_gain, weights
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import Explanation, _merged, shown_share
from rotorsim.effects import REGISTRY
from rotorsim.effects.base import CandidateForm
from rotorsim.machine import load_machine


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
    found = log_evidence(form, origin, J, sd)
    each = np.array([exact(form, origin, J, sd, tau) for tau in SIZES])
    assert found.log == pytest.approx(np.log(np.sum(np.exp(each - each.max()) * weights())) + each.max(), rel=1e-10)
    assert found.error == SIZES[np.argmax(each + np.log(weights()))]


def test_a_power_of_the_likelihood_is_that_of_a_wider_floor():
    """One of T lines is independent: T times the variance of floor and form error, but for the floor's own norm."""
    rng = np.random.default_rng(5)
    form, J, sd, T = directions(rng, 60, 7), rng.normal(size=(60, 3)), np.full(3, 2.0), 4.0
    origin = 3 * rng.normal(size=60)

    def by_quadrature_free_form(tau):
        U = form.directions * np.sqrt(form.variances)
        C = np.eye(60) + tau**2 * U @ U.T
        whole = T * C + (J * sd**2) @ J.T
        norm = np.linalg.slogdet(whole)[1] - np.linalg.slogdet(T * C)[1] + np.linalg.slogdet(C)[1] / T
        return -0.5 * (norm + origin @ np.linalg.solve(whole, origin))

    each = np.array([by_quadrature_free_form(tau) for tau in SIZES])
    expected = np.log(np.sum(np.exp(each - each.max()) * weights())) + each.max()
    assert log_evidence(form, origin, J, sd, T).log == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("pull", [-4.0, 0.0, 3.0])
def test_a_size_that_cannot_be_negative_has_half_a_prior(pull):
    """One number, one size a >= 0 with a half-normal prior: the evidence by quadrature."""
    none = ModelForm(np.zeros((1, 1)), np.zeros(1))
    slope, sd = 2.0, 1.5
    found = log_evidence(none, np.array([pull]), np.array([[slope]]), np.array([sd]))
    size = FitParameter("weak.0.blocked", 1.0, low=0.0)

    def integrand(a):
        return 2 * np.exp(-0.5 * ((pull - slope * a) ** 2 + (a / sd) ** 2)) / (sd * np.sqrt(2 * np.pi))

    exact = np.log(quad(integrand, 0, np.inf)[0])
    assert found.log + one_sided(found, [size]) == pytest.approx(exact, abs=1e-6)


def test_an_effect_without_response_is_as_likely_as_nothing():
    none = ModelForm(np.zeros((3, 1)), np.zeros(1))
    r = np.array([1.0, -2.0, 0.5])
    bare = log_evidence(none, r, np.zeros((3, 0)), np.zeros(0))
    mute = log_evidence(none, r, np.zeros((3, 1)), np.ones(1))
    assert mute.log == pytest.approx(bare.log) and mute.sd[0] == pytest.approx(1.0)


def test_the_size_of_the_form_error_is_inferred():
    rng = np.random.default_rng(2)
    form, J = directions(rng, 400, 40), np.zeros((400, 1))
    for tau in (1e-3, 0.02, 0.2):
        z = tau * np.sqrt(form.variances) * rng.normal(size=40)
        size = log_evidence(form, rng.normal(size=400) + form.directions @ z, J, np.ones(1)).error
        assert size <= 2e-2 if tau < 1e-2 else 0.5 * tau < size < 2 * tau


def test_scatter_has_no_excess_and_a_few_loud_lines_have_one():
    rng = np.random.default_rng(3)
    lines = np.repeat(np.arange(2000), 2)
    quiet = rng.normal(size=4000)
    assert -6 < unexplained_gain(quiet, lines) < 3
    loud = quiet.copy()
    loud[:20] += 30.0
    assert unexplained_gain(loud, lines) > 2000


@pytest.mark.slow
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
        z = np.array([log_evidence(form, data, J, np.array([2.0])).log for J in columns])
        p = np.exp(z - z.max()) / np.exp(z - z.max()).sum()
        given += list(p)
        true += [j == k for j in range(kinds)]
    bins = np.minimum((np.array(given) * 5).astype(int), 4)
    gaps = [abs(np.mean(np.array(true)[bins == b]) - np.mean(np.array(given)[bins == b])) for b in range(5)]
    assert np.average(gaps, weights=np.bincount(bins, minlength=5)) < 0.02


def test_near_certainty_is_not_shown_as_certainty():
    assert [shown_share(p) for p in (0.99999, 0.995, 0.42, 0.004)] == ["> 99.9 %", "99.5 %", "42 %", "0.4 %"]
    assert STEPS > 1 and USUAL < 0.05


@pytest.mark.parametrize(("form", "sentence"), [
    (CandidateForm("mean_free_path", 1e-8, prior=0.0), "slip.mean_free_path: its prior is 0, so that nothing but 0 is"),
    (CandidateForm("mean_free_path", 0.0), "slip.mean_free_path: its step is 0, so that nothing but 0 is possible"),
])  # fmt: skip
def test_a_size_that_could_only_be_0_is_refused(form, sentence, monkeypatch):
    monkeypatch.setattr(REGISTRY["slip"], "forms", (form,))
    with pytest.raises(DataError, match=sentence):
        candidates(Twin(load_machine("dtu_gas_bearing")), ["slip"])


def test_an_effect_states_its_own_prior_or_has_ten_steps(monkeypatch):
    twin = Twin(load_machine("dtu_gas_bearing"))
    assert prior_sizes(candidates(twin, ["unequal_pressure"])) == {"unequal_pressure.deviation": "0.4"}
    stated = CandidateForm("deviation", 0.04, prior=0.1)
    monkeypatch.setattr(REGISTRY["unequal_pressure"], "forms", (stated,))
    assert prior_sizes(candidates(twin, ["unequal_pressure"])) == {"unequal_pressure.deviation": "0.1"}


def test_what_the_records_do_not_show_is_counted_with_nothing_missing_by_class():
    """Bow and runout at 1X are one class: no run will separate them, and they stay one among what is not shown."""

    def one(keys, p, shown=False):
        return Explanation(keys, False, 0.0, 1e-3, False, p, shown=shown)

    known = {"shaft_bow.bow", "runout.amplitude_1x", "runout.roughness"}
    found = _merged([one((), 0.6, True), one(("runout.amplitude_1x",), 0.1), one(("shaft_bow.bow",), 0.12),
                     one(("runout.roughness",), 0.18)], known)  # fmt: skip
    assert [e.name for e in found] == ["nothing is missing"]
    nothing = found[0]
    assert nothing.probability == pytest.approx(1.0) and nothing.shown_probability == pytest.approx(0.6)
    assert [(e.name, e.probability) for e in nothing.unseen] == [
        ("runout.roughness", 0.18), ("shaft_bow.bow", pytest.approx(0.22)),
    ]  # fmt: skip
    assert nothing.alike == () and nothing.unseen[1].alike == (("runout.amplitude_1x",),)
    assert (
        nothing.unseen_sentence
    ) == "40 % of it is of effects that these records do not show: runout.roughness, shaft_bow.bow"

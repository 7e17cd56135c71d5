"""Calibrations that something missing has led astray: noticed, and searched from the machine file's own numbers too."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy import diagnose, hide, hypotheses
from rotorsim.discrepancy.calibration import LOSS_LIMITS, LOSS_SD, MESH, FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import Form, candidates
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.fit import ParameterFit, strained
from rotorsim.discrepancy.hidden_machine import HiddenTruth, truth_twin
from rotorsim.discrepancy.hypotheses import EffectSearch
from rotorsim.discrepancy.verdict import judge, without_idle
from rotorsim.machine import load_machine

GAIN, SIZE = FitParameter("gain", 0.1, 1.0, -6.0, 6.0), FitParameter("size", 0.1)
FIRST = FitParameter("first", 0.1)
FORM, OTHER = Form("runout", "runout.roughness", (SIZE,)), Form("coupling", "coupling.force_2x", (FIRST,))
ONES, SIGNS = np.ones(4), np.array([1.0, -1.0, 1.0, -1.0])


class FlatResponse:
    """The size of the candidate shows at a gain of about 0 only, and the gain itself takes a little of the misfit.

    Another effect, of a size of `other`, shows at any gain.
    """

    def __init__(self, other=0.0):
        self.other = other
        self.layout = SimpleNamespace(record=np.zeros(4, int))

    def residual(self, point):
        gain, size, first = (point.values.get(k, 0.0) for k in (GAIN, SIZE, FIRST))
        return (2.0 - 0.1 * gain - size * np.exp(-(gain**2))) * ONES + (self.other - first) * SIGNS

    def predict(self, point):
        return -self.residual(point)

    def jacobian(self, point, parameters, here=None, progress=None, central=False):
        here = self.residual(point)
        return np.column_stack([(here - self.residual(point.moved([k], np.array([1e-6])))) / 1e-6 for k in parameters])


def search(gain, monkeypatch, other=0.0):
    """A search whose calibration stands at a gain; `other` is the size of another effect that is missing."""
    for name, stub in (("table", lambda comparison, residual: residual), ("excess", lambda r: float(r @ r))):
        monkeypatch.setattr(f"rotorsim.discrepancy.hypotheses.{name}", stub)
    monkeypatch.setattr("rotorsim.discrepancy.hypotheses.within_form_error", lambda c, before, after: False)
    comparison, point = FlatResponse(other), ParameterPoint({GAIN: gain})
    r = comparison.residual(point)
    base = ParameterFit((GAIN,), point, r, comparison.jacobian(point, (GAIN,)), float(r @ r))
    columns = {FORM.label: comparison.jacobian(point, (SIZE,))}
    return EffectSearch(comparison, None, base, (FORM,), columns, base.cost, 0.0, updated={FORM.label})


def test_an_effect_is_found_from_the_files_own_numbers_where_the_calibration_hides_it(monkeypatch):
    """At a gain of 5 the candidate does nothing; from 0 its size of 2 takes all."""
    astray = search(5.0, monkeypatch)
    assert all(h.failed or h.gone < 0.1 for h in astray.best_singles())
    astray.before = search(0.0, monkeypatch)
    best = astray.best_singles()[0]
    assert best.fit.cost < 0.01 and best.fit.point.values[SIZE] == pytest.approx(2.0, abs=0.1)


def test_what_is_found_from_there_counts_only_where_it_is_better_than_the_calibration(monkeypatch):
    astray = search(5.0, monkeypatch)
    astray.base = ParameterFit(astray.base.parameters, astray.base.point, astray.base.residual, astray.base.J, 0.0)
    astray.before = search(0.0, monkeypatch)
    assert [h.failed for h in astray.best_singles()] in ([], [True])


@pytest.mark.parametrize(("gain", "found"), [(5.0, True), (2.0, False)])
def test_a_further_effect_is_found_from_the_files_own_numbers_where_the_calibration_is_not_believed(
    gain, found, monkeypatch
):
    """Next to a first effect, which takes its part of the misfit, a gain of 2 is believed and hides the further one.

    The first one's size is found a third too small, and fitted on with the further one.
    """
    astray = search(gain, monkeypatch, other=1.5)
    astray.before = search(0.0, monkeypatch, other=1.5)
    base, point = astray.base, astray.base.point.moved([FIRST], np.array([1.0]))
    residual, J = astray.comparison.residual(point), astray.comparison.jacobian(point, (GAIN, FIRST))
    fit = ParameterFit((*base.parameters, FIRST), point, residual, J, float(residual @ residual))
    assert fit.cost < base.cost - 7
    onward = astray.onward(hypotheses.Hypothesis((OTHER,), fit, fit.cost, 0.0, 0.9))
    assert (onward.before is not None) == found
    if onward.before is not None:
        assert onward.before.base.point.values == {FIRST: 1.0}
        np.testing.assert_allclose(onward.before.base.J[:, 1], SIGNS, atol=1e-6)
    best = min(onward.best_singles(), key=lambda h: h.fit.cost)
    assert (best.fit.cost < 0.01 and best.fit.point.values[SIZE] == pytest.approx(2.0, abs=0.1)) == found
    assert not found or best.fit.point.values[FIRST] == pytest.approx(1.5, abs=0.01)


def test_what_is_idle_in_a_set_from_the_files_own_numbers_is_left_out(monkeypatch):
    """At a gain of 5 the effect alone does nothing: its fit without the idle one begins at the file's numbers too."""
    astray = search(5.0, monkeypatch)
    astray.before = search(0.0, monkeypatch)
    for one in (astray, astray.before):
        one.forms, one.columns = (FORM, OTHER), one.columns | {OTHER.label: SIGNS[:, None]}
    point = ParameterPoint({GAIN: 0.0, SIZE: 2.0, FIRST: 0.0})
    fit = ParameterFit((GAIN, SIZE, FIRST), point, 0 * ONES, np.ones((4, 3)), 0.0)
    found = without_idle(hypotheses.Hypothesis((FORM, OTHER), fit, 0.0, 0.0, 1.0), astray)
    assert found.forms == (FORM,) and found.fit.point.values[SIZE] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("gain", "good", "count"), [(5.0, True, 2), (2.0, True, 1), (2.0, False, 2), (5.0, False, 2)])
def test_sets_are_found_from_the_files_own_numbers_unless_one_that_explains_all_is_believed(
    gain, good, count, monkeypatch
):
    """A set next to a gain of 5 is not believed; where none helps there, responses that oppose each other may hide."""
    astray = search(gain, monkeypatch)
    astray.before = search(0.0, monkeypatch)
    own = hypotheses.Hypothesis((FORM,), astray.base, 0.0, 0.0, 0.0)
    better = ParameterFit((GAIN,), ParameterPoint(), 0 * ONES, np.ones((4, 1)), 0.0)
    there = hypotheses.Hypothesis((FORM, OTHER), better, 0.0, 0.0, 1.0)
    monkeypatch.setattr("rotorsim.discrepancy.hypotheses.passes", lambda h, search: good)
    monkeypatch.setattr(EffectSearch, "sets", lambda self, size: [own] if self is astray else [there])
    monkeypatch.setattr(EffectSearch, "polished", lambda self, h: h)
    assert len(astray.best_sets(2)) == count


@pytest.mark.parametrize(("excess", "goes_on"), [(0.0, True), (1.0, False)])
def test_what_the_calibration_has_taken_up_is_fitted_on_where_nothing_is_flagged(excess, goes_on, monkeypatch):
    """Nothing is flagged: everything is within the form error, which ends a fit elsewhere."""
    astray, rounds = search(1.0, monkeypatch), []
    astray.before = search(0.0, monkeypatch)
    astray.base_excess = astray.before.base_excess = excess
    monkeypatch.setattr("rotorsim.discrepancy.hypotheses.within_form_error", lambda c, before, after: True)
    monkeypatch.setattr("rotorsim.discrepancy.hypotheses.share_gone", lambda left, before: 1.0)
    monkeypatch.setattr(EffectSearch, "polished", lambda self, h, J=None: rounds.append(h.keys) or h)
    assert [h.keys for h in astray.best_singles()] == [(FORM.key,)]
    assert bool(rounds) == goes_on


@pytest.mark.parametrize(("unsteady", "sizes"), [(0.79, [1, 2]), (0.81, [])])
def test_nothing_is_searched_from_the_files_numbers_where_hardly_anything_repeats(unsteady, sizes, monkeypatch):
    """Single effects next to the calibration are fitted all the same."""
    astray, searched = search(0.5, monkeypatch), []
    astray.unsteady = unsteady * astray.base_excess
    monkeypatch.setattr(EffectSearch, "best_singles", lambda self: searched.append(1) or self.singles())
    monkeypatch.setattr(EffectSearch, "best_sets", lambda self, size: searched.append(size) or [])
    verdict = judge(astray)
    assert searched == sizes and [h.keys for h in verdict.tried] == [(FORM.key,)]


@pytest.mark.parametrize(
    ("costs", "end"),
    [
        ([244.0, 54.8, 32.6, 29.9, 8.8, 8.7], 8.7),  # one poor round, then below the calibration
        ([61800.0, 57000.0, 52000.0, 47000.0, 1.0], 52000.0),  # two poor rounds
    ],
)
def test_a_hypothesis_is_fitted_on_while_it_may_reach_the_calibration(costs, end, monkeypatch):
    began, first = scripted(costs, 12.2, 1.0, monkeypatch)
    assert EffectSearch._closer(began, first).fit.cost == end


def test_a_law_that_no_group_shows_is_fitted_on_once_it_is_borne_out(monkeypatch):
    began, first = scripted([3199.4, 3192.7, 3018.4], 3200.6, 0.0, monkeypatch)
    assert EffectSearch._closer(began, first).fit.cost == 3192.7


@pytest.mark.parametrize(
    ("costs", "foretold", "end"),
    [
        # a round that takes little, then one that takes all that is missing
        ([3199.4, 3192.7, 3018.4, 3016.8, 3010.0, 1.0], [9.0, 82.0, 14.0, 14.0, 6.0], 3010.0),
        ([3199.1, 3191.4, 1.0], [9.0, 20.0], 3191.4),  # less than half of a name is foretold
        ([3099.0, 3099.0], [90.0], 3099.0),  # a round that leaves it where it stands
    ],
)
def test_a_hypothesis_is_fitted_on_while_a_name_is_foretold_where_no_misfit_is_shown(costs, foretold, end, monkeypatch):
    began, first = scripted(costs, 3200.6, 0.0, monkeypatch)
    ahead = iter(foretold)
    monkeypatch.setattr(hypotheses, "fall_within", lambda fit, J: next(ahead))
    began.nominal, began._sensitivities = began.base, lambda fit: None
    began._closer_in_noise = partial(EffectSearch._closer_in_noise, began)
    assert EffectSearch._closer(began, first).fit.cost == end


def test_nothing_is_foretold_beyond_a_limit(monkeypatch):
    """A gain may be 6 of the 20 that would take all: one round brings it there, and each takes one Jacobian."""
    astray, taken = search(0.0, monkeypatch), []
    monkeypatch.setattr(astray.comparison, "residual", lambda point: 0 * ONES + 20.0 - point.values.get(GAIN, 0.0))
    own = astray.comparison.jacobian
    monkeypatch.setattr(astray.comparison, "jacobian", lambda *given, **more: taken.append(1) or own(*given, **more))
    fit = replace(astray.base, residual=20 * ONES, cost=1600.0)
    astray.base, astray.nominal, astray.base_excess = fit, fit, 0.0
    found = astray._closer(hypotheses.Hypothesis((FORM,), fit, 0.0, 0.0, 0.0))
    assert found.fit.point.values[GAIN] == 6.0 and len(taken) == 2


def scripted(costs, base, excess, monkeypatch):
    """A search whose rounds end at these costs, and the hypothesis that it begins with."""
    monkeypatch.setattr(hypotheses, "within_form_error", lambda *_: False)
    found = [SimpleNamespace(failed=False, fit=SimpleNamespace(cost=cost, residual=None, point=cost)) for cost in costs]
    rest, own = iter(found[1:]), SimpleNamespace(cost=base, residual=None)
    began = SimpleNamespace(
        base_excess=excess, base=own, nominal=None, comparison=None, polished=lambda h, J=None: next(rest)
    )
    return began, found[0]


@pytest.mark.slow
def test_an_exponent_of_the_discharge_that_all_coefficients_together_take_up_is_named():
    """Nothing is flagged then, and pins and actuators are calibrated to three to six standard deviations."""
    rig = load_machine("dtu_gas_bearing")
    twin = truth_twin(rig)
    form = next(f for f in candidates(twin) if f.label == "discharge_drift.exponent")
    truth = HiddenTruth((form,), ((-0.3,),), ParameterPoint({form.parameters[0]: -0.3}), 3)
    found = diagnose(rig, hide(rig, (form.key,), 3, truth=truth, twin=twin, tiled=True))
    assert found.status == "named"
    assert found.odds["discharge_drift.exponent"] > 0.95


@pytest.mark.parametrize(
    ("value", "names"), [(2.9, []), (-2.9, []), (3.1, ["gain"]), (6.0, ["gain"]), (-6.0, ["gain"])]
)
def test_a_calibration_beyond_three_standard_deviations_or_at_its_limit_is_not_believed(value, names):
    assert strained(ParameterFit((GAIN,), ParameterPoint({GAIN: value}), ONES, np.ones((4, 1)), 4.0)) == names


@pytest.mark.parametrize(("low", "sd", "natural", "named"), [(-0.9, 0.5, 2.0, False), (-0.9, 0.3, 2.0, True),
                                                             (-0.9, 0.5, 0.0, True)])  # fmt: skip
def test_no_damping_at_all_is_believed_where_its_prior_allows_it(low, sd, natural, named):
    damping = FitParameter("shaft_damping", 0.1, sd, low, 5.0)
    fit = ParameterFit((damping,), ParameterPoint({damping: low}), ONES, np.ones((4, 1)), 4.0)
    assert strained(fit, natural) == ([damping.name] if named else [])


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize(("value", "named"), [(LOSS_LIMITS[0], True), (-0.9, False)])
def test_a_bearing_that_has_lost_its_damping_is_far_off_the_file(axis, value, named):
    """Its limit lies within two standard deviations of its prior, which alone does not state it."""
    loss = FitParameter(f"bearing.0.c{axis}", 0.1, LOSS_SD, *LOSS_LIMITS)
    fit = ParameterFit((loss,), ParameterPoint({loss: value}), ONES, np.ones((4, 1)), 4.0)
    assert strained(fit) == ([loss.name] if named else [])


@pytest.mark.parametrize(("value", "names"), [(0.33, []), (1.0, []), (-1.6, ["mesh"]), (5.2, ["mesh"])])
def test_more_of_the_solvers_error_than_all_of_it_once_more_is_not_believed(value, names):
    fit = ParameterFit((MESH,), ParameterPoint({MESH: value}), ONES, np.ones((4, 1)), 4.0)
    assert strained(fit) == names


def test_what_shifts_the_data_alone_says_nothing_of_the_machine():
    zero, trend = FitParameter("offset_x", 1e-7, 5e-5), FitParameter("gain", 0.1, 1.0, trend="speed")
    point = ParameterPoint({zero: 1.0, trend: 9.0})
    assert strained(ParameterFit((zero, trend), point, ONES, np.ones((4, 2)), 4.0)) == []


@pytest.mark.parametrize(("left", "form_error"), [(0.015, True), (0.03, False)])
def test_harmonics_that_an_effect_hardly_makes_are_measured_by_its_largest_one(monkeypatch, left, form_error):
    """2X is left by a 2 % share of the 1X that the effect makes, or more."""

    def groups(comparison, residual):
        return [
            Misfit("a", "p", "x", name, 2, 2 * (abs(s) / 1e-3) ** 2, abs(s), 1e-3, 0.0, 0)
            for name, s in zip(("1X", "2X"), residual, strict=True)
        ]

    monkeypatch.setattr(hypotheses, "table", groups)
    after = np.array([0.0, left])
    assert hypotheses.within_form_error(None, after + np.array([1.0, 0.0]), after) == form_error


def test_the_size_by_sensitivities_alone_is_that_of_least_squares(monkeypatch):
    """Steps of the size differ from 1: the tangent's size is in the parameter's own unit."""
    found = search(0.0, monkeypatch).tangents([FORM.key])[(FORM.key,)]
    assert found.point.values[SIZE] == pytest.approx(2.0, abs=0.05)
    assert float(found.residual @ found.residual) < 0.01

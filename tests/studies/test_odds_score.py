"""Scores of stated probabilities: closed forms on made-up cases."""

from types import SimpleNamespace

import pytest

from rotorsim.discrepancy.verdict import Explanation
from studies.benchmarks import odds_score as score

KNOWN = {"weak_injector.blocked of injector 1", "unequal_pressure.deviation of injector 1", "coupling.force_2x"}


def case(p, right, kind="single", **more):
    """A case whose most probable explanation has probability p."""
    odds = (("a", p, right), ("b", 1 - p, not right))
    return SimpleNamespace(kind=kind, verdict="right", status="named", ties=0, odds=odds, apart=(), **more)


def test_brier_score_and_calibration_error_of_two_thirds():
    found = [case(2 / 3, True), case(2 / 3, True), case(2 / 3, False)]
    assert score.calibration_error(score.reliability(found)) == pytest.approx(0.0, abs=1e-12)
    assert score.brier(c.odds for c in found) == pytest.approx((2 * 2 / 9 + 8 / 9) / 3)
    sure = [case(0.999, True), case(0.999, False)]
    assert score.calibration_error(score.reliability(sure)) == pytest.approx(0.499)
    assert score.reliability([]) == ()


def test_what_is_right_and_not_listed_counts():
    assert score.brier([(("a", 1.0, False),)]) == pytest.approx(2.0)
    assert score.brier([(("a", 1.0, True),)]) == 0.0


def test_wrong_names_above_95_percent_are_counted_and_nothing_is_no_name():
    sure = SimpleNamespace(**vars(case(0.99, False, "none")) | {"odds": (("coupling.force_2x", 0.99, False),)})
    quiet = SimpleNamespace(**vars(case(0.99, False, "none")) | {"odds": (("nothing is missing", 0.99, False),)})
    assert score.sure_and_wrong([sure, quiet], ("none",)) == 1
    assert score.sure_and_wrong([sure], ("foreign",)) == 0


def test_intervals_hold_as_often_as_sizes_are_near():
    found = [SimpleNamespace(apart=(0.5, 1.0)), SimpleNamespace(apart=(1.5, 3.0))]
    assert score.coverage(found, 0.5) == 0.25 and score.coverage(found, 0.9) == 0.75


def test_an_effect_left_out_is_beyond_the_candidates_unless_it_has_a_like():
    like = Explanation(("unequal_pressure.deviation of injector 1",), False, 9.0, 0.0, True, 0.9)
    beyond = Explanation((), True, 1.0, 0.0, True, 0.1)
    rows = score.scored((like, beyond), "left_out", ("weak_injector.blocked of injector 1",), KNOWN)
    assert [right for _, _, right in rows] == [True, False]
    rows = score.scored((like, beyond), "left_out", ("coupling.force_2x",), KNOWN)
    assert rows[0][2] is False and rows[1] == ("beyond the catalogue", 0.1, True)
    rows = score.scored((like, beyond), "none", (), KNOWN)
    assert not any(right for _, _, right in rows)

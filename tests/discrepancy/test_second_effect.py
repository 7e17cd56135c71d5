"""A further effect next to another: not where their responses cancel, nor for what the first one's form leaves."""

import numpy as np
import pytest

from rotorsim.discrepancy.residuals.localise import Flag
from rotorsim.discrepancy.search import second_effect
from rotorsim.discrepancy.search.indistinguishable import same_class
from rotorsim.discrepancy.search.second_effect import cancel, within_form_error


def test_responses_that_cancel_are_noticed_and_others_are_not(rng):
    a, b = rng.normal(size=(2, 200))
    assert cancel([a, -0.97 * a + 0.1 * b])
    assert not cancel([a]) and not cancel([a, b]) and not cancel([a, a]) and not cancel([a, -0.3 * a])


@pytest.mark.parametrize(
    ("left", "group", "form_error"), [(0.06, "1X", True), (0.3, "1X", False), (0.06, "2X", False), (0.0, "1X", True)]
)
def test_what_is_small_in_the_groups_of_the_effect_itself_is_its_form_error(monkeypatch, left, group, form_error):
    def groups(comparison, residual):
        sizes = {"1X": abs(residual[0]), "2X": abs(residual[1])}
        return [Flag("a", "p", "x", g, 2, 2 * (s / 1e-3) ** 2, s, 1e-3, 0.0, 0) for g, s in sizes.items()]

    monkeypatch.setattr(second_effect, "table", groups)
    after = np.array([left, 0.0]) if group == "1X" else np.array([0.0, left])
    assert within_form_error(None, after + np.array([1.0, 0.0]), after) == form_error


def test_effects_of_one_class_are_never_combined():
    assert same_class("weak_injector.blocked of injector 2", "unequal_pressure.deviation of injector 2")
    assert not same_class("weak_injector.blocked of injector 2", "unequal_pressure.deviation of injector 3")
    assert same_class("runout.amplitude_1x", "shaft_bow.bow")
    assert not same_class("coupling.force_2x", "coupling.force_2x")  # of no class

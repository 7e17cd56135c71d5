"""A further effect next to another: not where their responses cancel, nor for what the first one's form leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy import hypotheses
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import Form, alike_by_weight, of_one_force, same_class
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.hypotheses import EffectSearch, cancel, within_form_error


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
        return [Misfit("a", "p", "x", g, 2, 2 * (s / 1e-3) ** 2, s, 1e-3, 0.0, 0) for g, s in sizes.items()]

    monkeypatch.setattr(hypotheses, "table", groups)
    after = np.array([left, 0.0]) if group == "1X" else np.array([0.0, left])
    assert within_form_error(None, after + np.array([1.0, 0.0]), after) == form_error


def test_effects_of_one_class_are_never_combined():
    assert same_class("weak_injector.blocked of injector 2", "unequal_pressure.deviation of injector 2")
    assert not same_class("weak_injector.blocked of injector 2", "unequal_pressure.deviation of injector 3")
    assert same_class("runout.amplitude_1x", "shaft_bow.bow")
    assert not same_class("coupling.force_2x", "coupling.force_2x")  # of no class


def test_circulatory_forces_are_named_alone_and_are_no_class():
    assert of_one_force("internal_damping.time", "labyrinth_seal.cross_stiffness")
    assert not same_class("internal_damping.time", "labyrinth_seal.cross_stiffness")
    assert not of_one_force("internal_damping.time", "coupling.force_2x")
    assert not of_one_force("coupling.force_2x", "coupling.force_3x")


@pytest.mark.parametrize(("size", "slope", "sure"), [(6.0, 0.0, True), (4.0, 0.0, False), (6.0, 0.9, True)])
def test_an_effect_is_sure_by_its_size_at_the_shape_found(rng, size, slope, sure):
    """Responses of unit length, noise of 1: the standard deviation of a size is 1, of whatever shape goes along."""
    records, lines = 40, 50
    q, _ = np.linalg.qr(rng.normal(size=(records * lines, 2)))
    amount, shape = FitParameter("rub.0.stiffness", 1.0), FitParameter("rub.0.gap", 1.0)
    J = np.column_stack([q[:, 0], slope * q[:, 0] + np.sqrt(1 - slope**2) * q[:, 1]])
    residual = rng.normal(size=len(J))
    residual -= q @ (q.T @ residual)  # at the best fit
    fit = ParameterFit((amount, shape), ParameterPoint({amount: size, shape: 0.3}), residual, J, 0.0)
    layout = SimpleNamespace(record=np.repeat(np.arange(records), lines))
    search = EffectSearch(SimpleNamespace(layout=layout), None, fit, (), {}, 0.0, 0.0)
    form = Form("rub", "rub.stiffness", (amount,), refine=(shape,))
    assert search.is_sure(SimpleNamespace(fit=fit), [form]) == sure


@pytest.mark.parametrize(("sizes", "fitted"), [((9.0, 5.0), False), ((9.0, 11.0), True)])
def test_a_pair_that_cannot_be_better_than_what_it_holds_is_not_fitted(sizes, fitted, monkeypatch):
    """It is named where the sum of squares falls by 100 more; by 81 and 25 nothing can come of it."""
    forms = tuple(Form(name, f"{name}.x", (FitParameter(f"{name}.0.x", 1.0),)) for name in "ab")
    e = np.eye(9)
    base = ParameterFit((FitParameter("c", 1.0),), ParameterPoint(), e[:, :2] @ sizes, e[:, 8:], float(sum(sizes)))
    columns, seen = {f.label: e[:, i : i + 1] for i, f in enumerate(forms)}, list[tuple[str, ...]]()
    one = SimpleNamespace(fit=SimpleNamespace(cost=0.0))
    monkeypatch.setattr(EffectSearch, "hypothesis", lambda self, own, start: seen.append(own) or one)
    EffectSearch(None, None, base, forms, columns, 100.0, 0.0, updated=set(columns)).sets(2)
    assert bool(seen) == fitted


KNOWN = {"coupling.force_2x", "coupling.force_3x", "crack.loss", "asymmetric_shaft.difference", "rub.stiffness"}
FORWARD = ("asymmetric_shaft.difference", "coupling.force_2x", "crack.loss")


@pytest.mark.parametrize(
    ("key", "ellipticity", "alike"),
    [
        ("coupling.force_2x", 1.0, FORWARD),
        ("coupling.force_2x", -1.0, ("coupling.force_2x",)),
        ("coupling.force_3x", 1.0, ("coupling.force_3x",)),
        ("asymmetric_shaft.difference", 0.0, FORWARD),
        ("crack.loss", 0.0, ("crack.loss",)),
    ],
)
def test_a_force_that_turns_forward_at_2x_may_be_a_shaft_of_unequal_stiffness(key, ellipticity, alike):
    assert alike_by_weight(key, {"ellipticity": ellipticity, "difference": 2e3}, KNOWN) == alike

"""A further effect next to another: not where their responses cancel, nor for what the first one's form leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy import hypotheses
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import Form, alike_by_weight, candidates, counterpart, of_one_force, same_class
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.hypotheses import EffectSearch, Hypothesis, cancel, within_form_error
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import _counterpart
from rotorsim.effects.actuators.actuator_gain import ActuatorGain, actuator_gain
from rotorsim.effects.rotor.labyrinth_seal import LabyrinthSeal, labyrinth_seal
from rotorsim.effects.supply.weak_injector import WeakInjector, weak_injector
from rotorsim.machine import load_machine

DAMPING, SWIRL, DAMPED = (
    FitParameter("labyrinth_seal.0.damping", 0.1),
    "labyrinth_seal.0.swirl",
    "internal_damping.time",
)


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


@pytest.mark.parametrize(
    ("key", "other"),
    [
        ("actuator_gain.error of injector 3", "weak_injector.stuck of injector 3"),
        ("labyrinth_seal.damping", "internal_damping.time"),
        ("labyrinth_seal.damping of disc 2", "internal_damping.time"),
    ],
)
def test_a_force_has_a_counterpart_of_its_own_injector(key, other):
    assert counterpart(key)[0] == other
    assert counterpart("actuator_gain.error") is None and counterpart("labyrinth_seal.cross_stiffness") is None


@pytest.mark.parametrize("name", ["dtu_gas_bearing", "plain_rotor", "foil_turbo_rotor"])
def test_the_whole_catalogue_has_every_counterpart_among_its_candidates(name):
    """A fit then measures how much the counterpart explains."""
    keys = {form.key for form in candidates(Twin(load_machine(name), (16, 4), 2e-4))}
    found = [one[0] for one in map(counterpart, keys) if one is not None]
    assert found and set(found) <= keys


def test_a_weak_drive_moves_the_opening_as_a_pin_that_sticks_at_its_rest():
    gap, rest, share = 40e-6, 22e-6, 0.3
    drive = ActuatorGain(injector=2.0, error=-share)
    pin = WeakInjector(injector=2.0, stuck=share, stuck_opening=1 - rest / gap)
    for moved in np.linspace(-10e-6, 10e-6, 5):
        x, _ = actuator_gain.py_func(0.0, 0.0, 2.0, 0.0, moved, 0.0, drive)
        opening, _ = weak_injector.py_func(0.0, 1.0, 1 - (rest + moved) / gap, 0.0, pin)
        assert opening == pytest.approx(1 - (rest + x) / gap, rel=1e-12)


def test_a_seal_whose_gas_turns_with_the_shaft_is_internal_damping_in_its_plane(rng):
    seal, speed, (x, y, vx, vy) = LabyrinthSeal(damping=7.0, swirl=1.0), 300.0, rng.normal(size=4)
    force = labyrinth_seal.py_func(0.0, 0.0, speed, x, y, vx, vy, seal)
    assert force == pytest.approx((-7.0 * (vx + speed * y), -7.0 * (vy - speed * x)))


class SealResponse:
    """A damping of 2, and a cross-coupling that shows the share of the swirl, .5, as far as it is `seen`."""

    layout, twin = SimpleNamespace(record=np.zeros(4, int)), SimpleNamespace(effect=lambda name, table: LabyrinthSeal())

    def __init__(self, seen):
        self.seen = seen

    def residual(self, point):
        damping, swirl = point.values.get(DAMPING, 0.0), point.fixed[SWIRL]
        signs = np.array([1.0, -1.0, 1.0, -1.0])
        return 1e2 * (2.0 - damping) * np.ones(4) + 1e2 * self.seen * (1.0 - damping * swirl) * signs

    def predict(self, point):
        return -self.residual(point)

    def jacobian(self, point, parameters, here=None, progress=None, central=False):
        r = self.residual(point)
        return np.column_stack([(r - self.residual(point.moved([k], np.array([1e-6])))) / 1e-6 for k in parameters])


@pytest.mark.parametrize(
    ("seen", "known", "alike"), [(0.01, set(), True), (1.0, set(), False), (0.01, {DAMPED}, False)]
)
def test_a_seal_may_be_internal_damping_where_records_hardly_show_its_swirl(seen, known, alike, monkeypatch):
    """A candidate has a fit of its own."""
    for name, stub in (("table", lambda comparison, residual: residual), ("excess", lambda r: float(r @ r))):
        monkeypatch.setattr(hypotheses, name, stub)
    records, form = SealResponse(seen), Form("labyrinth_seal", "labyrinth_seal.damping", (DAMPING,), {SWIRL: 0.5})
    at = ParameterPoint({DAMPING: 2.0}, {SWIRL: 0.5})
    base = ParameterFit((), ParameterPoint(), 200 * np.ones(4), np.zeros((4, 0)), 1.6e5)
    fit = ParameterFit((DAMPING,), at, records.residual(at), records.jacobian(at, (DAMPING,)), 0.0)
    search = EffectSearch(records, None, base, (form,), {}, 1.0, 0.0)
    found = _counterpart(search, Hypothesis((form,), fit, 0.0, 0.0, 1.0), form.key, known)
    assert found == ((DAMPED,) if alike else ())


@pytest.mark.parametrize(("error", "alike"), [(-0.96, True), (0.015, True), (0.05, False)])
def test_a_weak_drive_may_be_a_stuck_pin_where_its_size_may_be_a_loss_of_travel(error, alike):
    size, at = FitParameter("actuator_gain.0.error", 0.01), "actuator_gain.0.injector"
    form = Form("actuator_gain", "actuator_gain.error of injector 3", (size,), {at: 3.0})
    fit = ParameterFit((size,), ParameterPoint({size: error}, {at: 3.0}), np.zeros(4), np.full((4, 1), 50.0), 0.0)
    records = SimpleNamespace(
        layout=SealResponse.layout, twin=SimpleNamespace(effect=lambda name, table: ActuatorGain())
    )
    search = EffectSearch(records, None, fit, (form,), {}, 1.0, 0.0)
    found = _counterpart(search, Hypothesis((form,), fit, 0.0, 0.0, 1.0), form.key, set())
    assert found == (("weak_injector.stuck of injector 3",) if alike else ())

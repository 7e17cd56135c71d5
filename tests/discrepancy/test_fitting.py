"""Damped least squares, projection and classes of indistinguishable effects, without a plant."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy import fit
from rotorsim.discrepancy.calibration import (
    REFERENCE_SPEED,
    FitParameter,
    ParameterPoint,
    calibration,
    contributions,
    sd_of_polar,
    setting,
)
from rotorsim.discrepancy.candidates import Form, class_of, screen
from rotorsim.discrepancy.fit import (
    LENGTHS,
    MOST_STEPS,
    ParameterFit,
    covariance,
    far_places,
    fit_parameters,
    most_simulations,
    recalibrate,
    relinearised,
    singular_directions,
)
from rotorsim.discrepancy.judge import VERDICTS
from rotorsim.discrepancy.twin import Twin
from rotorsim.effects import REGISTRY
from rotorsim.effects.base import forms_of_parameters
from rotorsim.machine import load_machine

pytestmark = pytest.mark.numerical

A, B = FitParameter("a", 0.1), FitParameter("b", 0.1)
FLAG = SimpleNamespace(number=0, channel="x", group="1X", chi2=1.0, excess=1.0)


@dataclass
class Curve:
    """y = exp(a t) + b t^2, measured without error at a = 0.7, b = -0.4."""

    t: np.ndarray = field(default_factory=lambda: np.linspace(0, 2, 20))

    def residual(self, point):
        a, b = point.values.get(A, 0.0), point.values.get(B, 0.0)
        return np.exp(0.7 * self.t) - 0.4 * self.t**2 - np.exp(a * self.t) - b * self.t**2


def test_a_nonlinear_fit_with_a_kept_jacobian_converges():
    t = np.linspace(0, 2, 20)
    start = float(np.sum(Curve().residual(ParameterPoint()) ** 2))
    found = fit_parameters(Curve(), ParameterPoint(), [A, B], np.column_stack([t, t**2]), steps=40)
    assert found.cost < 0.02 * start
    J = np.column_stack([t * np.exp(found.vector[0] * t), t**2])
    better = fit_parameters(Curve(), found.point, [A, B], J, steps=40)
    assert better.cost < 1e-3 * start


@pytest.mark.parametrize(("off", "runs"), [(0.01, 0), (0.05, 3), (0.5, 12)])
def test_a_fit_runs_no_step_of_which_little_is_foretold(off, runs):
    """Steps foretold to take 0.01, 0.25 and 25 of 100 off the sum of squares, of a residual that nothing changes."""
    tried = []
    still = SimpleNamespace(residual=lambda point: tried.append(point) or residual)
    residual = np.append(np.full(4, 10 * off / 2), np.full(96, np.sqrt((100 - 100 * off**2) / 96)))
    J = np.zeros((100, 1))
    J[:4] = 1.0
    found = fit_parameters(still, ParameterPoint(), [A], J, residual)
    assert len(tried) == runs and found.point == ParameterPoint()


class Restless:
    """Comparison whose every line stays flagged, and whose columns take a simulation each."""

    def __init__(self, twin):
        lines = SimpleNamespace(groups=["resonance"], group=np.zeros(9, int), frequency=np.ones(9))
        self.twin, self.trials, self.layout, self.sigma = twin, [], lines, np.ones(9)
        self.directions, self.measured, self.stored = {}, np.ones(9), self

    def predict(self, point):
        return np.zeros(9)

    def residual(self, point):
        return np.ones(9)

    def set_floor(self, *given):
        pass

    def columns(self, point, parameters, progress):
        for _ in {replace(k, trend="").name for k in parameters}:
            progress()
        return np.ones((9, len(parameters)))

    def jacobian(self, point, parameters, progress):
        return self.columns(point, parameters, progress)


@pytest.mark.parametrize("repeats", [2, 7])
def test_the_most_simulations_of_a_recalibration_are_those_of_one_in_which_no_step_is_spared(repeats, monkeypatch):
    """Every fit takes all its steps at all lengths, halves the sum of squares, and is repeated while it may be."""

    def fitted(comparison, point, parameters, J, residual=None, steps=MOST_STEPS, progress=None):
        for _ in range(steps * len(LENGTHS)):
            progress()
        costs.append(costs[-1] / 2)
        return ParameterFit(tuple(parameters), point, np.ones(9), J, costs[-1])

    twin, costs, calls = Twin(load_machine("plain_rotor"), only=()), [1e9], []
    for name, value in (("fit_parameters", fitted), ("table", lambda *given: [FLAG]), ("flagged", list),
                        ("foreseen", lambda *given: lambda shift: 0.0)):  # fmt: skip
        monkeypatch.setattr(fit, name, value)
    comparison, step = Restless(twin), lambda: calls.append(1)
    base = recalibrate(comparison, None, progress=step)
    for _ in range(repeats):
        base = relinearised(comparison, base, step)
    far_places(comparison, base, step)
    assert len(calls) == most_simulations(calibration(twin), repeats)


def test_a_prior_holds_what_the_data_do_not_tell():
    tight = FitParameter("a", 0.1, sd=1e-6)
    t = np.linspace(0, 2, 20)
    found = fit_parameters(Curve(), ParameterPoint(), [tight, B], np.column_stack([t, t**2]))
    assert abs(found.point.values[tight]) < 1e-4


def test_two_parameters_that_do_the_same_are_a_null_vector(rng):
    x, y = rng.normal(size=(2, 50))
    null = singular_directions(np.column_stack([x, y, x + 1e-6 * y]), [A, B, FitParameter("c", 1.0)])
    assert len(null) == 1
    assert set(null[0]) == {"a", "c"}
    assert not singular_directions(np.column_stack([x, y]), [A, B])


def form(name):
    return Form(name, f"{name}.x", (FitParameter(f"{name}.0.x", 2.0),))


def test_the_drop_of_a_form_is_that_of_a_joint_least_squares(rng):
    J, S, r = rng.normal(size=(60, 3)), rng.normal(size=(60, 1)), rng.normal(size=60)
    parameters = tuple(FitParameter(n, 1.0) for n in "abc")
    x = np.linalg.lstsq(J, r, rcond=None)[0]
    base = ParameterFit(parameters, ParameterPoint(), r - J @ x, J, 0.0)
    view = screen(base, [form("f")], [S])
    joint = np.linalg.lstsq(np.column_stack([J, S]), r, rcond=None)
    drop, steps = view.drop(0)
    assert drop == pytest.approx(base.chi2 - float(joint[1][0]), rel=1e-8)
    assert steps[0] * 2.0 == pytest.approx(joint[0][3], rel=1e-8)


def test_a_form_that_the_calibration_imitates_explains_nothing(rng):
    J = rng.normal(size=(60, 2))
    base = ParameterFit((A, B), ParameterPoint(), rng.normal(size=60), J, 0.0)
    view = screen(base, [form("f"), form("g")], [J @ [[1.0], [2.0]], rng.normal(size=(60, 1))])
    assert view.drop(0)[0] == 0.0
    assert view.survives(0) < 1e-6 < view.survives(1)


def test_the_size_that_records_show_is_that_whose_signature_makes_the_sum_of_squares(rng):
    """The phase and the place that show least count, and the option that shows most."""
    e, J = np.eye(60), np.eye(60)[:, 50:52]
    base = ParameterFit((A, B), ParameterPoint(), np.zeros(60), J, 0.0)
    phases = tuple(FitParameter(f"f.0.x~p.{part}", 0.5) for part in "cs")
    forms = [Form("f", "f.x", phases), *(Form("g", f"g.x of disc {i}", (FitParameter("g.0.x", 2.0),)) for i in (1, 2)),
             *(Form("h", f"h.x @ o {i}", (FitParameter("h.0.x", 2.0),)) for i in (1, 2)), form("k")]  # fmt: skip
    columns = [e[:, :2] * [4.0, 0.5], 5 * e[:, 3:4], 20 * e[:, 4:5], 5 * e[:, 5:6], 20 * e[:, 6:7], J[:, :1]]
    found = screen(base, forms, columns).seen_from(100.0)
    assert found == pytest.approx({"f.x": 20.0, "g.x": 2.0, "h.x": 0.5, "k.x": np.inf})


def test_forms_with_the_same_signature_are_alike(rng):
    J, s = rng.normal(size=(60, 2)), rng.normal(size=(60, 2))
    base = ParameterFit((A, B), ParameterPoint(), rng.normal(size=60), J, 0.0)
    two = Form("f", "f.x", (FitParameter("f.0.x~p.c", 1.0), FitParameter("f.0.x~p.s", 1.0)))
    view = screen(base, [two, form("g"), form("h")], [s, s[:, :1] + J @ [[3.0], [1.0]], rng.normal(size=(60, 1))])
    assert view.likeness(0, 1) == pytest.approx(1.0, abs=1e-6)
    assert view.likeness(0, 2) < 0.7


def test_a_bow_is_never_distinguished_from_a_runout_nor_a_blocked_pin_from_a_low_pressure():
    third = "unequal_pressure.deviation of injector 3"
    known = {"runout.amplitude_1x", "shaft_bow.bow", "weak_injector.blocked of injector 2",
             "unequal_pressure.deviation of injector 2", third, "creep.gain"}  # fmt: skip
    assert class_of("shaft_bow.bow", known) == ("runout.amplitude_1x", "shaft_bow.bow")
    assert class_of("unequal_pressure.deviation of injector 2", known) == (
        "unequal_pressure.deviation of injector 2", "weak_injector.blocked of injector 2",
    )  # fmt: skip
    assert class_of("creep.gain", known) == ("creep.gain",)


def test_a_trend_counts_by_the_operating_point():
    parameter = FitParameter("discharge_drift.0.drift", 0.1, trend="pressure")
    sums = contributions({parameter: 0.1, FitParameter("discharge_drift.0.drift", 0.1): 0.02}, REFERENCE_SPEED, 0.75e6)
    assert sums["discharge_drift.0.drift"] == pytest.approx(0.02 + 0.1 * 0.5)


def test_scatter_between_records_widens_a_standard_deviation(rng):
    n, m = 40, 6
    J = np.ones((n * m, 1))
    record = np.repeat(np.arange(m), n)
    white = ParameterFit((A,), ParameterPoint(), rng.normal(size=n * m), J, 0.0)
    together = ParameterFit((A,), ParameterPoint(), white.residual + 3 * rng.normal(size=m)[record], J, 0.0)
    plain = 1 / np.sqrt(n * m)
    assert np.sqrt(covariance(white, record)[0, 0]) == pytest.approx(plain, rel=0.7)
    assert np.sqrt(covariance(together, record)[0, 0]) > 8 * plain


def test_an_amplitude_and_its_phase_get_standard_deviations():
    a, phi, sd_a, sd_phi = sd_of_polar(0.0, 2.0, np.diag([0.01, 0.04]))
    assert (a, phi) == pytest.approx((2.0, np.pi / 2))
    assert (sd_a, sd_phi) == pytest.approx((0.2, 0.05))


def test_every_effect_of_the_catalogue_gets_recipes_from_its_own_parameters():
    assert [r.parameter for r in forms_of_parameters(REGISTRY["creep"])] == ["gain"]
    own = forms_of_parameters(REGISTRY["unbalance"])
    assert [(r.parameter, r.phase) for r in own] == [("me", "phase")]


def test_exit_codes_are_those_of_the_interface():
    codes = {"no_disagreement": 0, "named": 10, "tie": 11, "partial": 11, "unknown": 12, "recalibrated": 13}
    codes |= {"discovered": 14, "stochastic": 15}
    assert {status: text.exit_code for status, text in VERDICTS.items()} == codes


def test_the_phase_of_lobes_is_the_place_of_one_of_them():
    """cos n (theta - phi): cosine and sine of the wave are n phi apart, a quarter of a lobe."""
    twin = Twin(load_machine("dtu_gas_bearing"), only=("out_of_round",))
    stem = "out_of_round.0.sleeve~sleeve_phase"
    found = setting(twin, {f"{stem}.s": 2e-6}, {"out_of_round.0.sleeve_lobes": 3.0})
    assert found["out_of_round.0.sleeve"] == pytest.approx(2e-6)
    assert found["out_of_round.0.sleeve_phase"] == pytest.approx(np.pi / 2 / 3)
    both = setting(twin, {f"{stem}.c": 1e-6, f"{stem}.s": 1e-6})  # two lobes, as by default
    assert both["out_of_round.0.sleeve_phase"] == pytest.approx(np.pi / 4 / 2)

"""Exchange with the package `control`: plants, models and laws both ways, its systems as controllers."""

import numpy as np
import pytest

import rotorsim as rs
from refusals import refused
from rotorsim.base.errors import ControllerError, DataError, LawError, ModelError

control = pytest.importorskip("control")
P, W = 0.5e6, 300.0
TS = 2e-4


@pytest.fixture(scope="module")
def plant():
    return rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


def lag(gain=0.2e6, corner=6283.0):
    """First-order lag with a gain [V/m]."""
    return control.tf([gain], [1 / corner, 1.0])


def feedback(Ts=TS):
    """Sampled lags on both axes, a StateSpace."""
    continuous = control.ss(control.append(control.tf2ss(lag()), control.tf2ss(lag())))
    return control.sample_system(continuous, Ts, "tustin")


def test_the_linear_plant_becomes_a_state_space_of_the_same_response(plant):
    linear = plant.linearise(W, P)
    system = linear.to_control()
    assert system.input_labels == list(linear.inputs) and system.output_labels == ["disc_x", "disc_y"]
    s = 700j
    np.testing.assert_allclose(system(s), linear.transfer(s), rtol=1e-6)
    assert np.linalg.cond(system.A) < 1e6  # 1e32 in SI: slycot's response of that was wrong by percents


@pytest.mark.parametrize("Ts", [0.0, TS])
def test_a_linear_model_comes_back_bit_for_bit(Ts):
    rng = np.random.default_rng(1)
    model = rs.LinearModel(
        0.1 * rng.normal(size=(4, 4)), rng.normal(size=(4, 2)), rng.normal(size=(2, 4)), np.zeros((2, 2)), Ts,
        speed=W, pressure=P,
    )  # fmt: skip
    back = rs.LinearModel.from_control(model.to_control(), W, P)
    for name in ("A", "B", "C", "D"):
        np.testing.assert_array_equal(getattr(back, name), getattr(model, name))
    assert (back.Ts, back.inputs, back.outputs, back.speed) == (model.Ts, model.inputs, model.outputs, W)


def test_a_transfer_function_of_two_axes_keeps_its_response():
    rng = np.random.default_rng(2)
    numerators = [[[*rng.normal(size=2)], [1.0]], [[0.0], [*rng.normal(size=3)]]]
    denominators = [[[1.0, 2.0, 5.0], [1.0, 3.0]], [[1.0], [1.0, 1.0, 4.0]]]
    system = control.tf(numerators, denominators)
    model = rs.LinearModel.from_control(system)
    assert model.order == 5
    for omega in (0.0, 0.7, 30.0):
        np.testing.assert_allclose(model.transfer(omega)[0], system(1j * omega), rtol=1e-12)


def test_surfaces_go_through_the_systems_they_are_made_of():
    points = [(w, p) for w in (0.0, 300.0, 600.0) for p in (3e5, 5e5, 7e5)]
    systems = {(w, p): control.ss([[0.9 - w / 1e4, p / 1e7], [0, 0.8]], np.eye(2), np.eye(2), 0, TS) for w, p in points}
    lpv = rs.LpvModel.from_control(systems, order=1)
    for point, system in systems.items():
        np.testing.assert_allclose(lpv.to_control(*point).A, system.A, atol=1e-12)


def test_a_law_comes_back_bit_for_bit():
    law = rs.Law.from_control(feedback(), name="lag")
    again = rs.Law.from_control(law.to_control())
    for name in ("A", "B", "C", "D"):
        np.testing.assert_array_equal(getattr(again, name), getattr(law, name))
    assert again.name == "lag" and law.Ts == TS


def test_a_law_does_what_the_system_it_is_made_of_does():
    system = feedback()
    law = rs.Law.from_control(system, average=0, fade=0)
    law.reset()
    y = 1e-6 * np.random.default_rng(3).normal(size=(2, 200))
    expected = control.forced_response(system, np.arange(200) * TS, y).outputs
    np.testing.assert_allclose([law.step(one, W, P) for one in y.T], expected.T, rtol=1e-9, atol=1e-12)


def test_systems_over_a_grid_become_a_scheduled_law():
    points = [(w, p) for w in (0.0, 300.0) for p in (3e5, 5e5, 7e5)]
    systems = {point: (1.0 + point[0] / 300.0 + point[1] / 1e6) * feedback() for point in reversed(points)}
    law = rs.Law.from_control(systems, average=0, fade=0, limit=3.0)
    assert law.speeds.tolist() == [0.0, 300.0] and law.pressures.tolist() == [3e5, 5e5, 7e5] and law.limit == 3.0
    for point, system in systems.items():
        one = rs.Law.from_control(system)
        for found, wanted in zip(law.at(*point), one.at(0.0, 0.0), strict=True):
            np.testing.assert_array_equal(found, wanted)
    z = np.exp(0.1j)  # the gain alone is scheduled, and linear in both, so what is between is exact
    np.testing.assert_allclose(law.to_control(75.0, 4e5)(z), (1.25 + 0.4) * feedback()(z), rtol=1e-12)


def test_a_law_from_elsewhere_has_the_limits_of_one_that_was_designed_on_the_model(model):
    law = rs.Law.from_control(feedback(), model=model, limit=3.0)
    wanted = rs.control.plausibility_of(model, TS, 3.0)
    np.testing.assert_array_equal(law.plausibility.table, wanted.table)
    assert 0 < law.plausibility.jump < np.inf and 0 < law.plausibility.range < np.inf
    both = rs.Law.from_control({(0.0, 3e5): feedback(), (300.0, 3e5): feedback()}, model=model)
    assert both.plausibility.speed_jump < np.inf == law.plausibility.speed_jump  # a scheduled one checks its point
    own = rs.control.Plausibility(range=2e-5)
    assert rs.Law.from_control(feedback(), model=model, plausibility=own).plausibility is own
    assert rs.Law.from_control(feedback()).plausibility is None


@pytest.mark.parametrize(
    "systems, value",
    [
        ({}, None),
        ({(0.0, 3e5): feedback(), (300.0, 5e5): feedback()}, (0.0, 5e5)),
        ({(0.0, 3e5): feedback(), (300.0, 3e5): control.ss([], [], [], np.eye(2), TS)}, (300.0, 3e5)),
    ],
)
def test_systems_that_make_no_table_are_refused(systems, value):
    with pytest.raises(rs.errors.LawError) as refused:
        rs.Law.from_control(systems)
    assert (refused.value.argument, refused.value.value) == ("system", value)


def test_an_unstable_law_is_a_warning_also_between_the_points_of_its_table(tmp_path, recwarn):
    def system(A):
        return control.ss(A, 1e5 * np.eye(2), np.eye(2), 0, TS)

    stable = [[[0.5, 3.0], [0.0, 0.5]], [[0.5, 0.0], [3.0, 0.5]]]  # half way: eigenvalues 2 and -1
    both = dict(zip(((0.0, 3e5), (300.0, 3e5)), map(system, stable), strict=True))
    rs.Law.from_control(system(np.eye(2)))  # integrators
    rs.Law.from_control(both[0.0, 3e5])
    assert not recwarn.list
    with pytest.warns(rs.errors.UnstableLaw):
        rs.Law.from_control(system(1.001 * np.eye(2))).save(tmp_path / "law.mat")
    with pytest.warns(rs.errors.UnstableLaw):
        rs.load_law(tmp_path / "law.mat")
    with pytest.warns(rs.errors.UnstableLaw):
        rs.Law.from_control(both)


def test_a_continuous_system_is_sampled_by_tustins_rule_where_a_period_is_given():
    continuous = control.append(control.tf2ss(lag()), control.tf2ss(lag()))
    law, own = rs.Law.from_control(continuous, Ts=TS), feedback()
    for f in (10.0, 300.0):
        z = np.exp(2j * np.pi * f * TS)
        np.testing.assert_allclose(law.to_control()(z), own(z), rtol=1e-9)


@pytest.mark.parametrize("form", ["StateSpace", "TransferFunction", "NonlinearIOSystem", "function", "object"])
def test_a_system_a_function_and_an_object_control_the_plant_alike(plant, form):
    """All five are the same sampled lag about the equilibrium."""
    system, centre = feedback(), plant.equilibrium(W, P).disc
    step = np.zeros((500, 2))
    step[50:60, 0] = 20.0
    expected = plant.simulate(0.1, W, P, disc_force=step, controller=Stepped(system, centre))
    forms = {
        "StateSpace": system,
        "TransferFunction": control.tf(
            [[control.ss2tf(system[0, 0]).num[0][0], [0.0]], [[0.0], control.ss2tf(system[1, 1]).num[0][0]]],
            [[control.ss2tf(system[0, 0]).den[0][0], [1.0]], [[1.0], control.ss2tf(system[1, 1]).den[0][0]]], TS,
        ),
        "NonlinearIOSystem": control.nlsys(
            lambda t, x, u, params: system.A @ x + system.B @ u, lambda t, x, u, params: system.C @ x + system.D @ u,
            inputs=2, outputs=2, states=2, dt=TS,
        ),
        "function": Stepped(system, centre).step,
        "object": Stepped(system, centre),
    }  # fmt: skip
    found = plant.simulate(0.1, W, P, disc_force=step, controller=forms[form])
    assert np.abs(found["reference"]).max() > 0.1
    np.testing.assert_allclose(found["disc"], expected["disc"], rtol=0, atol=1e-12)


class Stepped:
    """A sampled StateSpace in an object with a `step`."""

    def __init__(self, system, centre):
        self.system, self.centre, self.x = system, centre, np.zeros(2)

    def step(self, measured, speed, pressure):
        u = measured - self.centre
        y = self.system.C @ self.x + self.system.D @ u
        self.x = self.system.A @ self.x + self.system.B @ u
        return y


def test_an_experiment_runs_under_a_system_and_names_it(plant):
    named = control.ss(feedback(), name="mine")
    record = rs.experiments.controlled(plant, named, W, P, 0.05)
    assert record.attrs["controller"] == "StateSpace" and record.attrs["law"] == "mine"
    assert np.isfinite(record["disc"]).all()


def test_the_nonlinear_plant_steps_as_the_simulation_does(plant):
    n = 60
    reference = np.tile([0.5, -0.3], (n, 1))
    expected = plant.simulate(n * TS, W, P, reference=reference)["disc"].values
    system = plant.to_control(W, P)
    U = np.tile([[W], [P], [0.5], [-0.3], [0.0], [0.0]], n)
    found = control.input_output_response(system, np.arange(n) * TS, U, system.initial).outputs
    np.testing.assert_array_equal(found.T, expected)


@pytest.mark.slow
def test_a_system_is_verified_as_its_law_is(plant):
    system = feedback()
    made = rs.closed_loop(system, plant, quick=True)
    law = rs.closed_loop(rs.Law.from_control(system), plant, quick=True)
    assert [row.measured for row in made.rows] == [row.measured for row in law.rows]


def test_a_controller_that_is_no_law_is_verified_like_the_law_it_equals(plant):
    """Rows of one impact run: a function in Python against the law's kernel."""
    from rotorsim.verify.runs import as_law, run_rows, steady_rows

    system, centre = feedback(), plant.equilibrium(W, P).disc
    rows = steady_rows(W, P, 0.05)
    rows[20:25, 4] = 30.0
    law = rs.Law.from_control(system, average=0, fade=0, centre=tuple(map(float, centre)))
    by_law, other = run_rows(plant, law, rows), run_rows(plant, as_law(Stepped(system, centre)), rows)
    assert np.abs(by_law.reference).max() > 0.1
    np.testing.assert_allclose(other.reference, by_law.reference, atol=1e-9)
    np.testing.assert_allclose(other.disc, by_law.disc, atol=1e-13)


CONTINUOUS = control.append(control.tf2ss(lag()), control.tf2ss(lag()))


@pytest.mark.parametrize(
    ("system", "sentence"),
    [
        (CONTINUOUS, r"is continuous .* every 0\.2 ms; sample it: control\.sample_system\(system, 0\.0002, 'tustin'\)"),
        (feedback(1e-3), r"is sampled every 1 ms and runs every 0\.2 ms; design it for 0\.0002 s"),
        (control.tf2ss(lag()), r"has 1 inputs and 1 outputs; needed are 2 inputs.*control\.append\(x, y\)"),
        (control.ss(np.eye(2) * 0.5, np.ones((2, 3)), np.eye(2), 0, TS), r"has 3 inputs and 2 outputs"),
        (control.ss(np.eye(2) * 0.5, np.eye(2), np.eye(2), 0, True), r"time is not stated; give it dt=0\.0002"),
        (control.ss(np.eye(2) * 0.5, np.eye(2), np.eye(2), 0, None),
         r"whether it is continuous or sampled is not stated; give it dt=0 \(continuous\) or dt=0\.0002 \(sampled\)"),
        (control.ss(feedback(), inputs=["reference_x", "disc_y"]),
         "input 1 is labelled reference_x and would be disc_x"),
        (control.ss(feedback(), inputs=["u", "disc_x"]), "input 2 is labelled disc_x and would be disc_y"),
        (control.ss(feedback(), outputs=["disc_x", "disc_y"]), "output 1 is labelled disc_x and would be reference_x"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("way", ["simulate", "controlled", "law"])
def test_a_system_that_does_not_fit_is_refused_in_one_sentence(plant, system, sentence, way):
    with pytest.raises((ControllerError, LawError), match=sentence) as found:
        if way == "simulate":
            plant.simulate(0.01, W, P, controller=system)
        elif way == "controlled":
            rs.experiments.controlled(plant, system, W, P, 0.01)
        else:
            rs.Law.from_control(system)
    assert "\n" not in str(found.value)


def test_the_call_in_the_refusal_of_a_continuous_transfer_function_of_two_axes_samples_it(plant):
    """The package samples no transfer function of two inputs; what the sentence states is run as it stands."""
    system = control.append(lag(), lag(0.1e6))
    with pytest.raises(ControllerError, match="is continuous") as found:
        plant.simulate(0.01, W, P, controller=system)
    call = str(found.value).partition("sample it: ")[2]
    sampled = eval(call, {"control": control, "system": system})
    np.testing.assert_allclose(sampled(1.0), system(0.0), rtol=1e-9)
    assert plant.simulate(0.01, W, P, controller=sampled).sizes["time"] == 50
    points = {(w, P): system for w in (0.0, 300.0)}
    with pytest.raises(rs.errors.RotorsimError, match=r"control\.combine_tf\(.*'zoh'"):
        rs.LpvModel.from_control(points)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (object(), r"has no such method; give an object with a method step\(measured, speed, pressure\)"),
        (lambda measured: measured, r"controller <lambda>: a function must be f\(measured, speed, pressure\)"),
        (control.tf([1, 0, 0], [1, 1]), r"has 1 inputs"),
    ],
)
def test_what_is_no_controller_is_refused_with_what_one_is(plant, wrong, sentence):
    with pytest.raises(ControllerError, match=sentence):
        plant.simulate(0.01, W, P, controller=wrong)


def test_a_law_of_a_system_without_a_stated_time_is_not_taken_as_sampled():
    """A continuous lag of dt=None was run as a sampled one, which is another controller."""
    open_time = control.ss(feedback(), dt=None)
    with pytest.raises(LawError, match=r"give it dt=0 \(continuous\) or dt=0\.0002 \(sampled\)"):
        rs.Law.from_control(open_time, Ts=TS)
    assert rs.Law.from_control(control.ss(feedback(), dt=True), Ts=TS).Ts == TS
    assert rs.Law.from_control(control.tf([[[1e5], [0]], [[0], [1e5]]], [[[1], [1]], [[1], [1]]])).order == 0


def test_frequency_response_data_are_refused_in_one_sentence(plant):
    data = control.frd(np.ones((2, 2, 3)), [1.0, 2.0, 3.0])
    with pytest.raises(ControllerError, match=r"which does not run in time; give a control\.StateSpace or"):
        plant.simulate(0.01, W, P, controller=data)
    with pytest.raises(LawError, match=r"is not a linear system; give control\.StateSpace or TransferFunction"):
        rs.Law.from_control(data)


ACROSS = control.ss([[0.5, 0.1], [0.0, 0.2]], [[1.0, 0.0], [0.3, 1.0]], [[1.0, 0.2], [0.0, 3.0]], [[0.1, 0], [0, 0]],
                    TS, inputs=["disc_x", "disc_y"], outputs=["reference_x", "reference_y"])  # fmt: skip
TURNED = control.ss(ACROSS.A, ACROSS.B[:, ::-1], ACROSS.C[::-1], ACROSS.D[::-1, ::-1], TS,
                    inputs=["disc_y", "disc_x"], outputs=["reference_y", "reference_x"])  # fmt: skip


def test_labels_in_another_order_are_followed():
    """The same system with channels y, x: as a law, as a model and in the loop."""
    law, turned = rs.Law.from_control(ACROSS), rs.Law.from_control(TURNED)
    for letter in "ABCD":
        np.testing.assert_array_equal(getattr(turned, letter), getattr(law, letter))
    model = rs.LinearModel.from_control(
        control.ss(TURNED, inputs=["reference_y", "reference_x"], outputs=["disc_y", "disc_x"])
    )
    np.testing.assert_array_equal(model.D, ACROSS.D)
    assert (model.inputs, model.outputs) == (("reference_x", "reference_y"), ("disc_x", "disc_y"))


def nonlinear(system, scheduled=False):
    """A StateSpace as a system that is not linear, with speed and pressure ahead of the disc or without."""
    skipped = 2 * scheduled
    return control.nlsys(
        lambda t, x, u, params: system.A @ x + system.B @ u[skipped:],
        lambda t, x, u, params: system.C @ x + system.D @ u[skipped:],
        inputs=["pressure", "speed"][:skipped] + system.input_labels, outputs=system.output_labels, states=2, dt=TS,
    )  # fmt: skip


@pytest.mark.parametrize("turned", [TURNED, nonlinear(TURNED), nonlinear(TURNED, scheduled=True)])
def test_labels_in_another_order_are_followed_in_the_loop(turned):
    from rotorsim.plant.controller import SystemController

    rng = np.random.default_rng(5)
    expected, found = SystemController(ACROSS), SystemController(turned)
    for y in rng.normal(size=(20, 2)):
        np.testing.assert_allclose(found.step(y, W, P), expected.step(y, W, P), rtol=1e-12)


def test_the_plant_as_a_system_says_where_to_start(plant):
    system = plant.to_control(W, P)
    U = np.tile([[W], [P], [0.0], [0.0], [0.0], [0.0]], 3)
    with pytest.raises(DataError, match=r"give control\.input_output_response\(system, T, U, system\.initial\)"):
        control.input_output_response(system, np.arange(3) * TS, U)


def test_surfaces_of_no_systems_are_refused():
    with refused(ModelError, "systems"):
        rs.LpvModel.from_control({})


def test_the_safe_speed_takes_every_controller_that_a_verification_takes(plant):
    ramp = {"start": 300.0, "stop": 330.0, "rate": 300.0, "pressure": P}
    by_law = rs.verify.safe_speed(plant, rs.Law.from_control(feedback()), **ramp)
    assert rs.verify.safe_speed(plant, feedback(), **ramp).speed == by_law.speed
    assert rs.verify.safe_speed(plant, lambda measured, speed, pressure: 0 * measured, **ramp).run.reference.max() == 0


def test_an_improper_transfer_function_is_refused():
    improper = control.append(control.tf([1.0], [1.0, 1.0]), control.tf([1.0], [1.0, 1.0]))
    assert rs.LinearModel.from_control(improper).order == 2
    with pytest.raises(ValueError, match="more zeros than poles"):
        rs.LinearModel.from_control(control.tf([1.0, 0.0, 0.0], [1.0, 1.0]))


def test_without_the_package_one_sentence_names_it(monkeypatch, plant):
    import sys

    monkeypatch.setitem(sys.modules, "control", None)
    with refused(DataError, "control"):
        plant.linearise(W, P).to_control()

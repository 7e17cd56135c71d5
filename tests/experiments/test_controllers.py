"""Invalid controller outputs end the run with one sentence; valid laws survive lost samples."""

import numpy as np
import pytest
import xarray as xr

import rotorsim as rs
from refusals import refused
from rotorsim.base.errors import ControllerError, ConvergenceError, DataError, LawError
from rotorsim.control.designs import lqr
from rotorsim.experiments import Controlled, ProportionalLaw, record
from rotorsim.plant import Plant
from rotorsim.verify.transients import envelope_damping

P = 0.5e6


@pytest.fixture(scope="module")
def plant():
    return Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


class After:
    """Nothing for `samples` samples, then always `given`."""

    def __init__(self, given, samples=10):
        self.given, self.left = given, samples

    def step(self, measured, speed, pressure):
        self.left -= 1
        return self.given if self.left < 0 else (0.0, 0.0)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ((np.nan, 0.0), "nan"), ([0.0, np.inf], "inf"), (np.zeros(3), r"array\(\[0"), (0.0, "0.0"), (None, "None"),
        ("no", "'no'"), (np.zeros((1, 2)), "array"), ([0.0, [1.0]], r"\[1.0\]"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("way", ["simulate", "controlled"])
def test_nonsense_of_a_controller_is_named_as_the_controllers_with_its_time(plant, given, shown, way):
    with pytest.raises(ControllerError, match=rf"controller After: gave .*{shown}.* at t = 0\.0020 s") as found:
        if way == "simulate":
            plant.simulate(0.01, 100.0, P, controller=After(given))
        else:
            rs.experiments.controlled(plant, After(given), 100.0, P, 0.01)
    text = str(found.value)
    assert "two finite voltages" in text and "time_step" not in text and "check it there" in text
    assert not isinstance(found.value, ConvergenceError)


class Short:
    """A step that takes the measurement alone."""

    def step(self, measured):
        return measured


@pytest.mark.parametrize("way", ["simulate", "controlled"])
@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (lambda measured: measured, r"controller <lambda>: a function must be f\(measured, speed, pressure\)"),
        (ProportionalLaw, r"controller = <class .*: is a class; give an object with a method step"),
        (Short(), r"controller Short: its step must be step\(measured, speed, pressure\)"),
    ],
)
def test_what_is_no_controller_is_refused_with_what_one_offers(plant, wrong, sentence, way):
    with pytest.raises(ControllerError, match=sentence):
        if way == "simulate":
            plant.simulate(0.01, 100.0, P, controller=wrong)
        else:
            rs.experiments.controlled(plant, wrong, 100.0, P, 0.01)


def test_inputs_that_are_not_numbers_are_named_and_do_not_reach_the_solver(plant):
    """Every column but the speed, where NaN means that the drive is off."""
    names = ("supply pressure", "reference x", "reference y", "disc force x", "disc force y")
    for column, name in enumerate(names, start=1):
        for bad in (np.nan, np.inf):
            rows = np.tile([100.0, P, 0.0, 0.0, 0.0, 0.0], (3, 1))
            rows[2, column] = bad
            with pytest.raises(DataError, match=f"{name}: {bad} in row 2; give finite numbers"):
                plant.start(100.0, P).advance(rows)


def test_a_controller_beyond_the_actuators_range_is_named_as_such(plant):
    with refused(ControllerError, "controller", 7.0):
        plant.simulate(0.01, 100.0, P, controller=After((7.0, 0.0)))


class LosesSamples:
    """A controller whose measurement is lost in some samples."""

    def __init__(self, law, lost):
        self.law, self.lost, self.k = law, lost, 0
        self.outputs = []

    def step(self, measured, speed, pressure):
        bad = self.k in self.lost
        self.k += 1
        self.outputs.append(self.law.step(measured * np.nan if bad else measured, speed, pressure))
        return self.outputs[-1]


@pytest.mark.parametrize("made", ["lqr", "p"])
def test_a_loop_survives_lost_samples_and_settles_where_it_would_have(plant, made):
    """One lost sample, then 40 ms without a sensor; 0.1 s later the disc is within 10 nm of the undisturbed loop."""
    rest = plant.equilibrium(100.0, P).disc

    def law():
        if made == "p":
            return ProportionalLaw(5e4, 5e4, centre=tuple(rest))
        from studies.benchmarks.control_laws import rig_model

        return lqr.design(rig_model()).with_(centre=tuple(rest))

    force = np.zeros((1500, 2))
    force[20:25, 0] = 20.0
    given = {"duration": 0.3, "speed": 100.0, "pressure": P, "disc_force": force}
    sound = plant.simulate(**given, controller=law())
    lossy = LosesSamples(law(), {100, *range(400, 600)})
    lost = plant.simulate(**given, controller=lossy)
    outputs = np.array(lossy.outputs)
    assert np.isfinite(outputs).all() and not outputs[510:600].any()
    assert np.abs(lost.disc - sound.disc).values[1100:].max() < 1e-8


def test_the_proportional_law_holds_fades_out_and_reports_it():
    law = ProportionalLaw()
    for _ in range(100):
        last = law.step(np.array([1e-6, -2e-6]), 0.0, 0.0)
    assert law.alarm is None
    outputs = np.array([law.step(np.array([np.nan, 0.0]), 0.0, 0.0) for _ in range(150)])
    np.testing.assert_array_equal(outputs[:5], [last] * 5)
    assert not outputs[105:].any() and "not a number" in law.alarm
    back = np.array([law.step(np.array([1e-6, -2e-6]), 0.0, 0.0) for _ in range(150)])
    assert np.abs(np.diff(back, axis=0)).max() < np.abs(last).max() * 0.8
    np.testing.assert_allclose(back[-1], last, rtol=1e-12)
    assert law.alarm is None


def test_a_record_of_simulate_names_its_controller_and_keeps_the_external_reference(plant):
    external = np.tile([0.1, -0.2], (50, 1))
    made = plant.simulate(0.01, 100.0, P, external, controller=ProportionalLaw(5e4, 5e4))
    assert made.attrs["controller"] == "ProportionalLaw"
    np.testing.assert_array_equal(made.reference_external.values, external)
    assert np.abs(made.reference.values - external)[1:].max() > 0.1
    alone = plant.simulate(0.01, 100.0, P, external)
    assert "controller" not in alone.attrs and "reference_external" not in alone


def test_a_streamed_run_keeps_every_sample_before_the_controller_failed(plant, tmp_path):
    with pytest.raises(ControllerError, match="controller After: gave"):
        record(plant, Controlled(100.0, P, 0.1, controller=After((np.nan, 0.0), 137)), tmp_path / "run.nc", block=100)
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as kept:
        assert kept.sizes["time"] == 138 and kept.attrs["ended"].startswith("controller After: gave")


def test_a_law_is_reset_where_a_run_begins_and_kept_where_it_continues(plant):
    law = ProportionalLaw(5e4, 5e4)
    whole = plant.simulate(0.04, 100.0, P, controller=law)
    np.testing.assert_array_equal(plant.simulate(0.04, 100.0, P, controller=law)["disc"], whole["disc"])
    simulation = plant.start(100.0, P)
    plant.simulate(0.02, 100.0, P, controller=law, initial=simulation)
    state = law.state.copy()
    assert state.any()
    plant.simulate(2e-4, 100.0, P, controller=After((0.0, 0.0)), initial=simulation)
    np.testing.assert_array_equal(law.state, state)


def test_a_law_of_another_sampling_time_is_refused_in_both_runs(plant):
    shapes = ((0, 0), (0, 2), (2, 0), (2, 2), (0, 2))
    law = rs.Law("slow", *(np.zeros((1, 1, *shape)) for shape in shapes), [0.0], [0.0], Ts=1e-3)
    for initial in ("equilibrium", plant.start(100.0, P)):
        with refused(LawError, "Ts", 1e-3):
            plant.simulate(0.01, 100.0, P, controller=law, initial=initial)


def test_a_machine_without_actuators_takes_no_controller():
    with refused(ControllerError, "controller", "ProportionalLaw"):
        Plant("plain_rotor").simulate(0.01, 100.0, controller=ProportionalLaw())


def test_a_record_names_the_function_that_controlled(plant):
    def lag(measured, speed, pressure):
        return 1e4 * measured

    about = plant.simulate(0.002, 100.0, P, controller=lag).attrs
    assert (about["controller"], about["law"]) == ("function", "lag")


class Rate:
    """Feedback of the displacement's change since the last sample, as in docs/extending.md."""

    def __init__(self, gain):
        self.gain = gain

    def reset(self):
        self.last = None

    def step(self, measured, speed, pressure):
        change = 0.0 * measured if self.last is None else measured - self.last
        self.last = measured.copy()
        return self.gain * change


def test_negative_feedback_of_velocity_damps_and_positive_does_not(plant):
    """A hit of 20 N at rest; positive feedback of the displacement damps more, because film and pins answer late."""
    force = np.zeros((1500, 2))
    force[200:205, 0] = 20.0
    damping = {}
    for name, law in {"none": None, "minus": Rate(-2e5), "plus": Rate(2e5), "p": ProportionalLaw(1e5, 1e5)}.items():
        disc = plant.simulate(0.3, 0.0, P, disc_force=force, controller=law)["disc"].values
        damping[name] = envelope_damping(disc[206:] - disc[:150].mean(axis=0))
    assert damping["plus"] < damping["none"] < damping["minus"] < 0.5 * damping["p"]

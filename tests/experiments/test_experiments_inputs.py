"""Invalid experiments: refused with one sentence of thing, value and remedy."""

import numpy as np
import pytest

import rotorsim as rs
from identification import make_record
from refusals import refused
from rotorsim import experiments as ex
from rotorsim.base.errors import DataError


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ex.Prbs(amplitude=6.0), r"amplitude: '6 V' is above the limit; write at most '5 V'"),
        (lambda: ex.Prbs(amplitude=0.0), r"amplitude: '0 V' must be above 0; write e.g. '1 V'"),
        (lambda: ex.Prbs(amplitude=-1.0), r"amplitude: '-1 V' must be above 0; write e.g. '1 V'"),
        (lambda: ex.Prbs(hold=5e-5), r"hold: '50 us' is shorter than a sample; write at least '0.2 ms'"),
        (lambda: ex.Prbs(duration=0.4), r"bias = 0.4 s: leaves nothing of the duration of 0.4 s"),
        (lambda: ex.Prbs(hold=3e-4), r"hold: '0.3 ms' is not a whole number of samples of 0.2 ms; write e.g. '0.2 ms'"),
        (lambda: ex.Prbs(duration=-1.0), r"duration: '-1 s' must be above 0; write e.g. '1 s'"),
        (lambda: ex.Prbs(duration=1.00013), r"duration: .* is not a whole number of samples"),
        (lambda: ex.Prbs(duration=np.nan), r"duration: nan is not a time; write e.g. '10 s'"),
        (lambda: ex.Prbs(speed=-1.0), r"speed: '-.* rpm' is below the limit; write at least '0 rpm'"),
        (lambda: ex.Prbs(pressure=np.inf), r"pressure: inf is not a pressure; write e.g. '0.3 MPa'"),
        (lambda: ex.Prbs(pressure=-1e5), r"pressure: .* is below the limit"),
        (lambda: ex.Prbs(speed="fast"), r"speed: 'fast' is not a rotational speed; write e.g. '6000 rpm'"),
        (lambda: ex.Prbs(duration=2e6), r"prbs: would last 23.1 days; make it shorter"),
        (lambda: ex.Steady(duration=0.0), r"duration: '0 ms' must be above 0"),
        (lambda: ex.Chirp(high=2600.0), r"high: '2600 Hz' is above the limit; write at most '2500 Hz'"),
        (lambda: ex.Chirp(low=100.0, high=100.0), r"low and high are both 100 Hz"),
        (lambda: ex.Chirp(axis="z"), r"axis: 'z' is not known; choose one of x, y, both"),
        (lambda: ex.Multisine(low=10.2, high=10.8), r"multisine: fewer than two lines from 10.2 to 10.8 Hz"),
        (lambda: ex.Multisine(low=300.0, high=100.0), r"multisine: fewer than two lines"),
        (lambda: ex.Multisine(high=2500.0), r"high = 2500 Hz: is not below half the sampling rate"),
        (lambda: ex.Multisine(low=10.2, high=10.8, axis="y"), r"multisine: no line from 10.2 to 10.8 Hz"),
        (lambda: ex.Multisine(axis="z"), r"axis: 'z' is not known; choose one of x, y, both"),
        (
            lambda: ex.Multisine(amplitude=1.5, mean_y=-4.0),
            r"mean_y = -4 V: reaches 5.5 V with the amplitude of 1.5 V; keep both together within 5 V",
        ),
        (lambda: ex.Multisine(mean_x=6.0), r"mean_x: '6 V' is above the limit; write at most '5 V'"),
        (lambda: ex.Multisine(periods=2.5), r"periods: 2.5 is not a whole number; write e.g. 2"),
        (lambda: ex.Multisine(periods=0), r"periods: 0 is below the limit; write at least 1"),
        (
            lambda: ex.Staircase(amplitude=4.0, step=1.5),
            r"step: '1.5 V' does not divide the amplitude of 4 V; give e.g. '2 V'",
        ),
        (lambda: ex.Staircase(amplitude=1.0, step=3.0), r"step: '3 V'"),
        (lambda: ex.Impact(width=1e-4), r"width: .* is below the limit"),
        (lambda: ex.Impact(spacing=1e-3, width=2e-3), r"spacing = .*: is shorter than a hit"),
        (lambda: ex.SlowRoll(speed=0.0), r"speed: '0 rpm' must be above 0"),
        (lambda: ex.Coastdown(start=10.0, stop=20.0), r"stop = 190.* rpm: is not below the start"),
        (lambda: ex.Runup(0.0, 100.0, 0.0), r"rate = 0 rpm/s: must be positive"),
        (lambda: ex.Runup(0.0, 100.0, 1e-9), r"would last .* days"),
        (
            lambda: ex.Controlled(controller=None),
            r"controller = None: has no such method; give an object with a method step",
        ),
        (
            lambda: ex.Controlled(controller=ex.ProportionalLaw(), excitations=(3,)),
            r"excitations: 3 is not an open-loop",
        ),
        (lambda: ex.ProportionalLaw(low_pass=0.0), r"low_pass: '0 Hz' must be above 0"),
    ],
)
def test_bad_parameters_are_one_sentence(make, sentence):
    with pytest.raises(DataError, match=sentence) as caught:
        make()
    assert str(caught.value).count("\n") == 0 and len(str(caught.value)) < 200


@pytest.fixture(scope="module")
def rotor():
    return rs.Plant("plain_rotor", dt=2e-4)


@pytest.mark.parametrize("seed", [-1, 1.5, "a", True])
def test_a_seed_is_a_whole_number(rotor, seed):
    with refused(DataError, "seed", seed):
        ex.run(rotor, ex.Steady(duration=0.1), seed)


def test_a_reference_needs_actuators(rotor):
    with refused(DataError, "machine", "plain_rotor"):
        rs.experiments.prbs(rotor, duration=0.5)


def test_hours_are_not_returned_in_memory(rotor):
    with refused(DataError, "duration", pytest.approx(4000.0)):
        rs.experiments.steady(rotor, duration=4000.0)


def test_what_is_no_staircase_has_no_static_gain(rotor):
    with pytest.raises(DataError, match="lacks 'reference'"):
        rs.experiments.static_gain_map(rs.experiments.steady(rotor, duration=0.1))
    with pytest.raises(DataError, match="share = 0"):
        rs.experiments.static_gain_map(rs.experiments.steady(rotor, duration=0.1), share=0)


@pytest.mark.parametrize(
    ("make", "advice"),
    [
        (lambda: ex.Prbs(hold="5"), "hold: '5' has no unit; write e.g. '5 ms'"),
        (lambda: ex.Prbs(duration="0.5"), "duration: '0.5' has no unit; write e.g. '0.5 s'"),
    ],
)
def test_a_number_without_unit_is_advised_in_the_unit_of_the_default(make, advice):
    with pytest.raises(DataError) as caught:
        make()
    assert str(caught.value) == advice


@pytest.mark.parametrize("amplitude", [0.3, 1.0, 1.9, 2.0, 5.0])
@pytest.mark.parametrize("step", [1e-9, 0.0123, 0.07, 0.33, 0.7, 4.9])
def test_the_step_that_is_advised_is_accepted(amplitude, step):
    with pytest.raises(DataError, match="step: ") as caught:
        ex.Staircase(amplitude=amplitude, step=step)
    ex.Staircase(amplitude=amplitude, step=str(caught.value).split("'")[-2])


def test_a_step_of_six_digits_divides_the_amplitude():
    assert len(ex.Staircase(amplitude=2.0, step=0.105263).levels()) == 4 * 19 + 1
    with refused(DataError, "step", 0.7):
        ex.Staircase(step="0.7 V")


def test_a_machine_or_its_name_does_as_a_plant(rotor, tmp_path):
    made = rs.experiments.steady("plain_rotor", duration=0.002)
    assert made.equals(rs.experiments.steady(rs.load_machine("plain_rotor"), duration=0.002))
    assert ex.record("plain_rotor", ex.Steady(duration=0.002), str(tmp_path / "steady.nc")).complete
    with refused(DataError, "plant", 2.0):
        rs.experiments.steady(2.0)
    with pytest.raises(TypeError, match=r"steady\(\) has no parameter 'sped'; did you mean 'speed'"):
        rs.experiments.steady(rotor, sped=2.0)


def test_references_that_never_rest_have_no_static_gain():
    time, reference = np.arange(300) * 2e-4, np.repeat([[-1.0, 0.0], [0.0, 1.0], [1.0, -1.0]], 100, axis=0)
    made = make_record(time, {"reference": reference, "disc": reference * 1e-6})
    assert rs.experiments.static_gain_map(made)["gain"].size
    with refused(DataError, "experiment", "prbs"):
        rs.experiments.static_gain_map(made.assign_attrs(experiment="prbs"))


def test_a_ramp_has_no_negative_speed():
    with refused(DataError, "stop", "-600 rpm"):
        ex.Runup(stop="-600 rpm")

"""Equivalent input of the injectors: what a late or weak reference makes is read from records, and shown."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.equivalent_input import GAIN, EquivalentInput, _solved, equivalent_inputs
from rotorsim.discrepancy.experiments import Steady, campaign
from rotorsim.discrepancy.files import load_diagnosis, save_diagnosis
from rotorsim.discrepancy.fit import fit_parameters, recalibrate
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.records import make_trials
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from small_diagnosis import small_diagnosis

INPUTS = ("actuator_delay", "actuator_gain", "amplifier_lag")
ELSEWHERE = ("labyrinth_seal", "weak_injector")
NAMES = ("fit_1", "fit_2", "fit_3", "fit_4", "fit_2_repeat")
SMALL = 0.3
"""Excitation [V] at which the film hardly bends."""


@pytest.fixture(scope="module")
def rig():
    return load_machine("dtu_gas_bearing")


@pytest.fixture(scope="module")
def twin(rig):
    return Twin(rig, (16, 8), only=INPUTS + ELSEWHERE)


@pytest.fixture(scope="module")
def read(rig, twin):
    """Return the reader of the equivalent inputs of records with a number of the plant moved."""

    def found(effect, amplitude=SMALL, **numbers):
        held = {f"{effect}.0.injector": 0.0} if effect in INPUTS else {}
        point = ParameterPoint(
            {FitParameter(f"{effect}.0.{key}", value): value for key, value in numbers.items()}, held
        )
        plan = [
            replace(p, experiment=replace(p.experiment, amplitude=amplitude)) for p in campaign(rig) if p.name in NAMES
        ]
        records = [record_of(twin, p, point, 5, tiled=True) for p in plan]
        for i, record in enumerate(records):
            noise = np.random.default_rng([5, i]).normal(0, 1e-7, record.disc_measured.shape)
            record["disc_measured"] = record.disc_measured.copy(data=record.disc_measured.values + noise)
        comparison = TwinComparison(
            twin, make_trials(rig, [(p.name, r) for p, r in zip(plan, records, strict=True)], "fit")
        )
        base = recalibrate(comparison, None, 2e-3)
        return {one.injectors: one for one in equivalent_inputs(comparison, base, point)}

    return found


@pytest.mark.slow
def test_the_time_by_which_all_references_are_late_is_read_from_both_axes(read):
    inputs = read("actuator_delay", delay=3e-4)
    assert set(inputs) == {(2, 4), (1, 3), (1,), (2,), (3,), (4,)}
    for pins in ((2, 4), (1, 3)):
        one = inputs[pins]
        assert one.is_known
        assert one.late == pytest.approx(3e-4, abs=max(3 * one.late_sd, 3e-5))
        assert abs(one.error) < 3 * one.error_sd
        # the law of what was found, through the plant, lies on the readings
        assert np.abs(np.angle(one.law) - one.phase) == pytest.approx(0, abs=0.1)


@pytest.mark.slow
def test_the_time_is_read_where_the_film_bends_with_the_motion_too(read):
    """At 1 V: by the answer to a larger reference, turned by a quarter, the time along x is 0.227 +- 0.025 ms."""
    inputs = read("actuator_delay", amplitude=1.0, delay=3e-4)
    for pins in ((2, 4), (1, 3)):
        assert inputs[pins].late == pytest.approx(3e-4, abs=2 * inputs[pins].late_sd)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "numbers"),
    [
        ("actuator_delay", {"delay": 0.0}),
        ("labyrinth_seal", {"damping": 60.0, "cross_stiffness": 1e4}),
        ("weak_injector", {"blocked": 0.17}),
    ],
)
def test_a_sound_drive_has_no_equivalent_input_whatever_is_wrong_elsewhere(read, effect, numbers):
    assert read(effect, **numbers) == {}


@pytest.mark.slow
def test_records_without_references_have_no_equivalent_input(rig, twin):
    [planned] = [p for p in campaign(rig) if p.name == "fit_1"]
    steady = Steady(planned.experiment.speed, planned.experiment.pressure, 2.4)
    record = record_of(twin, replace(planned, experiment=steady), ParameterPoint(), 5)
    comparison = TwinComparison(twin, make_trials(rig, [("fit_1", record)], "fit"))
    assert equivalent_inputs(comparison, recalibrate(comparison, None)) == ()


STIFFNESS = FitParameter("stiffness", 0.01, 0.1)
"""Relative change of the stiffness of `Oscillators`."""


class Oscillators:
    """Two records of an oscillator per axis, driven by its `pins`; stands for a comparison, in closed form.

    `late` [s] and `gain` [1] are those of all inputs, `uneven` [1] is a factor on one record and off the other.
    """

    frequency = np.linspace(10.0, 200.0, 40)
    natural, zeta, noise = 90.0, 0.05, 0.1

    def __init__(self, stiffness=0.0, late=0.0, gain=0.0, uneven=0.0, pins="yxyx"):
        injectors = [SimpleNamespace(reference=f"r_{axis}") for axis in pins]
        self.twin = SimpleNamespace(machine=SimpleNamespace(injectors=injectors), slots={GAIN: 0})
        self.trials = [SimpleNamespace(rows=np.eye(4), orders=False)] * 2
        # lines of a record: real parts of x, imaginary ones, then those of y
        m = 4 * len(self.frequency)
        self.layout = SimpleNamespace(frequency=np.tile(self.frequency, 8), record=np.repeat([0, 1], m))
        self.sigma, self.stored = np.full(2 * m, self.noise), self
        ratio = (1 + gain) * np.exp(-2j * np.pi * self.frequency * late)
        lines = self._receptance(stiffness) * ratio
        made = np.concatenate([(1 + sign * uneven) * np.tile(np.r_[lines.real, lines.imag], 2) for sign in (1, -1)])
        self.measured = made + np.random.default_rng(1).normal(0, self.noise, 2 * m)

    def _receptance(self, stiffness):
        s = self.frequency / self.natural
        return 1 / (1 + stiffness - s**2 + 2j * self.zeta * s)

    def numbers_of(self, i):
        return np.arange(len(self.sigma)).reshape(2, 2, -1)[i]

    def lines_of(self, i, y):
        parts = y[self.numbers_of(i)].reshape(2, 2, -1)
        return parts[:, 0] + 1j * parts[:, 1]

    def predict(self, point):
        lines = self._receptance(point.values.get(STIFFNESS, 0.0))
        return np.tile(np.r_[lines.real, lines.imag], 4)

    def residual(self, point):
        return (self.measured - self.predict(point)) / self.sigma

    def columns(self, point, parameters):
        if parameters[0].key == f"{GAIN}.0.error":
            return (self.column(point, parameters[0], self.predict(point)) * self.sigma)[:, None]
        there = point.moved([STIFFNESS], np.array([STIFFNESS.step]))
        return ((self.predict(there) - self.predict(point)) / STIFFNESS.step)[:, None]

    def column(self, held, parameter, here):
        references = [one.reference for one in self.twin.machine.injectors]
        axis = references[int(held.fixed[f"{GAIN}.0.injector"]) - 1]
        own = np.zeros(len(here), bool)
        for i in range(2):
            own[self.numbers_of(i)["xy".index(axis[-1])]] = True
        return np.where(own, here / references.count(axis), 0.0) / self.sigma

    def calibrated(self):
        """The fit of the stiffness alone."""
        J = self.columns(ParameterPoint(), (STIFFNESS,)) / self.sigma[:, None]
        return fit_parameters(self, ParameterPoint(), (STIFFNESS,), J)


def inputs_of(**wrong):
    """Equivalent inputs of oscillators with something wrong, by their pins."""
    comparison = Oscillators(**wrong)
    return {one.injectors: one for one in equivalent_inputs(comparison, comparison.calibrated())}


def test_an_input_that_takes_the_misfit_is_shown_with_its_numbers():
    inputs = inputs_of(late=5e-4, gain=-0.1)
    for pins in ((2, 4), (1, 3)):
        one = inputs[pins]
        assert one.is_known
        assert one.late == pytest.approx(5e-4, abs=3 * one.late_sd)
        assert one.error == pytest.approx(-0.1, abs=3 * one.error_sd)


@pytest.mark.parametrize(("pins", "pair", "lone"), [("yyx", (1, 2), (3,)), ("xyx", (1, 3), (2,))])
def test_a_lone_pin_of_an_axis_is_read_next_to_the_two_of_the_other(pins, pair, lone):
    """Its lines weigh less, so that those of the pair take most of the misfit and are solved for, but not enough."""
    comparison = Oscillators(late=5e-4, gain=-0.1, pins=pins)
    for i in range(2):
        comparison.sigma[comparison.numbers_of(i)["xy".index(pins[lone[0] - 1])]] *= 1.5
    inputs = {one.injectors: one for one in equivalent_inputs(comparison, comparison.calibrated())}
    assert set(inputs) == {(k,) for k in (*pair, *lone)}
    assert inputs[lone].is_known
    assert inputs[lone].late == pytest.approx(5e-4, abs=3 * inputs[lone].late_sd)
    assert inputs[lone].error == pytest.approx(-0.1, abs=3 * inputs[lone].error_sd)


@pytest.mark.parametrize("late", [0.0, 1e-3])
def test_a_reversed_input_is_shown_as_such_with_the_time_by_which_it_is_late(late):
    """Its phase is that of the delay and half a turn: a delay alone does not make it."""
    for one in inputs_of(late=late, gain=-1.9).values():
        if len(one.injectors) > 1:
            assert one.is_known and "reversed" in one.sentence
            assert one.error == pytest.approx(-1.9, abs=3 * one.error_sd + 0.02)
            assert one.late == pytest.approx(late, abs=3 * one.late_sd)
    assert "reversed" not in inputs_of(late=1e-3, gain=-0.1)[2, 4].sentence


@pytest.mark.parametrize("uneven", [0.0, 0.02, 0.1, 0.5])
def test_a_misfit_that_no_input_makes_shows_no_input(uneven):
    assert inputs_of(uneven=uneven) == {}


def test_an_input_that_takes_half_of_a_misfit_is_not_shown_and_one_that_takes_nearly_all_is():
    assert inputs_of(late=2e-4, uneven=0.1) == {}
    assert inputs_of(late=2e-4, uneven=0.01)


def test_an_input_that_takes_a_small_share_of_little_more_than_the_floor_is_not_shown():
    comparison = Oscillators(late=5e-5, uneven=0.01)
    alone = comparison.calibrated().cost
    assert len(comparison.sigma) < alone < 1.1 * len(comparison.sigma)
    assert inputs_of(late=5e-5, uneven=0.01) == {}


def test_an_early_input_is_not_known():
    inputs = inputs_of(late=-5e-4)
    for pins in ((2, 4), (1, 3)):
        assert inputs[pins].late < -5 * inputs[pins].late_sd
        assert not inputs[pins].is_known


def test_more_than_noise_left_makes_intervals_wider():
    plain, rough = (inputs_of(late=1e-3, uneven=uneven)[2, 4] for uneven in (0.0, 0.1))
    assert np.all(rough.gain_sd > 1.9 * plain.gain_sd) and rough.late_sd > 1.9 * plain.late_sd


@pytest.mark.parametrize("stiffness", [-0.2, 0.2])
def test_a_machine_that_is_off_its_file_shows_its_late_input_too(stiffness):
    one = inputs_of(stiffness=stiffness, late=3e-4)[2, 4]
    assert one.is_known
    assert one.late == pytest.approx(3e-4, abs=3 * one.late_sd)


@pytest.mark.parametrize("stiffness", [0.02, 0.05])
def test_the_solution_descends_along_a_chord_whose_steps_are_five_times_too_long(stiffness):
    comparison = Oscillators(stiffness=stiffness)
    nominal, base = ParameterPoint(), comparison.calibrated()
    J = 0.2 * comparison.columns(nominal, (STIFFNESS,)) / comparison.sigma[:, None]
    start = replace(base, point=nominal, residual=comparison.residual(nominal), J=J)
    fit, found = _solved(comparison, start, [("all", (1, 2, 3, 4))], {})
    assert found.cost < len(start.residual) < start.residual @ start.residual / 5
    assert fit.vector == pytest.approx([stiffness], abs=3e-3)
    assert np.all(fit.residual == comparison.residual(fit.point))


def made(name="all pins that follow r_x", pins=(2, 4), sd=0.01):
    """An input that is 8 % small and .3 ms late."""
    f = np.linspace(10.0, 200.0, 8)
    ratio = 0.92 * np.exp(-2j * np.pi * f * 3e-4)
    size = np.full(8, sd)
    return EquivalentInput(name, pins, f, np.abs(ratio), size, np.angle(ratio), size, -0.08, sd, 3e-4, 1e-5, ratio)


def test_an_input_that_is_not_known_has_no_numbers_in_its_sentence():
    assert made().is_known and "-8" in made().sentence and "0.3" in made().sentence
    early = replace(made(), late=-3e-4)
    assert not early.is_known and replace(made(), late=-1e-5).is_known
    assert not made(sd=0.2).is_known and not any(c.isdigit() for c in made(sd=0.2).sentence)


def test_equivalent_inputs_are_stored_and_stand_in_the_page_and_in_the_numbers(tmp_path):
    found = small_diagnosis("dtu_gas_bearing", inputs=(made(), made("injector 1", (1,))))
    save_diagnosis(found, tmp_path)
    again = load_diagnosis(tmp_path)
    [first, second] = again.as_dict()["inputs"]
    assert first == found.inputs[0].as_dict() and second["injectors"] == [1]
    assert again.inputs[0].law == pytest.approx(found.inputs[0].law)
    again.report(tmp_path / "page.html")
    assert "Equivalent input of the injectors" in (tmp_path / "page.html").read_text(encoding="utf-8")

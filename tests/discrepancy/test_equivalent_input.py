"""Equivalent input of the injectors: what a late or weak reference makes is read from records, and shown."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.equivalent_input import EquivalentInput, equivalent_inputs
from rotorsim.discrepancy.experiments import Steady, campaign
from rotorsim.discrepancy.files import load_diagnosis, save_diagnosis
from rotorsim.discrepancy.fit import recalibrate
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.records import make_trials
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from small_diagnosis import small_diagnosis

INPUTS = ("actuator_delay", "actuator_gain", "amplifier_lag")
NAMES = ("fit_1", "fit_2", "fit_3", "fit_4", "fit_2_repeat")
SMALL = 0.3
"""Excitation [V] at which the film hardly bends."""


@pytest.fixture(scope="module")
def rig():
    return load_machine("dtu_gas_bearing")


@pytest.fixture(scope="module")
def twin(rig):
    return Twin(rig, (16, 8), only=INPUTS)


@pytest.fixture(scope="module")
def read(rig, twin):
    """Return the reader of the equivalent inputs of records with a number of the plant moved."""

    def found(key, value, injector=0.0):
        parameter, held = FitParameter(f"{key[0]}.0.{key[1]}", value), {f"{key[0]}.0.injector": injector}
        point = ParameterPoint({parameter: value}, held)
        plan = [replace(p, experiment=replace(p.experiment, amplitude=SMALL)) for p in campaign(rig) if p.name in NAMES]
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
    inputs = read(("actuator_delay", "delay"), 3e-4)
    assert set(inputs) == {(2, 4), (1, 3), (1,), (2,), (3,), (4,)}
    for pins in ((2, 4), (1, 3)):
        one = inputs[pins]
        assert one.is_known
        assert one.late == pytest.approx(3e-4, abs=max(3 * one.late_sd, 3e-5))
        assert abs(one.error) < 3 * one.error_sd
        # the law of what was found, through the plant, lies on the readings
        assert np.abs(np.angle(one.law) - one.phase) == pytest.approx(0, abs=0.1)


@pytest.mark.slow
def test_a_sound_drive_has_an_input_of_one(read):
    for one in read(("actuator_delay", "delay"), 0.0).values():
        assert abs(one.late) < 4 * one.late_sd and abs(one.error) < 4 * one.error_sd


@pytest.mark.slow
def test_records_without_references_have_no_equivalent_input(rig, twin):
    [planned] = [p for p in campaign(rig) if p.name == "fit_1"]
    steady = Steady(planned.experiment.speed, planned.experiment.pressure, 2.4)
    record = record_of(twin, replace(planned, experiment=steady), ParameterPoint(), 5)
    comparison = TwinComparison(twin, make_trials(rig, [("fit_1", record)], "fit"))
    assert equivalent_inputs(comparison, recalibrate(comparison, None)) == ()


def made(name="all pins that follow r_x", pins=(2, 4), sd=0.01):
    """An input that is 8 % small and .3 ms late."""
    f = np.linspace(10.0, 200.0, 8)
    ratio = 0.92 * np.exp(-2j * np.pi * f * 3e-4)
    size = np.full(8, sd)
    return EquivalentInput(name, pins, f, np.abs(ratio), size, np.angle(ratio), size, -0.08, sd, 3e-4, 1e-5, ratio)


def test_an_input_that_is_not_known_has_no_numbers_in_its_sentence():
    assert made().is_known and "-8" in made().sentence and "0.3" in made().sentence
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

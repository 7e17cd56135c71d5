"""Machines with several films: each film has candidates, calibration and places in the machine file of its own."""

from pathlib import Path

import numpy as np
import pytest

from rotorsim.base.errors import MachineFileError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import calibration
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.machine_file import Findings, IdentifiedEffect, extended
from rotorsim.discrepancy.twin import Twin
from rotorsim.experiments.catalogue.impact import Impact
from rotorsim.experiments.running import run
from rotorsim.machine import load_machine


def spindle():
    """The aerostatic spindle at the rate of a diagnosis."""
    return load_machine("aerostatic_spindle").with_({"solver.sampling_rate": 5e3})


def found(machine, effects=(), calibrated=()):
    """Findings with these effects and calibrated parameters."""
    return Findings("named", machine, tuple(effects), (), dict(calibrated), {}, "0")


def test_every_film_has_candidates_by_its_name_and_orifices_cannot_stick():
    labels = {form.key for form in candidates(Twin(spindle()))}
    for name in ("rear", "front"):
        assert f"weak_injector.blocked of injector 16 of {name}" in labels
        assert {f"clearance_growth.growth of {name}", f"pedestal.mass_ratio of {name}"} <= labels
    assert not any("stuck" in label or "discharge_drift.exponent" in label for label in labels)
    rig = {form.key for form in candidates(Twin(load_machine("dtu_gas_bearing")))}
    assert {"weak_injector.stuck of injector 4", "discharge_drift.exponent", "clearance_growth.growth"} <= rig


def test_every_film_is_calibrated_by_itself():
    keys = {parameter.key for parameter in calibration(Twin(spindle()))}
    assert {f"clearance_growth.{k}.temperature" for k in (0, 1)} <= keys
    assert {f"discharge_drift.{k}.drift" for k in (0, 1)} <= keys


def test_a_film_s_own_effect_and_calibration_are_written_with_its_bearing():
    blocked = IdentifiedEffect("weak_injector", "", {"injector": 3.0, "blocked": 0.4, "bearing": 1.0}, {}, ())
    machine = spindle()
    written = extended(found(machine, [blocked], {"clearance_growth.1.temperature": (8.0, 0.6)}.items()))
    (injector,), (grown,) = written.effects["weak_injector"], written.effects["clearance_growth"]
    assert (injector.bearing, injector.injector, injector.blocked) == (1, 3, 0.4)
    assert (grown.bearing, grown.temperature) == (1, pytest.approx(8.0))


def test_a_table_about_all_films_is_written_once_for_each_where_one_changes():
    machine = spindle().replace("effects.clearance_growth", {"growth": "0.2 um", "temperature": "1 K"})
    written = extended(found(machine, (), {"clearance_growth.1.temperature": (8.0, 0.6)}.items()))
    first, second = written.effects["clearance_growth"]
    assert (first.bearing, first.temperature, first.growth) == (0, pytest.approx(1.0), pytest.approx(2e-7))
    assert (second.bearing, second.temperature, second.growth) == (1, pytest.approx(9.0), pytest.approx(2e-7))


def test_an_effect_that_a_film_has_once_is_refused_twice_for_one_film():
    each = [{"bearing": 0, "growth": "0.2 um"}, {"bearing": 1, "growth": "0.1 um"}]
    assert len(spindle().replace("effects.clearance_growth", each).effects["clearance_growth"]) == 2
    with pytest.raises(MachineFileError, match="there are 2 of them, and a machine has one; give each the 'bearing'"):
        spindle().replace("effects.clearance_growth", [each[0], each[0]])


@pytest.mark.slow
def test_the_film_whose_clearance_differs_is_the_one_that_calibration_changes(tmp_path: Path):
    machine = spindle().replace("effects.noise", {"sigma": "0.05 um"})
    truth = machine.with_({"bearings.1.clearance": 22e-6})
    hits = [(speed, angle) for speed in (200.0, 600.0) for angle in (0.0, np.pi / 2)]
    records = [run(truth, Impact(w, 0.5e6, peak=20.0, angle=a, hits=4, spacing=0.5, lead=0.2)) for w, a in hits]
    result = diagnose(machine, records, effects=["runout.amplitude_1x"])
    assert result.sentence.startswith("Unknown: nothing disagrees beyond the scatter")
    wider = {k: v * 1.15e-5 * 0.02 for k, (v, _) in result.calibration.items() if k.startswith("clearance_growth")}
    assert wider["clearance_growth.1.temperature"] == pytest.approx(2e-6, rel=0.25)
    assert abs(wider["clearance_growth.0.temperature"]) < 0.5e-6

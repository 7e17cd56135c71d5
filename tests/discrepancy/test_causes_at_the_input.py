"""Causes at the input of the injectors, hidden in the rig: named or left open, never another cause.

References that are late, and amplifiers that are slow, do not come from the effects that are looked for: the records'
references pass a model of the drive by numpy, in the frequency domain, before the plant gets them.
"""

import numpy as np
import pytest

from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import CompiledModels, ParameterPoint
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.hidden_machine import HiddenTruth, draw, hide, truth_twin
from rotorsim.machine import load_machine

pytestmark = pytest.mark.slow
LATE, SLOWER, SAMPLE = 3e-4, 0.7, 2e-4


@pytest.fixture(scope="module")
def rig():
    return load_machine("dtu_gas_bearing")


@pytest.fixture(scope="module")
def models(rig):
    return CompiledModels.of(rig)


@pytest.fixture(scope="module")
def truth_plant(rig):
    return truth_twin(rig)


def through(ratio):
    """Change of a record's references by a ratio over s [rad/s] for r_x and r_y."""

    def disturb(rows, planned):
        s = 2j * np.pi * np.fft.rfftfreq(len(rows), SAMPLE)
        for axis, column in enumerate((2, 3)):
            rows[:, column] = np.fft.irfft(ratio(s, axis) * np.fft.rfft(rows[:, column]), len(rows))
        return rows

    return disturb


def late(s, axis):
    return np.exp(-s * LATE)


def slow(rig):
    """Travel of a pin with a slow amplifier over that with the file's, both in their position loop."""

    def ratio(s, axis):
        one = next(i for i in rig.injectors if i.reference == ("+x", "+y")[axis])
        [sensor] = rig.effects["pin_sensor"]
        forward = one.pd_gain * (s + one.pd_zero) / (s + rig.actuators.pd_pole) / (1 + s * one.stack_lag)
        forward = forward * rig.actuators.sensitivity / rig.actuators.sensor_sensitivity

        def closed(lag):
            L = forward / (1 + s * lag)
            return L / (1 + L * (1 + sensor.gain) / (1 + s * sensor.lag))

        return closed((1 + SLOWER) * one.amplifier_lag) / closed(one.amplifier_lag)

    return ratio


def test_late_references_are_named_and_read_at_the_input(rig, models, truth_plant):
    records = hide(rig, seed=21, truth=draw(truth_plant, (), 21), twin=truth_plant, disturb=through(late))
    found = diagnose(rig, records, models=models)
    [one] = found.effects
    assert found.status == "named" and one.form == "actuator_delay.delay"
    assert one.parameters["delay"] == pytest.approx(LATE, rel=0.05)
    for read in (i for i in found.inputs if len(i.injectors) == 2):
        assert read.late == pytest.approx(LATE, abs=max(3 * read.late_sd, 0.15 * LATE))


def test_slow_amplifiers_are_named_or_left_open_among_causes_at_the_input(rig, models, truth_plant):
    """0.04 ms: no group of lines is beyond its floor."""
    records = hide(rig, seed=22, truth=draw(truth_plant, (), 22), twin=truth_plant, disturb=through(slow(rig)))
    found = diagnose(rig, records, models=models)
    assert found.status in ("named", "tie", "unknown", "no_disagreement")
    for one in found.effects:
        assert "amplifier_lag.change" in {one.form, *one.tie_class}
        assert one.parameters["change"] == pytest.approx(SLOWER, abs=max(0.25, 3 * one.sd["change"]))


def test_a_weak_drive_of_one_pin_gets_no_other_name(rig, models, truth_plant):
    """Half of 8 % is in the gain of its axis, which is calibrated; opposed pins share the other half."""
    [form] = [f for f in candidates(truth_plant) if f.label == "actuator_gain.error of injector 2"]
    sound = draw(truth_plant, (), 23)
    point = ParameterPoint({**sound.point.values, form.parameters[0]: -0.08}, {**sound.point.fixed, **form.fixed})
    truth = HiddenTruth((form,), ((-0.08,),), point, 23)
    found = diagnose(rig, hide(rig, seed=23, truth=truth, twin=truth_plant, tiled=True), models=models)
    assert all("actuator_gain" in " ".join((one.form, *one.tie_class)) for one in found.effects)
    leading = next(e for e in found.explanations if e.effects)
    assert leading.effects[0].startswith(("actuator_gain.error of injector 2", "actuator_gain.error of injector 4"))


def test_a_sound_drive_gets_no_name(rig, models, truth_plant):
    found = diagnose(rig, hide(rig, seed=24, truth=draw(truth_plant, (), 24), twin=truth_plant, tiled=True),
                     models=models)  # fmt: skip
    assert found.status == "no_disagreement" and not found.effects and not found.inputs

"""What is found goes into a machine file that loads, with its evidence, whatever is in the file already."""

import numpy as np
import pytest
import xarray as xr

from rotorsim.discrepancy.adding import difference
from rotorsim.discrepancy.result import Diagnosis, Found
from rotorsim.machine import load_machine


def found(machine, effects, calibration=None):
    """A diagnosis of these effects, made up: only its way into the file is looked at."""
    gap = xr.Dataset({"gap": (("record", "axis", "stage"), np.zeros((0, 2, 4)))}, {"role": ("record", [])})
    evidence = {"chi2_calibrated": 900.0, "chi2_with_effect": 400.0, "numbers": 420.0, "share_gone": 0.99}
    return Diagnosis(
        "named", load_machine(machine), (), effects, (), {}, {}, gap, (), calibration or {}, evidence, "d1"
    )


@pytest.mark.parametrize(
    "one",
    [
        Found("runout", "runout.second", {"second": 3e-7, "second_phase": 1.0}, {"second": 1e-8}, ("runout.second",)),
        Found("hysteresis", "hysteresis.weight", {"weight": 4e-7}, {"weight": 1e-8}, ("hysteresis.weight",)),
        Found("weak_injector", "weak_injector.blocked of injector 2", {"blocked": 0.1, "injector": 2.0},
              {"blocked": 0.01}, ("weak_injector.blocked of injector 2",)),
        Found("sensor_gain", "sensor_gain.x", {"x": 0.04}, {"x": 0.01}, ("sensor_gain.x",)),
        Found("dead_zone", "dead_zone.half_width", {"half_width": 2e-7}, {}, ("dead_zone.half_width",)),
        Found("coupling", "coupling.second", {"second": 3.0, "second_phase": 0.2, "ellipticity": 0.0}, {}, ("a", "b")),
        Found("unbalance", "unbalance.me", {"me": 1e-6, "phase": 0.3, "position": 0.2366875}, {}, ("unbalance.me",)),
    ],
    ids=lambda f: f.form,
)  # fmt: skip
def test_every_kind_of_effect_finds_its_place_in_the_file_of_the_rig(one):
    diagnosis = found("dtu_gas_bearing", (one,))
    after = diagnosis.apply()
    table = after.effects[one.effect][-1]
    for name, value in one.parameters.items():
        assert getattr(table, name) == pytest.approx(value, rel=1e-8)
    before = diagnosis.machine
    for name, own in before.effects.items():
        assert len(after.effects[name]) >= len(own)
    assert "% of the flagged excess gone" in after._source
    assert "found by rotorsim diagnose" in difference(before, after)
    assert "DTU gas bearing rig" in after._source and "# by definition" in after._source  # comments stay


def test_the_calibration_is_written_as_what_the_fit_turned():
    calibration = {
        "curtain_discharge": (0.05, 0.01), "shaft_damping": (-0.1, 0.02), "discharge_drift.0.drift": (0.03, 0.01),
        "plenum_volume.0.change": (0.1, 0.05), "unbalance.1.me~phase.c": (1e-6, 1e-8),
        "unbalance.1.me~phase.s": (1e-6, 1e-8), "offset_x": (1e-6, 1e-9), "actuator_x": (0.02, 0.01),
    }  # fmt: skip
    after = found("dtu_gas_bearing", (), calibration).apply()
    assert after.injection.curtain_discharge == pytest.approx(0.9 * 1.05)
    assert after.shaft.damping_ratio == pytest.approx(0.012 * 0.9)
    assert after.effects["discharge_drift"][0].drift == pytest.approx(0.03)
    assert after.effects["unbalance"][1].me == pytest.approx(np.sqrt(2) * 1e-6)
    assert "calibration not written: actuator_x = 0.02" in after._source


def test_the_bearings_of_a_plain_rotor_take_their_new_stiffness():
    after = found("plain_rotor", (), {"bearing.1.ky": (0.2, 0.1), "bearing.1.kx": (-0.1, 0.1)}).apply()
    assert (after.bearings[1].kxx, after.bearings[1].kyy) == pytest.approx((9e6, 12e6))
    assert after.bearings[0].kyy is None

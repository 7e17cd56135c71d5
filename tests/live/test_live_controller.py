"""Controller of the live rig: switched on only where stable, switched off at the actuators' limit."""

import numpy as np
import pytest

from coarse_rig import RPM, make_rig, ran, shown
from rotorsim.control import plausibility_of
from rotorsim.control.systems import response
from rotorsim.live.laws import StabilityVerdict, motion, pins, read_laws
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from studies.benchmarks.control_laws import rig_model
from waiting import until


def test_the_controller_acts_and_is_switched_off_again():
    rig = make_rig(speed=3000 * RPM, pressure=0.5e6)
    rig.set("controller", "hinf")
    rig.strike(0)
    assert np.abs(rig.advance(500)[:, -4]).max() > 0.05
    rig.set("controller", "off")
    assert np.abs(rig.advance(50)[:, -4:-2]).max() == 0.0


def test_the_shipped_law_has_the_limits_of_a_design_on_its_model():
    law = read_laws([])["hinf"]
    designed = plausibility_of(rig_model(), law.Ts, law.limit, law.scheduled)
    np.testing.assert_allclose(law.plausibility.table, designed.table, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("lag", "error"), [(0.0, 0.0), (0.3e-3, 0.0), (0.0, 0.1), (0.3e-3, 0.1)])
def test_the_linear_pins_of_a_check_are_closed_over_their_sensors(lag, error):
    """L / (1 + (1 + g) L / (1 + s T)) of each pin of the pair along x, over the travel of an ideal pin."""
    machine = load_machine("dtu_gas_bearing").with_({"effects.pin_sensor.lag": lag, "effects.pin_sensor.gain": error})
    s, common = 1j * np.array([10.0, 300.0, 1000.0, 4000.0]), machine.actuators
    expected = np.zeros(4, complex)
    for own in (machine.injectors[1], machine.injectors[3]):
        L = own.pd_gain * (s + own.pd_zero) / (s + common.pd_pole) * common.sensitivity / common.sensor_sensitivity
        L /= (1 + s * own.amplifier_lag) * (1 + s * own.stack_lag)
        expected += 0.5 * L / (1 + (1 + error) * L / (1 + s * lag))
    expected *= common.sensor_sensitivity / machine.injection.pin_per_volt
    assert response(pins(Plant(machine).assembly), s)[:, 0, 0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("angle", [np.pi, np.pi / 2])
def test_sensors_turned_on_the_page_alarm_and_the_law_comes_back(angle):
    """Half a turn reverses both sensors, a quarter swaps them and reverses one; mean of y: -20 um."""
    rig = make_rig(speed=3000 * RPM, pressure=0.5e6)
    rig.set("controller", "hinf")
    rig.advance(1000)
    assert rig.alarm == ""
    rig.set("sensor_ring.angle", angle)
    rig.advance(10)
    assert "jumped further" in rig.alarm
    assert np.abs(rig.advance(300)[120:, -4:-2]).max() == 0.0
    rig.set("sensor_ring.angle", 0.0)
    rig.advance(2000)
    assert rig.alarm == "" and rig.settings.positions["controller"] == "hinf"


def test_without_a_fault_the_limits_of_the_shipped_law_change_no_bit():
    rigs = [make_rig(speed=3000 * RPM, pressure=0.5e6) for _ in range(2)]
    rigs[1].laws = {"hinf": rigs[1].laws["hinf"].with_(plausibility=None)}
    for rig in rigs:
        rig.set("controller", "hinf")
        rig.strike(0)
    np.testing.assert_array_equal(*(rig.advance(1000) for rig in rigs))


def test_a_law_that_cannot_hold_the_point_is_refused_with_the_reason():
    """P pushed the disc 18.6 um out of the start state, with 5 V."""
    rig = make_rig()
    rig.set("controller", "P")
    assert rig.settings.positions["controller"] == "off"
    assert rig.messages[-1][1].startswith(
        "P: with it the rotor is unstable if the pins move 50% more at 0 rpm, 0.30 MPa"
    )
    assert np.abs(rig.advance(500)[:, -4:-2]).max() == 0.0


@pytest.mark.parametrize(
    ("speed", "pressure"), [(0.0, 0.3e6), pytest.param(3000 * RPM, 0.5e6, marks=pytest.mark.slow), (6000 * RPM, 0.3e6)]
)
def test_a_law_moves_the_orbit_as_announced(speed, pressure):
    rig = make_rig(speed=speed, pressure=pressure)
    rig.advance(5000)
    verdict = rig.check("hinf")()
    assert not verdict.why and verdict.damping[1] > 2.4 * verdict.damping[0]
    rig.switch_on("hinf", verdict)
    rig.advance(5000)
    after = motion(rig.history.last(2000), rig.Ts)
    assert np.abs(after.disc[1]).max() == pytest.approx(verdict.orbit[1], rel=0.2, abs=0.1)
    assert np.abs(rig.history.last(2000)[:, -4:-2]).max() < max(1.1 * verdict.volts, 1.0) < rig.limit


@pytest.mark.parametrize(
    ("speed", "pressure"), [pytest.param(3000 * RPM, 0.5e6, marks=pytest.mark.slow), (6000 * RPM, 0.3e6)]
)
def test_a_law_that_is_on_is_checked_without_its_own_part_in_the_motion(speed, pressure):
    """The check of the law that is on gives the orbit that it has; it gave 5.0 um for 5.8 at 6 krpm."""
    rig = make_rig(speed=speed, pressure=pressure)
    rig.advance(5000)
    off = rig.check("hinf")()
    rig.switch_on("hinf", off)
    rig.advance(5000)
    on = rig.check("hinf")()
    assert on.orbit[1] == pytest.approx(on.orbit[0], rel=0.01)
    assert on.volts == pytest.approx(off.volts, rel=0.1)


def test_a_law_beyond_the_reserve_for_the_present_orbit_is_refused():
    rig = make_rig(speed=6000 * RPM, pressure=0.3e6, **{"runout.amplitude_1x": 18e-6})
    rig.advance(5000)
    rig.set("controller", "hinf")
    assert rig.settings.positions["controller"] == "off"
    assert "hinf: the present motion would take" in rig.messages[-1][1] and "of its 5 V" in rig.messages[-1][1]


def test_a_controller_that_stays_at_the_limit_is_switched_off_with_the_reason():
    rig = make_rig()
    rig.switch_on("P", StabilityVerdict())
    rig.advance(5000)
    assert rig.settings.positions["controller"] == "off"
    assert any("P: at the actuators' limit of 5 V" in message for _, message in rig.messages)
    assert np.abs(rig.advance(50)[:, -4:-2]).max() == 0.0


def test_the_numbers_of_the_stop_with_the_law_are_those_of_the_plant():
    rig = make_rig(speed=6000 * RPM, pressure=0.3e6)
    rig.advance(5000)
    before, verdict = motion(rig.history.last(2000), rig.Ts), rig.check("hinf")()
    rig.switch_on("hinf", verdict)
    rig.advance(5000)
    after = motion(rig.history.last(2000), rig.Ts)
    assert np.abs(before.disc[1]).max() == pytest.approx(11, abs=0.5)
    assert np.abs(after.disc[1]).max() == pytest.approx(0.65 * np.abs(before.disc[1]).max(), rel=0.1)
    assert verdict.damping == pytest.approx((0.056, 0.166), abs=0.005)


def test_the_controller_is_checked_during_the_run_and_comes_on_by_itself(runner):
    ran(runner, 2500)
    runner.set("controller", "hinf")
    runner._obey()
    assert runner.rig.settings.positions["controller"] == "off" and runner.frame()["status"]["checking"] == "hinf"
    shown(runner)
    assert runner.rig.settings.positions["controller"] == "hinf"
    runner.set("controller", "off")
    runner._obey()
    assert runner.rig.loop is None


def answered(runner):
    """Wait until a computation has left its answer as an order."""
    until(runner._orders.qsize)


def test_a_check_is_repeated_where_a_setting_was_changed_meanwhile(runner):
    """The verdict of the earlier point let the controller on, also after a reset."""
    ran(runner, 2500)
    asked, check = [], runner.rig.check
    runner.rig.check = lambda name: asked.append(runner.rig.pressure) or check(name)
    runner.apply("controller", "hinf")
    answered(runner)
    runner.apply("pressure", 0.5e6)
    runner._obey()
    assert runner.rig.loop is None
    ran(runner, 1500)
    shown(runner)
    assert asked == [0.3e6, 0.5e6] and runner.rig.settings.positions["controller"] == "hinf"


def test_a_check_right_after_a_reset_waits_until_the_motion_is_seen(runner):
    """The range that the motion takes was not looked at in the first .1 s: the controller came on, and to its limit."""
    runner.arrange({"speed": 6000 * RPM, "runout.amplitude_1x": 18e-6})
    runner.stand()
    runner.apply("controller", "hinf")
    ran(runner, 1400)
    runner._obey()
    assert runner.frame()["status"]["checking"] == "hinf" and runner.rig.loop is None
    shown(runner)
    assert runner.rig.loop is None and "hinf: the present motion would take" in runner.rig.messages[-1][1]


def test_a_computation_that_fails_reports_it_and_the_next_one_is_answered(runner):
    ran(runner, 2500)
    check = runner.rig.check
    runner.rig.check = lambda name: lambda: 1 / 0
    runner.apply("controller", "hinf")
    assert shown(runner)["checking"] == ""
    assert "ZeroDivisionError" in runner.rig.messages[-1][1]
    runner.rig.check = check
    runner.apply("controller", "hinf")
    shown(runner)
    assert runner.rig.settings.positions["controller"] == "hinf"

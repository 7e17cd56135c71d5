"""Readings of the live rig: modes from impacts, eigenvalues, spectra, orders, peak-to-peak motion."""

import numpy as np
import pytest

import rotorsim as rs
from coarse_rig import RPM, make_rig, ran, shown
from rotorsim.live.frame import another_growing
from rotorsim.live.modes import RigModes, modes_at
from rotorsim.live.runner import Runner
from rotorsim.plant.kernels.layout import READ
from waiting import until


def test_a_reading_is_shown_with_its_scatter_and_dropped_by_a_reset(runner):
    ran(runner, 5000)
    runner.rig.strike(0)
    ran(runner, 1000)
    assert shown(runner)["reading"]["why"] == "x: ringing"
    ran(runner, 1100)
    reading = shown(runner)["reading"]
    assert reading["axis"] == "x" and not reading["why"]
    assert 0 < reading["frequency_scatter"] < 5 and 0 < reading["zeta_scatter"] < 0.02
    runner.reset()
    assert shown(runner)["reading"] == {"axis": "x", "why": "reset since; hit again"}


def test_a_hit_while_the_speed_ramps_has_a_reason_and_no_reading(runner):
    ran(runner, 5000)
    runner.rig.set("speed", 6000 * RPM)
    ran(runner, 2500)
    runner.rig.strike(0)
    ran(runner, 2100)
    assert shown(runner)["reading"] == {"axis": "x", "why": "the speed was changing"}


@pytest.mark.parametrize(
    ("disturb", "why"),
    [
        (lambda rig: rig.set("unbalance.me", 9e-6), "a setting was changed within 0.4 s of the hit"),
        (lambda rig: rig.set("pressure", 0.4e6), "a setting was changed within 0.4 s of the hit"),
        (lambda rig: rig.set("impulse", 0.02), ""),
    ],
)
def test_a_setting_that_was_changed_while_it_rang_spoils_the_reading(runner, disturb, why):
    ran(runner, 5000)
    runner.rig.strike(0)
    ran(runner, 500)
    disturb(runner.rig)
    ran(runner, 1600)
    assert shown(runner)["reading"]["why"].startswith(why) and bool(why) == bool(shown(runner)["reading"]["why"])


def test_a_reading_does_not_outlive_the_settings_it_is_of(runner):
    ran(runner, 5000)
    runner.rig.strike(1)
    ran(runner, 2100)
    assert shown(runner)["reading"]["why"] == ""
    runner.rig.set("gas_heating.rise", 20.0)
    assert shown(runner)["reading"]["why"] == "a setting was changed since; hit again"


def test_two_hits_in_a_row_are_not_read_as_one(runner):
    ran(runner, 5000)
    runner.rig.strike(0)
    ran(runner, 500)
    runner.rig.strike(1)
    ran(runner, 2100)
    assert shown(runner)["reading"] == {"axis": "y", "why": "a second hit fell within its time"}


def test_a_hit_beyond_the_range_of_linear_motion_is_not_read(runner):
    ran(runner, 5000)
    runner.rig.set("impulse", 0.2)
    runner.rig.strike(0)
    ran(runner, 2100)
    reading = shown(runner)["reading"]
    assert reading["why"] and "zeta" not in reading


def test_eigenvalues_name_their_point_and_are_those_of_the_settings(runner):

    def computed():
        runner._obey()
        modes = runner.frame()["status"]["modes"]
        return None if modes["why"] else modes

    modes = until(computed)
    assert (modes["speed"], modes["pressure"]) == (3000, 0.3)
    assert modes["zeta"] == pytest.approx(modes_at(runner.rig.assembly, 3000 * RPM, 0.3e6).zeta, abs=1e-4)
    runner.rig.set("gas_heating.rise", 20.0)
    assert runner.frame()["status"]["modes"] == {"why": "being computed"}


def test_a_spectrum_needs_a_second_and_has_no_orders_while_the_speed_ramps(runner):
    ran(runner, 1000)
    frame = runner.frame()
    assert frame["spectrum"] is None and frame["orders"] == "after 1 s"
    ran(runner, 4000)
    frame = runner.frame()
    assert max(frame["spectrum"]) > 0.5 and frame["orders"] == ""
    runner.rig.set("speed", 4000 * RPM)
    ran(runner, 1000)
    assert runner.frame()["orders"] == "no orders: the speed was changing"


def test_the_swing_covers_a_turn():
    rig = make_rig(speed=60 * RPM)
    runner = Runner(rig)
    ran(runner, 1000)
    now = runner.frame()["now"]
    assert now["swing"] == [] and now["no_swing"] == "after 1.0 s"
    ran(runner, 4500)
    disc = rig.history.last(5000)[:, :2]
    assert runner.frame()["now"]["swing"] == pytest.approx(0.5e6 * np.ptp(disc, axis=0), abs=0.005)
    runner.close()


def test_noise_of_the_sensors_is_no_swing():
    """A shaft that stands does not move, while its sensors show a micrometre of noise."""
    rig = make_rig(speed=0.0)
    runner = Runner(rig)
    ran(runner, 1500)
    rows = rig.history.last(1000)
    assert 0.5e6 * np.ptp(rows[:, READ]) > 0.5
    assert max(runner.frame()["now"]["swing"]) < 0.05
    runner.close()


def test_the_distance_from_rest_is_that_of_the_orbit():
    rig = make_rig(speed=6000 * RPM)
    runner = Runner(rig)
    rig.set("unbalance.me", 5e-5)
    ran(runner, 4000)
    frame = runner.frame()
    off = np.array(frame["orbit"]["disc"]) - np.array(frame["centre"])[:, None]
    assert frame["now"]["away"] == pytest.approx(np.hypot(*off).max(), rel=0.02)
    assert frame["now"]["away"] > runner.geometry.safety  # which the page flags
    runner.close()


def test_a_growing_mode_that_is_none_of_the_axes_is_shown():
    """The lowest mode of each axis is damped; another one grows."""
    assert another_growing(RigModes((100.0, 110.0), (0.05, 0.04), least=(310.0, -0.02))) == [310.0, -0.02]
    assert another_growing(RigModes((100.0, 110.0), (0.05, -0.02), least=(110.0, -0.02))) == []
    assert another_growing(RigModes((100.0, 110.0), (0.05, 0.04), least=(110.0, 0.04))) == []
    assert another_growing(RigModes((100.0, 110.0), (0.05, -0.02), least=(310.0, -0.02))) == [310.0, -0.02]


def test_the_least_damped_of_all_modes_is_known_at_an_operating_point():
    """The pump's third and fourth modes are damped more than its first, which grows beyond 250 rad/s."""
    modes = modes_at(rs.Plant("pump_on_tables").assembly, 320.0, 0.0)
    assert modes.least[1] == pytest.approx(min(modes.zeta), rel=1e-6) and modes.least[1] < 0
    assert modes.proven

"""Whirl onset and lift-off searches under rounding: isolated failures, undamped modes, equal frequencies."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fe_shaft.pencil import Region
from fe_shaft.spectrum import everything
from rotorsim.analysis.campbell import safe_region
from rotorsim.analysis.supply import EXACT, lowest
from rotorsim.analysis.whirl_onset import LeastDamped, first_loss
from rotorsim.base.errors import NoLiftOffError
from rotorsim.plant.linearise import LinearPlant, LinearRotor

pytestmark = pytest.mark.numerical
SPEEDS = np.arange(0.0, 1001.0, 100.0)


class Oscillator:
    """A plant of one mode of 50 rad/s with a damping ratio over the speed; NaN: not carried."""

    def __init__(self, zeta):
        self.zeta = zeta

    def linearise(self, speed, pressure):
        if np.isnan(self.zeta(speed)):
            raise NoLiftOffError("not carried")
        rotor = LinearRotor(np.array([[2500.0]]), np.array([[100.0 * self.zeta(speed)]]), np.zeros((0, 1)))
        return LinearPlant(np.ones(2), np.zeros((2, 5)), np.array([[1.0, 0.0], [0.0, 0.0]]), np.array([50.0]), rotor)


def onset_of(zeta):
    return first_loss(LeastDamped(Oscillator(zeta), 0.0, Region(1e3, 0.1), [50.0]), SPEEDS)


def test_the_onset_is_where_damping_ends():
    onset, frequency, looked = onset_of(lambda s: 0.1 - s / 4370)
    assert (onset, frequency, looked) == (pytest.approx(437.0, rel=1e-6), pytest.approx(50.0), 1)


def test_damping_that_is_rounding_is_no_onset():
    assert np.isnan(onset_of(lambda s: -1e-16 * np.cos(s))[0])


def test_damping_that_is_lost_between_two_steps_only_is_found():
    """A parabola that is negative from 440 to 460 rad/s, between the steps of the search at 400 and 500."""
    assert onset_of(lambda s: 1e-6 * (s - 440) * (s - 460))[0] == pytest.approx(440.0, abs=1e-3)


def test_a_dip_that_no_three_steps_show_is_found_by_the_slopes_at_its_ends():
    """Damping ratios of 0.014 at 400 and 500 rad/s, falling and rising, and of -0.01 between."""
    onset = onset_of(lambda s: 0.02 - 0.03 / (1 + ((s - 450) / 25) ** 2))[0]
    assert onset == pytest.approx(450 - 25 / np.sqrt(2), abs=1e-3)


def test_damping_of_modes_that_are_not_all_counted_is_not_known_unless_one_grows(monkeypatch):
    def uncounted(pencil, *_):
        return replace(everything(pencil), missing=np.nan)

    def certain(zeta):
        return LeastDamped(None, 0.0, Region(1e3, 0.1), []).certain(Oscillator(lambda _: zeta).linearise(0.0, 0.0))

    assert certain(0.1) == pytest.approx(0.1)
    module = sys.modules["rotorsim.analysis.whirl_onset"]
    monkeypatch.setattr(module, "modes_in", uncounted)
    monkeypatch.setattr(module, "SMALL", 0)
    assert np.isnan(certain(0.1)) and certain(-0.1) == pytest.approx(-0.1)
    assert onset_of(lambda s: 0.1 - s / 4370)[2] == 0


def test_a_rotor_not_carried_between_two_speeds_is_whirling_where_it_is_carried_again():
    """The speed before the gap is no bracket: the search for the root ended in 'no lift-off'."""
    damping = {0.0: 0.1, 100.0: 0.05} | {float(s): -0.01 for s in SPEEDS[5:]}
    assert onset_of(lambda s: damping.get(s, np.nan))[0] == pytest.approx(500.0)
    narrow = onset_of(lambda s: 0.1 if s < 120 else np.nan if s < 170 else -0.01)[0]
    assert narrow == pytest.approx(170.0, abs=1e-3)


def test_lift_off_is_found_by_bisection():
    assert 0 <= lowest(lambda p: p >= 162e3, 2e6) - 162e3 <= EXACT
    assert lowest(lambda p: True, 2e6) == 0.0
    assert np.isnan(lowest(lambda p: False, 2e6))


@pytest.mark.parametrize("wrong", [(101e3, 160e3), (199e3, 201e3), (70e3, 1.2e5), (148e3, 152e3)])
def test_an_equilibrium_that_is_not_found_once_does_not_move_the_lift_off(wrong):
    low, high = wrong
    assert 0 <= lowest(lambda p: p >= 50e3 and not low < p < high, 2e6) - 50e3 <= EXACT


def test_undamped_is_not_safe_whatever_sign_rounding_gives():
    over = ("pressure", "speed")
    found = xr.Dataset(
        {
            "lifted": (over, np.ones((1, 4))),
            "zeta_least": (over, np.array([[1e-17, -1e-17, 1e-12, 1e-3]])),
            "wn": ((*over, "mode"), np.full((1, 4, 2), 1e4)),
            "looked": (over, np.ones((1, 4))),
            "critical_speed": (("pressure", "critical"), np.full((1, 1), np.nan)),
            "critical_zeta": (("pressure", "critical"), np.full((1, 1), np.nan)),
        },
        {"speed": [10.0, 20.0, 30.0, 40.0], "pressure": [1e5]},
    )
    assert safe_region(found)["safe"].values.tolist() == [[0, 0, 0, 1]]


def test_safe_is_a_matter_of_damping_of_amplification_and_of_having_looked():
    """Critical speeds of amplification 5 at 100 rad/s and of 2 at 300 rad/s; at 400 not everything was looked at."""
    over = ("pressure", "speed")
    found = xr.Dataset(
        {
            "lifted": (over, np.ones((1, 6))),
            "zeta_least": (over, np.array([[0.1, 0.1, 0.1, 0.1, -0.1, -0.1]])),
            "wn": ((*over, "mode"), np.full((1, 6, 2), 1e4)),
            "looked": (over, np.array([[1.0, 1.0, 1.0, 0.0, 0.0, 1.0]])),
            "critical_speed": (("pressure", "critical"), np.array([[100.0, 300.0]])),
            "critical_zeta": (("pressure", "critical"), np.array([[0.1, 0.25]])),
        },
        {"speed": [100 * 1.1499, 100 * 1.1501, 300.0, 400.0, 410.0, 420.0], "pressure": [1e5]},
    )
    safe = safe_region(found)["safe"].values[0]
    np.testing.assert_array_equal(safe, [0, 1, 1, np.nan, 0, 0])


@pytest.mark.parametrize("seed", range(8))
def test_each_axis_has_a_mode_of_its_own_where_both_are_circles(seed):
    """A symmetric rotor turning: its forward and backward modes move x and y alike."""
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    K, C = Q @ (1e6 * np.eye(2)) @ Q.T, Q @ np.array([[2.0, 100.0], [-100.0, 2.0]]) @ Q.T
    H = np.hstack([Q, np.zeros((2, 2))])
    plant = LinearPlant(np.ones(4), np.zeros((4, 5)), H, np.array([1e3]), LinearRotor(K, C, np.zeros((2, 2))))
    assert [plant.mode_of_axis(0), plant.mode_of_axis(1)] == [0, 1]

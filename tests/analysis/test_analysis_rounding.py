"""Whirl onset and lift-off searches under rounding: isolated failures, undamped modes, equal frequencies."""

import numpy as np
import pytest
import xarray as xr

from rotorsim.analysis.lift_off import EXACT, lowest
from rotorsim.analysis.safe_region import safe_region
from rotorsim.analysis.whirl_onset import first_growth
from rotorsim.plant.linearise import LinearPlant, LinearRotor

pytestmark = pytest.mark.numerical
SPEEDS = np.arange(0.0, 1001.0, 100.0)


def test_the_onset_is_where_damping_ends():
    assert first_growth(lambda s: 0.1 - s / 4370, SPEEDS) == pytest.approx(437.0, rel=1e-6)


def test_damping_that_is_rounding_is_no_onset():
    assert np.isnan(first_growth(lambda s: -1e-16 * np.cos(s), SPEEDS))


def test_a_rotor_not_carried_between_two_speeds_is_whirling_where_it_is_carried_again():
    """The speed before the gap is no bracket: the search for the root ended in 'no lift-off'."""
    damping = {0.0: 0.1, 100.0: 0.05} | {float(s): -0.01 for s in SPEEDS[5:]}
    assert first_growth(lambda s: damping.get(s, np.nan), SPEEDS) == 500.0
    narrow = first_growth(lambda s: 0.1 if s < 120 else np.nan if s < 170 else -0.01, SPEEDS)
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
        },
        {"speed": [10.0, 20.0, 30.0, 40.0], "pressure": [1e5]},
    )
    assert safe_region(found)["safe"].values.tolist() == [[0, 0, 0, 1]]


@pytest.mark.parametrize("seed", range(8))
def test_each_axis_has_a_mode_of_its_own_where_both_are_circles(seed):
    """A symmetric rotor turning: its forward and backward modes move x and y alike."""
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    K, C = Q @ (1e6 * np.eye(2)) @ Q.T, Q @ np.array([[2.0, 100.0], [-100.0, 2.0]]) @ Q.T
    H = np.hstack([Q, np.zeros((2, 2))])
    plant = LinearPlant(np.ones(4), np.zeros((4, 5)), H, 1e3, LinearRotor(K, C, np.zeros((2, 2))))
    assert [plant.mode_of_axis(0), plant.mode_of_axis(1)] == [0, 1]

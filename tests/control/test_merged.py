"""Model 2 reduced to six states, and impact responses predicted on the identified model."""

from dataclasses import replace

import numpy as np
import pytest

from identification import LinearModel
from refusals import refused
from rotorsim.base.units import KRPM
from rotorsim.control import DesignError
from rotorsim.control.designs import lqr, p
from rotorsim.control.designs.hinf_synthesis import RIG, Weights
from rotorsim.control.plants import design_plant, is_delayed_model_3, is_model_2, merged, sampled_plant, scaled_model
from rotorsim.control.sampled_loop import hit_ratios, hit_responses
from rotorsim.control.systems import System, response
from studies.benchmarks.control_laws import rig_model
from studies.thesis.weight_search import MARGIN, candidates, chosen

pytestmark = pytest.mark.numerical

POINTS = ((0.0, 0.3e6), (3 * KRPM, 0.5e6), (6 * KRPM, 0.7e6))


@pytest.mark.parametrize("q", POINTS)
def test_six_states_keep_the_gain_at_rest_and_the_phase_at_the_modes(q):
    whole, six = scaled_model(rig_model(), *q), design_plant(rig_model(), *q)
    assert (whole.order, six.order) == (10, 6)
    at = 2j * np.pi * np.array([1e-3, 60, 120, 135]) / 1e3
    one, other = response(whole, at), response(six, at)
    np.testing.assert_allclose(other[0], one[0], rtol=1e-4)
    turned = np.degrees(np.angle(other[:, [0, 1], [0, 1]] / one[:, [0, 1], [0, 1]]))
    assert np.abs(turned).max() < 8  # the error of a first-order Pade approximation of a millisecond
    assert np.abs(np.abs(other[:, 0, 0] / one[:, 0, 0]) - 1).max() < 0.15


def test_the_loops_delay_turns_the_phase_by_what_it_states():
    plain, later = (design_plant(rig_model(), 314.0, 0.5e6, delay) for delay in (0.0, 3e-4))
    at = 2j * np.pi * np.array([20.0]) / 1e3
    turned = np.angle(response(later, at)[0, 0, 0] / response(plain, at)[0, 0, 0])
    assert turned == pytest.approx(-2 * np.pi * 20 * 3e-4, rel=0.05)


def test_model_3_is_not_taken_for_model_2(model):
    three = scaled_model(model, 314.0, 0.5e6)
    assert not is_model_2(three)
    two = scaled_model(rig_model(), 314.0, 0.5e6)
    assert is_model_2(two)
    assert not is_model_2(two._replace(B=two.B + np.eye(10, 2)))
    np.testing.assert_array_equal(merged(two).D, 0)


def behind_actuators(lag=1800.0):
    """The structure of docs/identification.md: a film of one lag behind second-order actuators."""
    eye, none, wide = np.eye(2), np.zeros((2, 2)), np.zeros((2, 4))
    w, d = np.array([3900.0, 2200.0]), np.array([1.3, 0.8])
    actuators = np.zeros((4, 4))
    actuators[[0, 2], [1, 3]] = 1.0
    actuators[[1, 3], [0, 2]], actuators[[1, 3], [1, 3]] = -(w**2), -2 * d * w
    B = np.zeros((10, 2))
    B[[7, 9], [0, 1]] = 8e-6 * w**2
    A = np.block([
        [none, eye, none, wide],
        [-np.diag([5.7e5, 6.1e5]), -np.diag([91.0, 61.0]), 2.2e5 * eye, wide],
        [none, none, -lag * eye, lag * np.eye(4)[[0, 2]]],
        [np.zeros((4, 6)), actuators],
    ])  # fmt: skip
    return LinearModel(A, B, np.eye(2, 10), none, speed=314.0, pressure=0.5e6)


def test_a_structure_of_ones_own_of_ten_states_is_not_taken_for_model_2():
    """Its film drives the rotor alone, where the delays of Model 2 do so next to the pins."""
    own = behind_actuators()
    plant = design_plant(own, 314.0, 0.5e6)
    at = 2j * np.pi * np.array([1e-3, 60, 120, 300])
    one = own.C @ np.linalg.solve(at[:, None, None] * np.eye(10) - own.A, np.broadcast_to(own.B, (4, 10, 2)))
    np.testing.assert_allclose(response(plant, at / 1e3), 1e6 * one, rtol=1e-9, atol=1e-12)
    law = lqr.design(own, lqr.Spec(speed=314.0))
    assert np.all(hit_ratios(law, own, [(314.0, 0.5e6)]) < 0.6)


def test_two_lags_in_a_row_are_not_taken_for_a_lag_and_a_dead_time():
    A, B = np.zeros((8, 8)), np.zeros((8, 2))
    A[:2, 2:4], A[2:4, :2], A[2:4, 2:4] = np.eye(2), -0.57 * np.eye(2), -0.09 * np.eye(2)
    A[2:4, 4:6], A[4:6, 4:6], A[4:6, 6:] = 0.6 * np.eye(2), -1.5 * np.eye(2), 1.5 * np.eye(2)
    A[6:, 6:], B[6:] = -2.5 * np.eye(2), 2.5 * np.eye(2)
    lags = System(A, B, np.eye(2, 8), np.zeros((2, 2)))
    assert not is_delayed_model_3(lags)
    A[4:6, 6:] *= -2
    B[4:6] = -1.5 * np.eye(2)
    assert is_delayed_model_3(System(A, B, lags.C, lags.D))


def test_a_model_of_the_pins_is_refused():
    pins = replace(behind_actuators(), outputs=("pin_x", "pin_y"))
    with refused(DesignError, "model", ("pin_x", "pin_y")):
        lqr.design(pins, lqr.Spec(speed=314.0))


def test_a_hit_on_an_oscillator_has_the_norm_of_its_closed_form():
    """Sum of y^2 Ts = v^2 / (4 zeta omega^3) for a light oscillator that starts with velocity v."""
    omega, zeta, Ts = 0.75, 0.05, 0.2  # rad/ms, 1, ms
    from rotorsim.control.systems import held

    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2:, :2], A[2:, 2:] = -np.eye(2) * omega**2, -np.eye(2) * 2 * zeta * omega
    plant = held(System(A, np.zeros((4, 2)), np.eye(2, 4), np.zeros((2, 2))), Ts)
    disc, reference = hit_responses(plant, None, 2000)
    np.testing.assert_allclose(disc**2 * Ts, 1 / (4 * zeta * omega**3), rtol=1e-3)
    assert not reference.any()


def test_predicted_hits_separate_damping_from_destabilising():
    model = rig_model()
    good = hit_ratios(lqr.design(model), model, POINTS)
    assert good.shape == (3, 2)
    assert good.max() < 0.75
    bad = hit_ratios(p.make(p.Spec(kappa_x=-1.125, kappa_y=-0.99)), model, POINTS[1:2])
    assert bad.min() > 10
    np.testing.assert_allclose(hit_ratios(p.make(p.Spec(kappa_x=0.0, kappa_y=0.0)), model, POINTS), 1, rtol=1e-9)
    assert sampled_plant(model, *POINTS[0]).order == 12


@pytest.mark.slow
def test_the_rigs_weights_are_those_that_the_rule_picks_among_their_neighbours():
    neighbours = [Weights(), Weights(zeta_2=0.1, k_0=0.9), RIG, Weights(zeta_2=0.1, k_0=1.0, force=0.5)]
    found = {one.weights: one for one in candidates(rig_model(), iter(neighbours))}
    assert found[neighbours[3]].mean < found[RIG].mean  # a better mean, without the margin
    assert found[neighbours[3]].margin < MARGIN <= found[RIG].margin
    assert chosen(rig_model(), iter(neighbours)).weights == RIG
    with refused(DesignError, "weights", MARGIN):
        chosen(rig_model(), iter(neighbours[:1]))

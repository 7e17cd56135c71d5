"""Model 2 reduced to six states, and impact responses predicted on the identified model."""

import numpy as np
import pytest

from rotorsim.base.constants import KRPM
from rotorsim.bench.control import rig_model
from rotorsim.control import DesignError
from rotorsim.control.designs import lqr, p
from rotorsim.control.designs.merged import is_model_2, merged
from rotorsim.control.designs.mixed import RIG, Weights
from rotorsim.control.designs.plants import design_plant, sampled_plant, scaled_model
from rotorsim.control.designs.weight_search import MARGIN, candidates, chosen
from rotorsim.control.loop.impacts import hit_ratios, hit_responses
from rotorsim.control.numerics.systems import System, response

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


def test_a_hit_on_an_oscillator_has_the_energy_of_its_closed_form():
    """Sum of y^2 Ts = v^2 / (4 zeta omega^3) for a light oscillator that starts with velocity v."""
    omega, zeta, Ts = 0.75, 0.05, 0.2  # rad/ms, 1, ms
    from rotorsim.control.numerics.systems import held

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


def test_the_rigs_weights_are_those_that_the_rule_picks_among_their_neighbours():
    neighbours = [Weights(), Weights(zeta_2=0.1, k_0=0.9), RIG, Weights(zeta_2=0.1, k_0=1.0, force=0.5)]
    found = {one.weights: one for one in candidates(rig_model(), iter(neighbours))}
    assert found[neighbours[3]].mean < found[RIG].mean  # a better mean, without the margin
    assert found[neighbours[3]].margin < MARGIN <= found[RIG].margin
    assert chosen(rig_model(), iter(neighbours)).weights == RIG
    with pytest.raises(DesignError, match=r"no weights leave a disk margin of 0\.8"):
        chosen(rig_model(), iter(neighbours[:1]))

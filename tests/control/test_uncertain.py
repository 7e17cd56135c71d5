"""Robust H-infinity: errors of the model that a loop must stand, by small gain and one scale."""

from dataclasses import replace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.rounding import unstable_poles
from rotorsim.control import DesignError, hinf, uncertainty_between
from rotorsim.control.designs.hinf import uncertain, uncertain_loop_norm
from rotorsim.control.designs.hinf_synthesis import Weights, bounds, closed, controller, mixed_sensitivity
from rotorsim.control.plants import design_plant
from rotorsim.control.systems import System

POINT = (314.0, 0.5e6)


@pytest.fixture(scope="module")
def plant(model):
    return design_plant(model, *POINT)


def test_the_blocks_of_the_uncertain_problem_are_those_of_its_definition(plant):
    """Closed with a constant gain, z_delta / w_delta is epsilon K G (I - K G)^-1 whatever the scale."""
    P = uncertain(mixed_sensitivity(plant, Weights()), plant, 0.4, 0.05)
    K = System(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.array([[0.05, 0.01], [0.0, 0.04]]))
    loop = closed(P, K)
    omega = 0.7j
    whole = loop.D + loop.C @ np.linalg.solve(omega * np.eye(loop.order) - loop.A, loop.B)
    G = plant.C @ np.linalg.solve(omega * np.eye(plant.order) - plant.A, plant.B)
    T = np.linalg.solve(np.eye(2) - K.D @ G, K.D @ G)
    np.testing.assert_allclose(whole[:2, :2], 0.4 * T, rtol=1e-9)


def test_without_error_the_smallest_gamma_is_the_nominal_one(plant):
    P = mixed_sensitivity(plant, Weights())
    assert bounds(uncertain(P, plant, 1e-6, 1e-3)).high == pytest.approx(bounds(P).high, rel=1e-3)


@pytest.mark.slow
def test_a_larger_error_costs_gamma_and_is_stood(model, plant):
    laws = [hinf.design(model, replace(hinf.Spec(), uncertainty=error)) for error in (0.0, 0.1, 0.3)]
    gammas = [law.about["optimal_gamma"] for law in laws]
    assert gammas[0] < gammas[1] < gammas[2]
    assert 0 < laws[1].about["norm_of_uncertain_loop"] < laws[2].about["norm_of_uncertain_loop"] < 1


def test_the_loop_is_stable_for_random_errors_of_that_size_and_unstable_for_a_worst_one(plant):
    error = 0.3
    P = uncertain(mixed_sensitivity(plant, Weights()), plant, error, 0.12)
    K = controller(P, 1.02 * bounds(P).high)
    norm, rng = uncertain_loop_norm(plant, K, error), np.random.default_rng(0)

    def unstable(delta):
        B = plant.B @ (np.eye(2) + delta)
        A = np.block([[plant.A + B @ K.D @ plant.C, B @ K.C], [K.B @ plant.C, K.A]])
        return unstable_poles(A) > 0

    assert norm < 1
    for _ in range(100):
        delta = rng.normal(size=(2, 2))
        assert not unstable(error * delta / np.linalg.norm(delta, 2))
    found = [any(unstable(s * sign * np.eye(2)) for sign in (-1, 1)) for s in (error, 5 * error / norm)]
    assert found == [False, True]


def test_an_uncertainty_larger_than_the_model_is_refused(model):
    with refused(DesignError, "uncertainty", 0.9):
        hinf.design(model, replace(hinf.Spec(), uncertainty=0.9))
    with pytest.raises(DesignError, match="uncertainty"):
        hinf.Spec(uncertainty=1.5)


def test_models_of_other_points_differ_more_the_further_they_are(model):
    near, far = (uncertainty_between(model, POINT, [q]) for q in ((330.0, 0.51e6), (600.0, 0.7e6)))
    assert uncertainty_between(model, POINT, [POINT]) < 1e-9
    assert 0 < near < 0.3 < far

"""H-infinity solver: against slycot where installed, and by the norm of its own closed loop."""

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.units import KRPM
from rotorsim.control import DesignError
from rotorsim.control.designs import hinf
from rotorsim.control.designs.hinf import coprime_truncated
from rotorsim.control.designs.hinf_synthesis import Weights, closed, controller, mixed_sensitivity, solve
from rotorsim.control.plants import design_plant
from rotorsim.control.sampled_loop import model_loop
from rotorsim.control.systems import System, gain, peak_gain, response

pytestmark = pytest.mark.numerical

CASES = [Weights(), Weights(force=0.1), Weights(k_0=0.9, zeta_2=0.1, force=0.3)]


@pytest.fixture(scope="module")
def plant(model):
    return design_plant(model, 3 * KRPM, 0.5e6)


@pytest.mark.parametrize("weights", CASES)
def test_gamma_is_slycots_to_1e_4(plant, weights):
    slycot = pytest.importorskip("slycot")
    P = mixed_sensitivity(plant, weights)
    B, C = np.hstack([P.B1, P.B2]), np.vstack([P.C1, P.C2])
    D = np.block([[P.D11, P.D12], [P.D21, np.zeros((2, 2))]])
    theirs = slycot.sb10ad(P.order, B.shape[1], C.shape[0], 2, 2, 100.0, P.A, B, C, D)[0]
    assert solve(P) == pytest.approx(theirs, rel=1e-4)


@pytest.mark.parametrize("weights", CASES)
def test_the_controller_keeps_its_gamma_and_none_keeps_less(plant, weights):
    P = mixed_sensitivity(plant, weights)
    best = solve(P)
    norm = peak_gain(closed(P, controller(P, 1.02 * best)))
    assert best * (1 - 1e-6) <= norm <= 1.02 * best
    with pytest.raises(DesignError, match=r"Riccati|coupling"):
        controller(P, 0.999 * best)


def test_the_norm_of_a_resonance_is_the_closed_form():
    zeta, omega = 0.03, 0.7
    A = np.array([[0, 1], [-(omega**2), -2 * zeta * omega]])
    s = System(A, np.array([[0.0], [omega**2]]), np.array([[1.0, 0]]), np.zeros((1, 1)))
    assert peak_gain(s) == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-5)
    assert peak_gain(System(-s.A, s.B, s.C, s.D)) == np.inf


def test_an_integrator_has_the_gamma_of_its_closed_form():
    """x' = w + u, z = (x, u), y = x + n: the H-infinity optimum of LQG data A = 0, B = C = 1 is sqrt(2)."""
    from rotorsim.control.designs.hinf_synthesis import Generalised

    one, zero = np.ones((1, 1)), np.zeros((1, 1))
    P = Generalised(zero, np.array([[1.0, 0.0]]), one, np.array([[1.0], [0.0]]), one, np.zeros((2, 2)),
                    np.array([[0.0], [1.0]]), np.array([[0.0, 1.0]]))  # fmt: skip
    # both Riccati equations: 1 - (1 - g^-2) X^2 = 0, so X = Y = g / sqrt(g^2 - 1), and X Y < g^2 means g^2 > 2
    assert solve(P) == pytest.approx(np.sqrt(2), rel=1e-6)


def test_reduction_is_judged_by_s(model):
    law = hinf.design(model, hinf.Spec(order=None, tolerance=0.1))
    assert law.order < 12
    assert law.about["change_of_S"] < 0.1


def test_an_unstable_controller_is_reduced_to_four_states_that_keep_its_loop(model):
    at = {"speed": 4 * KRPM, "pressure": 0.7e6}
    full, small = (hinf.design(model, hinf.Spec(**at, order=n)) for n in (0, 4))
    assert (full.order, small.order) == (12, 4)
    loops = [model_loop(law, model, 4 * KRPM, 0.7e6) for law in (full, small)]
    change = np.linalg.norm(loops[0].So - loops[1].So, 2, axis=(1, 2)).max() / loops[0].peak
    assert change == pytest.approx(small.about["change_of_S"], abs=1e-6)
    assert change < 0.15
    assert np.isfinite(small.about["reached"])


def test_coprime_factors_of_full_order_give_the_system_back():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(5, 5))
    whole = System(
        A - (np.linalg.eigvals(A).real.max() - 0.5) * np.eye(5), *(rng.normal(size=s) for s in ((5, 2), (2, 5), (2, 2)))
    )
    assert np.linalg.eigvals(whole.A).real.max() > 0
    found, points = coprime_truncated(whole, 5), 1j * np.geomspace(0.1, 100, 20)
    np.testing.assert_allclose(response(found, points), response(whole, points), rtol=1e-6, atol=1e-8)


def test_an_order_that_loses_the_loop_is_refused(model):
    with refused(DesignError, "order", 3):
        hinf.design(model, hinf.Spec(order=3))


def test_what_binds_is_named(model):
    with pytest.raises(DesignError, match="infinite frequency alone ask for 1"):
        controller(mixed_sensitivity(design_plant(model, 3 * KRPM, 0.5e6), Weights()), 0.9)
    with pytest.raises(DesignError, match="rank of D12"):
        hinf.design(model, hinf.Spec(weights=Weights(over_M_b=0.0)))


def test_a_gain_has_its_own_response():
    np.testing.assert_array_equal(response(gain([[2.0]]), np.array([1j]))[0], [[2.0]])

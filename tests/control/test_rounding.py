"""Independence of designs from units and coordinates of the states, that is from rounding."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from identification import LinearModel
from rotorsim.base.rounding import DECAYS
from rotorsim.base.units import KRPM
from rotorsim.control import DesignError
from rotorsim.control.designs import lqr
from rotorsim.control.designs.hinf import balanced, truncated
from rotorsim.control.designs.p import Spec, make
from rotorsim.control.designs.placement import _distinct
from rotorsim.control.plants import axis_modes, check_modes, design_plant
from rotorsim.control.sampled_loop import Sweep, check_loop
from rotorsim.control.systems import System, block_diag, response

pytestmark = pytest.mark.numerical
SEEDS = st.integers(0, 2**32 - 1)
few = settings(max_examples=15, derandomize=True)
AXIS = 1j * np.geomspace(0.01, 100, 60)


def in_states(system, T):
    """The same system in the states T x."""
    back = np.linalg.inv(T)
    return System(T @ system.A @ back, T @ system.B, system.C @ back, system.D)


def coordinates(rng, n, decades=6.0):
    """Turned and then scaled by up to `decades` decades either way."""
    return np.linalg.qr(rng.normal(size=(n, n)))[0] * 10.0 ** rng.uniform(-decades, decades, n)[:, None]


def bank(rng, n=4):
    """Modes from 0.1 to 10 rad/s with two inputs and outputs."""
    wn, zeta = np.geomspace(0.1, 10, n), rng.uniform(0.05, 0.7, n)
    A = block_diag(*(np.array([[0.0, 1.0], [-w * w, -2 * z * w]]) for w, z in zip(wn, zeta, strict=True)))
    return System(A, rng.normal(size=(2 * n, 2)), rng.normal(size=(2, 2 * n)), np.zeros((2, 2)))


def distance(one, other):
    there = response(other, AXIS)
    return np.abs(response(one, AXIS) - there).max() / np.abs(there).max()


def undamped(seed=None, spin=0.0):
    """Disc in springs of 1000 rad/s without damping [m, V], its states turned; `spin` [rad/s] splits its modes."""
    spring = np.block([[np.zeros((2, 2)), np.eye(2)], [-1e6 * np.eye(2), spin * np.array([[0.0, 1.0], [-1.0, 0.0]])]])
    system = System(spring, np.vstack([np.zeros((2, 2)), np.eye(2)]), np.eye(2, 4) * 1e-6, np.zeros((2, 2)))
    T = np.eye(4) if seed is None else np.linalg.qr(np.random.default_rng(seed).normal(size=(4, 4)))[0]
    return in_states(system, T * np.array([1.0, 1.0, 1e-3, 1e-3]))


@few
@given(SEEDS)
def test_balanced_coordinates_keep_the_response_whatever_the_states_were(seed):
    rng = np.random.default_rng(seed)
    whole = bank(rng)
    found, hankel = balanced(in_states(whole, np.diag(10.0 ** rng.uniform(-8, 8, whole.order))))
    assert distance(found, whole) < 1e-8
    np.testing.assert_allclose(hankel, balanced(whole)[1], rtol=1e-6)


@few
@given(SEEDS)
def test_states_that_are_not_seen_are_left_out_without_a_trace(seed):
    rng = np.random.default_rng(seed)
    whole = bank(rng)
    unseen = System(whole.A, whole.B, np.hstack([whole.C[:, :6], np.zeros((2, 2))]), whole.D)
    found, _ = balanced(in_states(unseen, coordinates(rng, 8, 0.5)))
    assert distance(truncated(unseen, 6), unseen) < 1e-8
    assert distance(System(found.A[:6, :6], found.B[:6], found.C[:, :6], found.D), unseen) < 1e-6


@few
@given(SEEDS)
def test_a_mode_is_movable_whatever_the_units(model, seed):
    rng = np.random.default_rng(seed)
    plant = design_plant(model, 3 * KRPM, 0.5e6)
    scale = np.diag(10.0 ** rng.uniform(-6, 6, plant.order))
    there = in_states(plant, scale)
    units = 10.0 ** rng.choice([-12, 0, 12], 2)
    check_modes(there._replace(B=there.B * units[0], C=there.C * units[1]), "test")


@few
@given(SEEDS)
def test_a_mode_that_nothing_moves_is_found_whatever_the_units(seed):
    rng = np.random.default_rng(seed)
    whole = bank(rng)
    still = whole._replace(B=np.vstack([whole.B[:6], np.zeros((2, 2))]))
    there = in_states(still, np.diag(10.0 ** rng.uniform(-4, 4, 8)))
    units = 10.0 ** rng.choice([-12, 0, 12])
    with pytest.raises(DesignError, match="uncontrollable"):
        check_modes(there._replace(B=there.B * units), "test")


@pytest.mark.parametrize("seed", range(8))
def test_an_undamped_loop_passes_no_gate(seed):
    """Its poles are on the circle: rounding puts them on either side."""
    law = make(Spec(kappa_x=0.0, kappa_y=0.0))
    with pytest.raises(DesignError, match="unstable"):
        check_loop(law, LinearModel(*undamped(seed)), [(0.0, 0.5e6)])


def test_a_pole_that_only_rounding_puts_inside_counts_as_unstable_in_a_sweep():
    radius = np.array([[0.9, 1 - 1e-15, 1.0, 1.1, np.nan, DECAYS - 1e-12]])
    assert Sweep(np.zeros(1), np.zeros(6), radius, radius).unstable == 4


@pytest.mark.parametrize("seed", range(8))
def test_each_axis_has_the_same_mode_in_all_coordinates_where_both_modes_are_circles(seed):
    plant = undamped(seed, spin=100.0)
    expected = axis_modes(undamped(spin=100.0))
    assert axis_modes(plant) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("y", "u"), [(1e8, 5e7), (1e-8, 5e-9)])
def test_only_the_ratio_of_the_weights_matters(model, y, u):
    """scipy's solver raised ValueError or LinAlgError where both were far from 1."""
    law, same = lqr.design(model), lqr.design(model, lqr.Spec(y=y, u=u))
    np.testing.assert_allclose(same.C, law.C, rtol=1e-6, atol=1e-6 * np.abs(law.C).max())


def test_weights_beyond_double_precision_are_refused_in_one_sentence(model):
    with pytest.raises(DesignError, match="bring y and u closer together"):
        lqr.design(model, lqr.Spec(y=1e-40, u=1e40))
    with pytest.raises(DesignError, match="bring force and noise closer together"):
        lqr.design(model, lqr.Spec(force=1e40, noise=1e-40))


def test_the_observers_poles_do_not_hang_on_the_order_in_which_they_are_found(rng_seeded=7):
    poles = np.array([0.5, 0.4995, 0.499, 0.5 + 1e-12, 0.2 + 0.3j, 0.2 - 0.3j])
    first = np.sort_complex(_distinct(poles))
    assert np.diff(np.sort(first.real[first.imag == 0])).min() > 0.9e-3
    for seed in range(5):
        again = np.random.default_rng([rng_seeded, seed]).permutation(poles)
        np.testing.assert_allclose(np.sort_complex(_distinct(again)), first, rtol=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_a_model_without_damping_is_never_called_stable(seed):
    model = LinearModel(*undamped(seed))
    assert not model.stable and not model.discrete(2e-4).stable
    damped = undamped(seed)
    assert LinearModel(damped.A - np.eye(4), *damped[1:]).stable

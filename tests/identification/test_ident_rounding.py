"""Ranks and inverses in identification: independent of units, refused where undetermined."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from identification.local.confidence import simulated
from identification.local.fits import schur
from identification.lpv_model import fit_surfaces, make_basis
from model3 import TS, model, prbs
from rotorsim.base.errors import UnfitError

pytestmark = pytest.mark.numerical
SEEDS = st.integers(0, 2**32 - 1)
few = settings(max_examples=10, derandomize=True)


@few
@given(SEEDS)
def test_information_on_parameters_does_not_hang_on_the_units_of_the_initial_state(seed):
    rng = np.random.default_rng(seed)
    J, unit = rng.normal(size=(40, 7)), np.append(np.ones(4), 10.0 ** rng.uniform(-10, 10, 3))
    found, there = (schur(X.T @ X, 4) for X in (J, J * unit))
    np.testing.assert_allclose(there, found, rtol=1e-9, atol=1e-9 * np.abs(found).max())


def test_an_initial_state_that_shows_nothing_takes_no_information():
    rng = np.random.default_rng(3)
    J = rng.normal(size=(40, 6))
    J[:, 5] = J[:, 4]
    expected = schur(J[:, :5].T @ J[:, :5], 4)
    np.testing.assert_allclose(schur(J.T @ J, 4), expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


@few
@given(SEEDS)
def test_a_simulation_does_not_hang_on_the_units_of_the_states(seed):
    rng = np.random.default_rng(seed)
    u, sampled = prbs(rng, 400, rest=0), model().discrete(TS)
    x0 = np.array([1e-5, -1e-5, 1e-3, 1e-3, 0.5, 0.5])
    signals = SimpleNamespace(y=sampled.simulate(u, TS, x0), u=u, Ts=TS, Q=np.full((400, 1), 400**-0.5), breaks=())
    unit = 10.0 ** rng.uniform(-8, 8, 6)
    other = replace(sampled, A=sampled.A * unit[:, None] / unit, B=sampled.B * unit[:, None], C=sampled.C / unit)
    np.testing.assert_allclose(simulated(other, signals), simulated(sampled, signals), atol=1e-6 * 1e-5)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("apart", [0.0, 1e-13])
def test_points_along_which_speed_and_pressure_rise_together_make_no_surface(order, apart):
    """Off the line the surfaces of such points were rounding times 1e13, or the least of many."""
    share = np.linspace(0, 1, 9)
    rng = np.random.default_rng(2)
    points = np.column_stack([600 * share, 3e5 + 4e5 * share * (1 + apart * rng.normal(size=9))])
    with pytest.raises(UnfitError, match=r"fit_lpv\.order"):
        make_basis(points, order)


def test_points_slightly_off_the_line_make_one():
    share = np.linspace(0, 1, 9)
    points = np.column_stack([600 * share, 3e5 + 4e5 * share + 1e4 * (-1.0) ** np.arange(9)])
    basis, values = make_basis(points, 1), (2 + points[:, :1] / 600 - points[:, 1:] / 4e5)
    np.testing.assert_allclose(basis.at(np.array([[600.0, 3e5]])) @ fit_surfaces(basis, points, values).T, 2.25)

"""Matrix decisions near rounding: definiteness, rank and stability, independent of units and coordinates."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from rotorsim.base.rounding import (
    decays,
    definite,
    falls_below_zero,
    first_of_largest,
    least_squares,
    normal_root,
    repeated,
    unstable_poles,
    whirl_sense,
)

pytestmark = pytest.mark.numerical
SEEDS = st.integers(0, 2**32 - 1)
few = settings(max_examples=20, derandomize=True)


def turned(rng, values):
    Q = np.linalg.qr(rng.normal(size=(len(values), len(values))))[0]
    return (Q * values) @ Q.T


@few
@given(SEEDS)
def test_a_singular_matrix_is_never_called_definite_and_a_definite_one_always(seed):
    rng = np.random.default_rng(seed)
    unit = 10.0 ** rng.uniform(-8, 8, 5)
    for least, answer in ((0.0, False), (1e-9, True), (-1e-9, False)):
        M = turned(rng, np.array([least, 1.0, 1.5, 1.8, 2.0]))
        assert definite(M * unit * unit[:, None]) == answer
        assert definite(np.array([M, np.eye(5)])).tolist() == [answer, True]


def test_the_coupling_of_x_and_its_inverse_is_singular():
    """[X I; I X^-1] >= 0 with as many zeros as states: no controller follows from it."""
    rng = np.random.default_rng(1)
    for _ in range(10):
        X = turned(rng, np.array([1.0, 2.0, 30.0]))
        assert not definite(np.block([[X, np.eye(3)], [np.eye(3), np.linalg.inv(X)]]))


@few
@given(SEEDS)
def test_the_inverse_of_a_normal_matrix_does_not_hang_on_units(seed):
    rng = np.random.default_rng(seed)
    J, unit = rng.normal(size=(20, 4)), 10.0 ** rng.uniform(-12, 12, 4)
    expected = np.linalg.inv(J.T @ J)
    W = normal_root((J * unit).T @ (J * unit)) * unit[:, None]
    np.testing.assert_allclose(W @ W.T, expected, rtol=1e-9, atol=1e-12)


@few
@given(SEEDS)
def test_what_nothing_shows_has_a_large_variance_and_the_rest_its_own(seed):
    """Two columns alike: their sum is known as well as ever, each alone is not."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 30))
    J = np.stack([a, a, b], axis=1)
    W = normal_root(J.T @ J)
    V = W @ W.T
    assert V[0, 0] > 1e6 and V[1, 1] > 1e6
    both = np.stack([a, b], axis=1)
    alone = np.linalg.inv(both.T @ both)
    assert V[2, 2] == pytest.approx(alone[1, 1], rel=1e-3)


@few
@given(SEEDS)
def test_least_squares_do_not_hang_on_units(seed):
    rng = np.random.default_rng(seed)
    J, y, unit = rng.normal(size=(20, 4)), rng.normal(size=20), 10.0 ** rng.uniform(-12, 12, 4)
    expected = np.linalg.lstsq(J, y, rcond=None)[0]
    np.testing.assert_allclose(least_squares(J * unit, y) * unit, expected, rtol=1e-8)
    np.testing.assert_allclose(least_squares(J, np.stack([y, 2 * y], axis=1))[:, 1], 2 * expected, rtol=1e-8)


@few
@given(SEEDS)
def test_a_pole_on_the_axis_is_decided_by_nobody(seed):
    rng = np.random.default_rng(seed)
    T = rng.normal(size=(5, 5))
    back = np.linalg.inv(T)
    for first, count in ((0.0, None), (1e-6, 1), (-1e-6, 0)):
        assert unstable_poles(T * np.array([first, -1.0, -2.0, -3.0, -4.0]) @ back) == count


def test_only_poles_well_inside_the_circle_decay():
    assert decays(np.array([0.5, -0.999, 0.9j])) and decays(np.array([]))
    for pole in (1.0, 1 - 1e-15, -1.0, np.nan, np.inf, 1.1):
        assert not decays(np.array([0.5, pole]))


def test_of_numbers_that_are_alike_the_first_is_taken():
    assert first_of_largest(np.array([0.5 - 1e-12, 0.5])) == first_of_largest(np.array([0.5, 0.5 - 1e-12])) == 0
    assert first_of_largest(np.array([0.4, 0.5])) == 1


def test_a_crossing_is_found_and_an_end_where_rounding_turned_the_sign_is_no_error():
    assert falls_below_zero(lambda x: 1 - x, 0.0, 3.0) == pytest.approx(1.0)
    assert falls_below_zero(lambda x: -1e-17 - x, 0.0, 3.0) == 0.0
    assert falls_below_zero(lambda x: 1e-17, 0.0, 3.0) == 3.0


def test_eigenvalues_alike_within_rounding_are_repeated_and_round_orbits_have_a_sense():
    assert repeated(np.array([1j, 1j * (1 + 1e-13), 2j, 0.1 + 2j])).tolist() == [True, True, False, False]
    assert whirl_sense(np.array([1.0, -0.5, 0.01, np.nan])).tolist() == ["forward", "backward", "mixed", ""]

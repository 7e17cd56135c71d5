"""The films' moment against tilt in linear models, and the factors of a film: dense matrices, threads, copies."""

import copy
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy import sparse

import rotorsim as rs
from reynolds.perturbation import LinearFilm
from rotorsim.plant.film_response import FilmResponse


@pytest.fixture(scope="module")
def models():
    """Models of the rig by the part of the film that is solved, without and with the moment."""
    machine = rs.load_machine("dtu_gas_bearing").with_({"grid.n_theta": 16, "grid.n_z": 8})
    plants = {part: rs.Plant(machine.with_({"grid.symmetry": part})) for part in ("auto", "none")}
    return {
        part: [plant.linearise(300.0, 0.5e6, moment=way) for way in (False, True)] for part, plant in plants.items()
    }


def test_half_and_whole_films_resist_tilt_alike(models):
    for way in (0, 1):
        half, whole = models["auto"][way], models["none"][way]
        np.testing.assert_allclose(half.eigenvalues[:4], whole.eigenvalues[:4], rtol=1e-7)


def test_the_moment_shifts_a_mode_by_what_its_work_on_the_tilt_of_the_mode_is(models):
    """First order: 2 s ds = - t' Z t over the modal mass, t the tilt of the journal in the mode, Z the film's."""
    plain, full = models["auto"]
    s = plain.eigenvalues[0]
    q = plain.modes.right[-2 * (m := len(plain.rotor.stiffness)) : -m, 0]
    step = 1e-4 * abs(s)
    slope = (plain.dynamic_stiffness(s + step) - plain.dynamic_stiffness(s - step)) / (2 * step)
    left = np.linalg.svd(plain.dynamic_stiffness(s).conj().T)[2][-1].conj()
    T = full.rotor.Bf[2:]
    Z = full.response.factors(np.array([s])).Z[0, 2:, 2:]
    shift = -(left.conj() @ T.T @ Z @ T @ q) / (left.conj() @ slope @ q)
    assert full.eigenvalues[0] - s == pytest.approx(shift, rel=0.05)
    assert full.wn[0] > plain.wn[0]


@pytest.mark.parametrize("adjoint", [False, True])
def test_a_film_at_the_decay_of_one_of_its_cells_has_no_factors_there_and_keeps_them_elsewhere(adjoint):
    J = sparse.csc_matrix([[2.0, 0.5, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 2.0]])
    moved = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    film = LinearFilm(np.ones(3), J, moved, 0 * moved, moved[:, :1], moved.T)
    found = FilmResponse(film).factors(np.array([-2.0, 1j])).solve(np.ones((3, 2)), adjoint)
    assert not np.isfinite(found[:, 0]).any()
    s = -1j if adjoint else 1j
    assert found[:, 1] == pytest.approx(np.linalg.solve(J.toarray() + s * np.eye(3), np.ones(3)))


def banded(n=40):
    """A film of n states without a machine, by a seed."""
    rng = np.random.default_rng(3)
    J = np.diag(rng.uniform(4, 5, n)) + sum(np.diag(rng.standard_normal(n - abs(k)), k) for k in (-3, -1, 1, 3))
    moved, read = rng.standard_normal((n, 4)), rng.standard_normal((4, n))
    return FilmResponse(LinearFilm(rng.uniform(1, 2, n), sparse.csc_matrix(J), moved, 2 * moved, moved, read)), rng


@pytest.mark.parametrize("adjoint", [False, True])
def test_any_number_of_frequencies_or_columns_is_solved_as_a_dense_matrix_is(adjoint):
    response, rng = banded()
    film = response.film
    J = film.J.toarray()
    s = rng.standard_normal(19) + 3j * rng.standard_normal(19)
    matrices = [J + one * np.diag(film.S) for one in s]
    b = rng.standard_normal((40, 19)) + 1j * rng.standard_normal((40, 19))

    def solved(matrix, columns):
        return np.linalg.solve(matrix.conj().T if adjoint else matrix, columns)

    every, first = response.factors(s), response.factors(s[:1])
    dense = np.column_stack([solved(matrix, b[:, k]) for k, matrix in enumerate(matrices)])
    np.testing.assert_allclose(every.solve(b, adjoint), dense, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(first.solve(b, adjoint), solved(matrices[0], b), rtol=1e-11, atol=1e-13)
    held = [
        film.F_y @ np.linalg.solve(matrix, film.J_X + one * film.S_X) for one, matrix in zip(s, matrices, strict=True)
    ]
    np.testing.assert_allclose(every.Z, held, rtol=1e-11, atol=1e-13)
    own = np.diag(J) + s[:, None] * film.S
    shares = np.array([np.linalg.det(matrix) for matrix in matrices]) / np.prod(own, axis=1)
    np.testing.assert_allclose(np.exp(every.log), shares, rtol=1e-11)


def test_threads_solve_with_the_same_factors_as_one_does():
    response, rng = banded(400)
    factors, b = response.factors(rng.standard_normal(8) + 3j), rng.standard_normal((2, 400, 8))
    own = [factors.solve(one) for one in b]

    def unequal(k):
        return sum(not np.array_equal(factors.solve(b[k]), own[k]) for _ in range(500))

    with ThreadPoolExecutor(2) as threads:
        assert list(threads.map(unequal, (0, 1))) == [0, 0]


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_copy_of_factors_keeps_them_when_the_first_is_gone_and_gives_no_room_to_two(copied):
    response, rng = banded()
    b = rng.standard_normal((40, 1))
    first = response.factors(np.array([3j]))
    own, other = first.solve(b), copied(first)
    del first
    later = [response.factors(np.array([1j]))]
    later[0].solve(b)
    np.testing.assert_array_equal(other.solve(b), own)
    del other
    later += [response.factors(np.array([s])) for s in (2j, 4j)]
    for _ in range(2):
        for factors in later:
            dense = np.linalg.solve(response.film.J.toarray() + factors.s * np.diag(response.film.S), b)
            np.testing.assert_allclose(factors.solve(b), dense, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize(("count", "shape"), [(3, (40, 5)), (3, (40, 9)), (3, (40, 1)), (1, (39, 1)), (1, (40,))])
def test_right_hand_sides_that_are_not_those_of_the_frequencies_are_refused(count, shape):
    factors = banded()[0].factors(1j * np.arange(count))
    with pytest.raises(ValueError, match=re.escape(str(shape))):
        factors.solve(np.ones(shape))


@pytest.mark.parametrize("shape", [(0,), (1, 2)])
def test_factors_at_no_frequency_or_at_a_table_of_them_are_refused(shape):
    with pytest.raises(ValueError, match=re.escape(str(shape))):
        banded()[0].factors(np.ones(shape))

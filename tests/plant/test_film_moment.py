"""The films' moment against tilt in linear models: of half and whole films, and what it does to a mode."""

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

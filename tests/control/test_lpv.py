"""LPV synthesis: relations between gammas that hold for any model, on a small Model 1 rig (10 states)."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsim.control import DesignError
from rotorsim.control.designs import lpv
from rotorsim.control.designs.lpv_controller import controller_at
from rotorsim.control.designs.lpv_problem import EXPONENTS, Grid, synthesise
from rotorsim.control.designs.mixed import closed, mixed_sensitivity
from rotorsim.control.designs.plants import design_plant
from rotorsim.control.numerics.gamma import solve
from rotorsim.control.numerics.lmi import Problem
from rotorsim.control.numerics.systems import peak_gain

pytestmark = pytest.mark.numerical
SPEC = lpv.Spec(grid=(3, 3), table=(3, 3), validation=(3, 3), margin=0.02)


@pytest.fixture(scope="module")
def rig(small):
    return small()


@pytest.fixture(scope="module")
def made(rig):
    return lpv.synthesis(rig, SPEC)


def plants_of(rig, made, n):
    points = [(w, p) for w in lpv.made_axis(made, 0, n) for p in lpv.made_axis(made, 1, n)]
    return [(lpv.scaled_point(made, *q), lpv.scaled_plant(rig, SPEC, *q, made.scale)) for q in points]


def one_point(rig, exponents=EXPONENTS[:1], scale=None, **settings):
    P = mixed_sensitivity(design_plant(rig, 314.0, 0.5e6), SPEC.weights)
    P = lpv.rescaled(P, lpv.balance([P]) if scale is None else scale)
    return P, synthesise(Grid(np.zeros((1, 2)), (P,)), exponents, **settings)


def test_on_one_point_gamma_is_that_of_h_infinity(rig):
    P, found = one_point(rig, bound=1e4)
    assert 1 - 1e-4 <= found.gamma / solve(P) <= 1.01


def test_gamma_is_at_least_every_local_one(rig, made):
    assert made.optimal >= max(solve(P) for _, P in plants_of(rig, made, 3)) * (1 - 1e-4)


def test_the_frozen_norm_stays_below_gamma_also_between_the_design_points(rig, made):
    norms = [peak_gain(closed(P, controller_at(P, made.solution, q))) for q, P in plants_of(rig, made, 5)]
    assert max(norms) <= made.solution.gamma * 1.005


def test_a_finer_grid_needs_hardly_more(rig, made):
    assert lpv.validated(rig, SPEC, made, (16, 16)) <= 1.005 * lpv.validated(rig, SPEC, made, (3, 3))


def test_a_constant_x_needs_at_least_as_much(rig, made):
    grid = Grid(*zip(*[(q, P) for q, P in plants_of(rig, made, 3)], strict=True))
    constant = synthesise(replace(grid, points=np.array(grid.points)), EXPONENTS[:1])
    assert constant.gamma >= made.optimal * (1 - 1e-4)


def test_a_constant_plant_has_a_constant_gamma(small):
    still = small(0.0)
    P, found = one_point(still)
    points = np.array([(-1.0, -1.0), (1.0, 0.5)])
    assert synthesise(Grid(points, (P, P)), EXPONENTS[:2]).gamma == pytest.approx(found.gamma, rel=2e-3)


def test_another_scaling_of_the_states_changes_gamma_by_less_than_a_percent(rig):
    P, found = one_point(rig, bound=1e4)
    scale = lpv.balance([P]) * np.geomspace(0.7, 1.4, P.order)
    other = synthesise(Grid(np.zeros((1, 2)), (lpv.rescaled(P, scale),)), EXPONENTS[:1], bound=1e4)
    assert other.gamma == pytest.approx(found.gamma, rel=0.01)


def test_the_law_runs_at_5_khz_and_carries_its_gamma(rig):
    law = lpv.design(rig, SPEC)
    assert law.gamma >= law.about["optimal_gamma"]
    assert law.A.shape == (3, 3, 10, 10)
    slow = np.log(np.abs(np.linalg.eigvals(law.A)).min()) / law.Ts
    assert -slow < 10 / law.Ts


def test_a_solver_that_lies_is_caught_by_the_eigenvalues(rig, made):
    lie = made._replace(
        solution=replace(made.solution, X=made.solution.X * np.array([1.0, 3, 1, 1, 1, 1])[:, None, None])
    )
    with pytest.raises(DesignError, match="breaks its inequalities at"):
        lpv.validated(rig, SPEC, lie, (3, 3))


def test_an_impossible_gamma_is_refused(rig):
    with pytest.raises(DesignError, match=r"lpv: no (Y|X\(q\), Y) .*(keeps its inequality|keep)"):
        lpv.synthesis(rig, replace(SPEC, backoff=1.0001, margin=5.0))


def test_the_smallest_eigenvalue_is_the_largest_shift_that_keeps_a_matrix_positive():
    M = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.4], [0.0, -0.4, 3.0]])
    problem = Problem(1)
    problem.add(M, [(0, -np.eye(3)[None])])
    assert problem.minimise(np.array([-1.0]), "test")[0] == pytest.approx(np.linalg.eigvalsh(M)[0], abs=1e-4)

"""LPV synthesis: relations between gammas that hold for any model, on a small Model 1 rig (10 states)."""

from dataclasses import replace

import numpy as np
import pytest

import rotorsim as rs
from refusals import refused
from rotorsim.control import DesignError
from rotorsim.control.designs import lpv
from rotorsim.control.designs.hinf_synthesis import closed, mixed_sensitivity, solve
from rotorsim.control.designs.lpv import controller_at
from rotorsim.control.designs.lpv_problem import (
    Inequality,
    LmiProblem,
    Polynomial,
    Sought,
    SynthesisGrid,
    corners,
    derivatives,
    exponents,
    functions,
    minimise,
    synthesise,
)
from rotorsim.control.plants import design_plant
from rotorsim.control.systems import peak_gain

pytestmark = pytest.mark.numerical
SPEC = lpv.Spec(grid=(5, 5), table=(3, 3), validation=(5, 5))
CHANGES = ["grid=3x3", "table=2x2", "validation=3x3"]
STILL = Sought(order_X=0, order_Y=0)


@pytest.fixture(scope="module")
def rig(small):
    return small()


@pytest.fixture(scope="module")
def made(rig):
    return lpv.synthesis(rig, SPEC)


@pytest.fixture(scope="module")
def designed(rig):
    """The law of a whole design, and the steps that it named."""
    steps = []
    return rs.control.design("lpv", rig, CHANGES, progress=steps.append), steps


def test_a_design_names_its_steps_in_their_order(designed):
    _, steps = designed
    names = list(dict.fromkeys(step.partition(":")[0].partition(" at gamma")[0] for step in steps))
    assert names == [
        "smallest gamma",
        "most margin",
        "proof on the validation grid",
        "table",
        "stability over the range",
    ]


@pytest.mark.slow
def test_naming_its_steps_changes_no_bit_of_a_design(rig, designed):
    assert designed[0].hash == rs.control.design("lpv", rig, CHANGES).hash


def plants_of(rig, made, n):
    points = [(w, p) for w in lpv.made_axis(made, 0, n) for p in lpv.made_axis(made, 1, n)]
    return [(lpv.scaled(made.low, made.high, np.array(q)), lpv.scaled_plant(rig, SPEC, *q, made.scale)) for q in points]


def grid_of(rig, made):
    points, plants = zip(*plants_of(rig, made, 3), strict=True)
    return SynthesisGrid(np.array(points), plants, made.solution.rates)


def one_point(rig, scale=None, **settings):
    P = mixed_sensitivity(design_plant(rig, 314.0, 0.5e6), SPEC.weights)
    P = lpv.rescaled(P, lpv.balance([P]) if scale is None else scale)
    return P, synthesise(SynthesisGrid(np.zeros((1, 2)), (P,)), replace(STILL, **settings))


def test_on_one_point_gamma_is_that_of_h_infinity(rig):
    P, found = one_point(rig, bound=1e4)
    assert 1 - 1e-4 <= found.gamma / solve(P) <= 1.01


@pytest.mark.parametrize("n", [9, pytest.param(17, marks=pytest.mark.slow)])
def test_gamma_is_at_least_every_local_one_and_within_five_percent_of_their_largest(rig, made, n):
    local = max(solve(P) for _, P in plants_of(rig, made, 3 if n < 17 else 5))
    assert made.optimal >= local * (1 - 1e-4)
    assert lpv.validated(rig, SPEC, made, (n, n)) <= 1.05 * local


def test_the_frozen_norm_stays_below_gamma_also_between_the_design_points(rig, made):
    norms = [peak_gain(closed(P, controller_at(P, made.solution, q))) for q, P in plants_of(rig, made, 5)]
    assert max(norms) <= made.solution.gamma * 1.005


@pytest.mark.slow
def test_a_finer_grid_needs_hardly_more(rig, made):
    assert lpv.validated(rig, SPEC, made, (64, 64)) <= 1.005 * lpv.validated(rig, SPEC, made, (5, 5))


@pytest.mark.slow
def test_constant_matrices_need_at_least_as_much(rig, made):
    grid = grid_of(rig, made)
    moving, still_X, still_Y = (synthesise(grid, Sought(*orders)).gamma for orders in ((1, 2), (0, 2), (2, 0)))
    assert still_X >= moving * (1 - 2e-3)
    assert still_Y >= 1.02 * moving


@pytest.mark.slow
def test_faster_changes_need_at_least_as_much(rig, made):
    grid = grid_of(rig, made)
    gammas = [synthesise(replace(grid, rates=k * grid.rates), Sought(feedback_only=True)).gamma for k in (0, 1, 300)]
    assert gammas[0] <= gammas[1] * (1 + 1e-4)
    assert gammas[1] < 0.99 * gammas[2]


def test_a_constant_plant_has_a_constant_gamma(small):
    still = small(0.0)
    P, found = one_point(still)
    grid = SynthesisGrid(np.array([(-1.0, -1.0), (1.0, 0.5)]), (P, P), np.array([0.02, 0.01]))
    assert synthesise(grid, Sought(order_X=1, order_Y=1)).gamma == pytest.approx(found.gamma, rel=4e-3)


def test_another_scaling_of_the_states_changes_gamma_by_less_than_a_percent(rig):
    P, found = one_point(rig, bound=1e4)
    scale = lpv.balance([P]) * np.geomspace(0.7, 1.4, P.order)
    assert one_point(rig, scale, bound=1e4)[1].gamma == pytest.approx(found.gamma, rel=0.01)


def closed_loop_inequality(rig, made, point, rate):
    """dP/dt + the bounded real lemma of the loop as it is built; P and its rate from X, Y by definition."""
    solution, half = made.solution, (made.high - made.low) / 2
    speed, pressure = (made.low + made.high) / 2 + half * point
    P = lpv.scaled_plant(rig, SPEC, speed, pressure, made.scale)
    loop = closed(P, controller_at(P, solution, point))

    def lyapunov(q):
        X, Y = solution.X.at(q), solution.Y.at(q)
        N, M = -X, (Y - np.linalg.inv(X)).T  # X Y + N M' = I
        eye, zero = np.eye(len(X)), np.zeros_like(X)
        return np.linalg.solve(np.block([[Y, eye], [M.T, zero]]).T, np.block([[eye, X], [zero, N.T]]).T).T

    P0, step = lyapunov(point), 1e-2
    dP = (lyapunov(point + step * rate) - lyapunov(point - step * rate)) / (2 * step)
    g, (m, k) = solution.gamma, (loop.B.shape[1], len(loop.C))
    corner = dP + loop.A.T @ P0 + P0 @ loop.A
    rows = [corner, P0 @ loop.B, loop.C.T], [loop.B.T @ P0, -g * np.eye(m), loop.D.T], [loop.C, loop.D, -g * np.eye(k)]
    return P0, np.block([list(row) for row in rows])


def test_the_loop_as_it_is_built_keeps_gamma_while_q_moves_at_all_corners_of_the_rates(rig, made):
    for point in (np.array([-1.0, 0.0]), np.array([0.3, -0.7]), np.array([1.0, 1.0])):
        for rate in made.solution.corners:
            P, whole = closed_loop_inequality(rig, made, point, rate)
            size = np.sqrt(np.abs(np.diag(whole)))
            assert np.linalg.eigvalsh((P + P.T) / 2)[0] > 0
            assert np.linalg.eigvalsh((whole + whole.T) / 2 / size / size[:, None])[-1] < 0


def test_the_rate_of_a_polynomial_is_its_difference_quotient():
    powers, point, rate = exponents(2), np.array([0.3, -0.6]), np.array([0.5, 2.0])
    ahead, behind = (functions(powers, point + step * rate) for step in (1e-5, -1e-5))
    assert powers == ((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))
    assert derivatives(powers, point, rate) == pytest.approx((ahead - behind) / 2e-5, abs=1e-9)
    assert exponents(2, (True, False)) == ((0, 0), (1, 0), (2, 0))
    assert corners(np.array([0.1, 0.0])).tolist() == [[-0.1, 0.0], [0.1, 0.0]]


def test_the_law_runs_at_5_khz_and_carries_its_gamma(designed):
    law, _ = designed
    assert law.gamma >= law.about["optimal_gamma"]
    assert law.A.shape == (2, 2, 10, 10)
    slow = np.log(np.abs(np.linalg.eigvals(law.A)).min()) / law.Ts
    assert -slow < 10 / law.Ts


@pytest.mark.parametrize("name", ["X", "Y"])
def test_a_solver_that_lies_is_caught_by_the_eigenvalues(rig, made, name):
    true = getattr(made.solution, name)
    false = Polynomial(
        true.powers, true.coefficients * np.array([1.0, 3, *[1.0] * (len(true.powers) - 2)])[:, None, None]
    )
    lie = made._replace(solution=replace(made.solution, **{name: false}))
    with pytest.raises(DesignError, match="breaks its inequalities at"):
        lpv.validated(rig, SPEC, lie, (3, 3))


def test_rates_a_thousand_times_as_fast_break_the_proof(rig, made):
    fast = made._replace(solution=replace(made.solution, rates=1000 * made.solution.rates))
    with pytest.raises(DesignError, match=r"breaks its inequalities at .*lower rates"):
        lpv.validated(rig, SPEC, fast, (3, 3))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"speed_rate": 0.0}, r"lpv\.speed_rate: .* must be above 0"),
        ({"pressure_rate": -2e6}, r"lpv\.pressure_rate: .* must be above 0"),
        ({"grid": (1, 1)}, r"lpv\.grid: .* at least 2"),
        ({"order_Y": -1}, r"lpv\.order_Y: .* at least 0"),
    ],
)
def test_a_bad_specification_is_refused(change, word):
    with pytest.raises(DesignError, match=word):
        replace(SPEC, **change)


def test_too_few_grid_points_for_the_order_are_refused(rig):
    with refused(DesignError, "grid", 2):
        lpv.synthesis(rig, replace(SPEC, grid=(2, 3)))


def test_a_model_of_one_operating_point_is_refused(rig):
    single = replace(rig, points=rig.points[:1])
    with refused(DesignError, "model"):
        lpv.synthesis(single, SPEC)


def test_cutting_planes_find_the_optimum_of_all_inequalities():
    """The largest t with M_k >= t I for twenty matrices is the smallest of their eigenvalues."""
    rng = np.random.default_rng(1)
    matrices = [M + M.T for M in rng.normal(size=(20, 3, 3))]
    every = [Inequality("M", k, M, [(0, -1.0, np.eye(3)[None])], 0.0) for k, M in enumerate(matrices)]
    found = minimise(np.array([-1.0]), every, [0], "test", 0.0, 1e-6)[0]
    assert found == pytest.approx(min(np.linalg.eigvalsh(M)[0] for M in matrices), abs=1e-4)


def test_the_smallest_eigenvalue_is_the_largest_shift_that_keeps_a_matrix_positive():
    M = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.4], [0.0, -0.4, 3.0]])
    problem = LmiProblem(1)
    problem.add(M, [(0, -np.eye(3)[None])])
    assert problem.minimise(np.array([-1.0]), "test")[0] == pytest.approx(np.linalg.eigvalsh(M)[0], abs=1e-4)

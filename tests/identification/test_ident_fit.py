"""Grey-box and black-box fits on data from known models: Jacobians, parameter errors, Monte Carlo."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import expm

import identification as idn
from identification.local.blackbox import FullStateSpace
from identification.local.fits import subspace_fit
from identification.local.greybox import STRUCTURES, actuator_poles, modes
from identification.local.identify import fit_signals
from identification.local.least_squares import FitProblem, GreyBox, Predictor
from identification.local.simulation import exponential, sampled
from model3 import TRUTH, TS, model, prbs, record

pytestmark = pytest.mark.numerical

ACTUATOR = np.array([1.5e7, 1.0e4, 2.0e7, 1.2e7, 8.0e3, 1.0e7])
THETAS = {
    "1": TRUTH[:12],
    "rotor": np.r_[TRUTH[:12], 5e3, 6e3],
    "2": np.r_[TRUTH[:12], 5e3, 6e3, ACTUATOR],
    "rotor-rate": np.r_[TRUTH[:12], 5e3, 6e3, 2e-4, -3e-5, 4e-5, 1e-4],
    "3": TRUTH,
    "3-delay": np.r_[TRUTH, 4e3, 2.5e3],
    "actuator": ACTUATOR,
}


def worst_slope(problem, theta, x0):
    """Largest difference of Jacobian and central differences, relative to the column's largest entry.

    The output is linear in the state, whose step is therefore so large that it moves the output by its own size: small
    steps of states in volts drown in the rounding of outputs in micrometres.
    """
    e, J = problem.residual(theta, x0)
    full, q, worst = np.r_[theta, x0], len(theta), 0.0
    for i, value in enumerate(full):
        step, slope = 2e-4 * abs(value), 0.0
        if i >= q:
            step = np.abs(e).max() / np.abs(J[..., i]).max()
        for move, weight in ((-2, 1), (-1, -8), (1, 8), (2, -1)):  # central, fourth order
            moved = full.copy()
            moved[i] += move * step
            slope = slope - weight * problem.residual(moved[:q], moved[q:])[0] / (12 * step)
        worst = max(worst, np.abs(slope - J[..., i]).max() / max(np.abs(J[..., i]).max(), 1e-300))
    return worst


@pytest.mark.parametrize("hold", ["zero", "first"])
@pytest.mark.parametrize("kind", list(THETAS))
def test_sensitivities_agree_with_central_differences_to_1e_6(kind, hold):
    rng = np.random.default_rng(1)
    w = rng.normal(size=(300, 4 if hold == "first" else 2))
    Q = np.linalg.qr(np.column_stack([np.ones(300), rng.normal(size=(300, 2))]))[0]
    problem = FitProblem(GreyBox(STRUCTURES[kind], TS, hold), w, 1e-6 * rng.normal(size=(300, 2)), Q)
    states = problem.states(THETAS[kind])
    assert worst_slope(problem, THETAS[kind], 1e-6 * rng.normal(size=states)) < 1e-6


def test_sensitivities_of_the_predictor_agree_with_central_differences():
    rng = np.random.default_rng(2)
    problem = FitProblem(
        Predictor(GreyBox(STRUCTURES["1"], TS), 4, 2),
        np.hstack([rng.normal(size=(300, 2)), 1e-6 * rng.normal(size=(300, 2))]),
        1e-6 * rng.normal(size=(300, 2)),
        np.full((300, 1), 300**-0.5),
    )
    theta = np.r_[TRUTH[:12], 0.01, 0.002, -0.003, 0.02, 1.0, 0.5, -0.3, 2.0]
    assert worst_slope(problem, theta, np.array([1e-6, -1e-6, 1e-3, 1e-3])) < 1e-6


def test_sensitivities_of_a_full_state_space_agree_with_central_differences():
    rng = np.random.default_rng(3)
    full = FullStateSpace(3, 2, 2)
    A = np.diag([0.9, 0.8, 0.7]) + 0.05 * rng.normal(size=(3, 3))
    theta = full.pack(A, rng.normal(size=(3, 2)), rng.normal(size=(2, 3)))
    problem = FitProblem(full, rng.normal(size=(200, 2)), rng.normal(size=(200, 2)), np.full((200, 1), 200**-0.5))
    assert worst_slope(problem, theta, rng.normal(size=3)) < 1e-6


def test_the_directions_of_a_full_state_space_leave_out_changes_of_basis_only():
    rng = np.random.default_rng(5)
    n, m, p = 4, 2, 2
    full = FullStateSpace(n, m, p)
    A = np.diag([0.9, 0.8, 0.7, 0.5]) + 0.05 * rng.normal(size=(n, n))
    B, C = rng.normal(size=(n, m)), rng.normal(size=(p, n))
    kept = full.directions(full.pack(A, B, C))
    assert kept.shape == (n * (n + m + p), n * (m + p))
    np.testing.assert_allclose(kept.T @ kept, np.eye(n * (m + p)), atol=1e-12)
    for E in 1e-6 * rng.normal(size=(5, n, n)):  # T = I + E: A' = T^-1 A T, B' = T^-1 B, C' = C T
        turn = full.pack(A @ E - E @ A, -E @ B, C @ E)
        assert np.linalg.norm(kept.T @ turn) < 1e-12 * np.linalg.norm(turn)
    markov = [C @ np.linalg.matrix_power(A, k) @ B for k in range(2 * n)]
    step = 1e-6
    for direction in kept.T:  # every other direction changes the response
        F, G, H, _ = full.sampled(full.pack(A, B, C) + step * direction)
        moved = [H @ np.linalg.matrix_power(F, k) @ G for k in range(2 * n)]
        assert np.linalg.norm(np.array(moved) - np.array(markov)) > 1e-3 * step


def test_the_normal_equations_of_the_kernel_are_those_of_the_jacobian():
    rng = np.random.default_rng(4)
    Q = np.linalg.qr(rng.normal(size=(400, 5)))[0]
    problem = FitProblem(GreyBox(STRUCTURES["3"], TS), rng.normal(size=(400, 2)), 1e-6 * rng.normal(size=(400, 2)), Q)
    x0 = 1e-6 * rng.normal(size=6)
    r, J = problem.residual(TRUTH, x0)
    N, g, cost = problem.normal_equations(TRUTH, x0)
    flat = J.reshape(-1, J.shape[2])
    np.testing.assert_allclose(N, flat.T @ flat, rtol=1e-9, atol=1e-12 * np.abs(N).max())
    np.testing.assert_allclose(g, flat.T @ r.ravel(), rtol=1e-8)
    assert cost == pytest.approx(np.sum(r**2), rel=1e-10)


def test_the_exponential_is_scipys_and_a_straight_input_is_exact_for_a_ramp():
    A, _, _, _ = STRUCTURES["3"].matrices(TRUTH)
    np.testing.assert_allclose(exponential(A * TS, np.zeros((0, 6, 6)))[0], expm(A * TS), rtol=1e-9, atol=1e-12)
    # of x' = -a x + u with u = t the response is t/a - (1 - exp(-a t))/a^2
    a, n = 3.0, 5
    FG = sampled(np.array([[-a]]), np.array([[1.0]]), 0.1, "first")
    x = 0.0
    for k in range(n):
        x = FG[0, 0] * x + FG[0, 1] * 0.1 * k + FG[0, 2] * 0.1 * (k + 1)
    t = 0.1 * n
    assert x == pytest.approx(t / a - (1 - np.exp(-a * t)) / a**2, rel=1e-12)


@lru_cache(maxsize=8)
def fitted(seed):
    return idn.identify(record(seed))


def errors_of(found):
    wn, zeta = modes(TRUTH)
    z = np.array([(v - t) / sd for (v, sd), t in zip(found.parameters.values(), TRUTH, strict=True)])
    return np.abs(found.wn / wn - 1).max(), np.abs(found.zeta / zeta - 1).max(), z


@pytest.mark.parametrize("seed", [0, 1])
def test_model_3_finds_the_model_that_made_the_data(seed):
    found = fitted(seed)
    frequency, damping, z = errors_of(found)
    assert found.converged
    assert frequency < 1e-3
    assert damping < 0.03
    assert np.mean(np.abs(z) < 3) > 0.9
    assert np.all(np.abs(found.fit - found.ceiling) < 0.005)
    assert found.residuals.white
    assert found.residuals.independent


@pytest.mark.parametrize("count", [3, pytest.param(200, marks=pytest.mark.slow)])
def test_in_many_records_the_truth_lies_within_three_standard_deviations(count):
    frequencies, dampings, inside = [], [], []
    for seed in range(count):
        frequency, damping, z = errors_of(fitted(seed))
        frequencies.append(frequency)
        dampings.append(damping)
        inside.append(np.abs(z) < 3)
    assert max(frequencies) < 1e-3
    assert max(dampings) < 0.03
    assert np.mean(inside) >= 0.95


@pytest.mark.parametrize(
    ("frequency", "damping", "gain"),
    [(0.7, 3.0, 2.0)]
    + [pytest.param(*far, marks=pytest.mark.slow) for far in ((1.3, 3.0, 2.0), (0.7, 1 / 3, 0.5), (1.3, 1 / 3, 0.5))],
)
def test_a_start_far_off_leads_to_the_same_model(frequency, damping, gain):
    data = record(5, seconds=4.0)
    start = TRUTH.copy()
    start[:4] *= frequency**2
    start[4:8] *= frequency * damping
    start[8:12] *= frequency**2 * gain
    near, far = idn.identify(data), idn.identify(data, start=start)
    np.testing.assert_allclose(far.wn, near.wn, rtol=1e-6)
    np.testing.assert_allclose(far.zeta, near.zeta, rtol=1e-4)


@pytest.mark.slow
def test_prediction_error_agrees_with_output_error_where_the_noise_is_white():
    data = record(3, seconds=5.0)
    oe, pem = idn.identify(data), idn.identify(data, method="pem")
    np.testing.assert_allclose(pem.wn, oe.wn, rtol=1e-3)
    np.testing.assert_allclose(pem.zeta, oe.zeta, rtol=0.03)


def test_the_actuator_model_finds_poles_and_gains():
    gains, poles = np.array([1.863, 1.865]) * 4.5e-6, np.array([[3078.0, 8143.0], [2452.0, 6494.0]])
    theta = np.array([v for g, (a, b) in zip(gains, poles, strict=True) for v in (a * b, a + b, g * a * b)])
    u = prbs(np.random.default_rng(0), 15000)
    v = model(theta, "actuator").simulate(u, TS)
    pins = 22.5e-6 + np.column_stack([v[:, 1], v[:, 0], -v[:, 1], -v[:, 0]]) / 2
    found = idn.identify(record(u=u, seconds=3.0, pin=pins), "actuator")
    np.testing.assert_allclose(actuator_poles(found.theta), poles, rtol=1e-4)
    np.testing.assert_allclose(np.diag(found.static_gain), gains, rtol=1e-6)


def test_a_black_box_of_order_6_has_the_frequency_response_of_the_truth():
    found = idn.identify(record(7), "blackbox", 6)
    omega = np.linspace(100, 1500, 30)
    wanted = model().discrete(TS).transfer(omega)
    assert np.linalg.norm(found.model.transfer(omega) - wanted) < 0.01 * np.linalg.norm(wanted)
    np.testing.assert_allclose(found.wn[:2], modes(TRUTH)[0], rtol=2e-3)


def test_a_black_box_of_more_states_than_the_truth_stops_where_steps_promise_less_than_noise():
    data = record(7)
    large, true = idn.identify(data, "blackbox", 10), idn.identify(data, "blackbox", 6)
    assert large.converged and large.iterations <= 25
    assert np.all(large.fit > true.fit - 2e-4)


def test_the_fit_of_the_subspace_method_is_close_to_that_of_the_refined_black_box():
    data = record(9, seconds=4.0)
    quick, refined = subspace_fit(fit_signals(data), 8), idn.identify(data, "blackbox", 8)
    assert np.all(np.abs(quick - refined.fit) < 5e-3)
    assert np.all(quick > idn.identify(data, 1).fit + 0.01)  # Model 1 has no lag


def test_the_frequency_response_estimate_comes_close_to_the_truth_where_it_is_coherent():
    data = record(8)
    found = idn.frequency_response(data.reference.values, data.disc_measured.values, TS)
    band = (found.omega > 300) & (found.omega < 1000)
    wanted = model().discrete(TS).transfer(found.omega[band])
    assert found.coherence[band].min() > 0.9
    assert np.linalg.norm(found.G[band] - wanted) < 0.08 * np.linalg.norm(wanted)


def test_what_a_model_misses_shows_in_the_correlation_of_its_residuals_with_the_inputs():
    data = record(9, seconds=4.0)
    whole, rough = idn.identify(data, 3), idn.identify(data, 1)
    assert whole.residuals.independent and not rough.residuals.independent  # knows no lag
    assert all(one.residuals.verdict in one.report() for one in (whole, rough))
    assert whole.residuals.verdict != rough.residuals.verdict

"""Structures of one's own: derivatives, fits with bounds, parameters that cannot be shown apart, bad input, files."""

from dataclasses import replace

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import STRUCTURES
from identification.local.least_squares import FitProblem, GreyBox, damped_step
from model3 import TRUTH, TS, prbs, record
from rotorsim.base.errors import ModelError, UnfitError

pytestmark = pytest.mark.numerical

NAMES = ("stiffness", "cross", "damping", "whirl", "gain", "lag")
VALUES = np.array([5e5, 2e4, 100.0, 7.0, 1.6, 900.0])
START = (3e5, 1e3, 200.0, 1.0, 1.0, 600.0)


def isotropic(theta):
    k, q, d, g, b, p = theta
    eye, turn = np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]])
    A, B = np.zeros((6, 6)), np.zeros((6, 2))
    A[:2, 2:4], A[2:4, :2], A[2:4, 2:4] = eye, -k * eye - q * turn, -d * eye - g * turn
    A[2:4, 4:], A[4:, 4:], B[4:] = b * eye, -p * eye, p * eye
    return A, B, np.eye(2, 6), np.zeros((2, 2))


ISOTROPIC = idn.Structure(
    "isotropic", NAMES, isotropic, START, units=("1/s^2", "1/s^2", "1/s", "1/s", "m/(s^2 V)", "rad/s")
)


def measured(seed=0, seconds=4.0, theta=VALUES, u=None):
    rng, n = np.random.default_rng(seed), round(seconds / TS)
    u = prbs(rng, n) if u is None else u
    y = idn.LinearModel(*isotropic(theta)).simulate(u, TS)
    return idn.from_arrays(np.arange(n) * TS, u, y + 0.5e-6 * rng.normal(size=y.shape), speed=0.0, pressure=3e5)


@pytest.fixture(scope="module")
def data():
    return measured()


def rooted(theta):
    """A structure that is far from affine: modes by frequency and damping, gain by its logarithm, an output gain."""
    w, zeta, gain, out = theta
    A = np.kron(np.array([[0.0, 1.0], [-(w**2), -2 * zeta * w]]), np.eye(2))
    B = np.vstack([np.zeros((2, 2)), np.exp(gain) * w**2 * np.eye(2)])
    return A, B, np.sqrt(out) * np.eye(2, 4), out**2 * 1e-9 * np.eye(2)


def rooted_slopes(theta):
    w, zeta, gain, out = theta
    none, B = np.zeros((2, 2)), np.exp(gain) * w * np.eye(2)
    dA = [np.kron(np.array([[0, 0], row]), np.eye(2)) for row in ([-2 * w, -2 * zeta], [0, -2 * w], [0, 0], [0, 0])]
    dB = [np.vstack([none, part]) for part in (2 * B, none, w * B, none)]
    dC = [np.zeros((2, 4))] * 3 + [0.5 / np.sqrt(out) * np.eye(2, 4)]
    return np.array(dA), np.array(dB), np.array(dC), np.array([none] * 3 + [2e-9 * out * np.eye(2)])


@pytest.mark.parametrize(
    ("at", "bounds"),
    [(0.05, ()), (0.0, ((1, 1e4), (0.0, 1.0), (-20, 0), (0, 9))), (1.0, ((1, 1e4), (0.0, 1.0), (-20, 0), (0, 9)))],
)
def test_derivatives_of_any_function_are_those_by_hand_also_at_a_bound_that_it_must_not_pass(at, bounds):
    def within(theta):
        assert 0 <= theta[1] <= 1 or not bounds
        return rooted(theta)

    theta = np.array([700.0, at, -13.0, 1.3])
    structure = idn.Structure("rooted", ("w", "zeta", "gain", "out"), within, bounds=bounds)
    for found, wanted in zip(structure.derivatives(theta), rooted_slopes(theta), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-8 * np.abs(wanted).max() + 1e-300)


@pytest.mark.parametrize("kind", ["1", "3", "2"])
def test_differences_within_five_values_are_the_exact_derivatives_of_the_thesis_models(kind):
    theta = np.r_[TRUTH[:12], 5e3, 6e3, 1.5e7, 1e4, 2e7, 1.2e7, 8e3, 1e7][: len(STRUCTURES[kind].parameters)]
    exact = STRUCTURES[kind].derivatives(theta)
    for found, wanted in zip(replace(STRUCTURES[kind], affine=False).derivatives(theta), exact, strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-9 * max(np.abs(wanted).max(), 1e-300))


def test_sensitivities_of_outputs_and_feedthrough_that_depend_on_parameters_agree_with_differences():
    rng = np.random.default_rng(1)
    structure = idn.Structure("rooted", ("w", "zeta", "gain", "out"), rooted)
    problem = FitProblem(
        GreyBox(structure, TS), rng.normal(size=(300, 2)), np.zeros((300, 2)), np.full((300, 1), 300**-0.5)
    )
    theta, x0 = np.array([700.0, 0.05, -13.0, 1.3]), np.zeros(4)
    J = problem.residual(theta, x0)[1]
    for i in range(4):
        step = 1e-5 * abs(theta[i])
        ends = [problem.residual(theta + sign * step * np.eye(4)[i], x0)[0] for sign in (1, -1)]
        np.testing.assert_allclose((ends[1] - ends[0]) / (2 * step), J[..., i], atol=1e-6 * np.abs(J[..., i]).max())


@pytest.mark.parametrize("method", ["oe", "pem"])
def test_a_structure_of_ones_own_finds_the_parameters_that_made_the_data(data, method):
    found = idn.identify(data, ISOTROPIC, method=method)
    assert found.converged and found.kind == "isotropic"
    z = [(value - true) / sd for (value, sd), true in zip(found.parameters.values(), VALUES, strict=True)]
    assert np.abs(z).max() < 4
    wanted = idn.LinearModel(*isotropic(VALUES))
    np.testing.assert_allclose(found.wn, wanted.wn, rtol=1e-3)
    np.testing.assert_allclose(found.zeta, wanted.zeta, rtol=0.03)
    np.testing.assert_allclose(found.static_gain, wanted.static_gain, atol=0.01 * np.abs(wanted.static_gain).max())
    assert np.all(np.abs(found.fit - found.ceiling) < 0.01)


@pytest.mark.slow
def test_in_many_records_the_truth_lies_within_the_stated_intervals():
    inside = []
    for seed in range(40):
        found = idn.identify(measured(seed), ISOTROPIC)
        sd = np.sqrt(np.diag(found.covariance))
        inside.append(np.abs(found.theta - VALUES) < 1.645 * sd)
    assert 0.80 <= np.mean(inside) <= 0.97


def test_model_3_written_by_hand_gives_what_model_3_of_the_package_gives():
    data, own = record(0, seconds=4.0), STRUCTURES["3"]
    built_in = idn.identify(data, 3)
    found = idn.identify(
        data, idn.Structure("mine", own.parameters, own.matrices, tuple(TRUTH * 1.2), positive=("p_x", "p_y"))
    )
    np.testing.assert_allclose(found.theta, built_in.theta, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(found.covariance, built_in.covariance, rtol=1e-3, atol=1e-3 * built_in.covariance.max())


@pytest.mark.parametrize(
    ("frequency", "damping"),
    [(0.7, 1 / 3), *(pytest.param(*far, marks=pytest.mark.slow) for far in ((1.3, 3.0), (1.5, 1.0)))],
)
def test_a_start_far_off_leads_to_the_same_parameters(data, frequency, damping):
    scale = np.array([frequency**2, frequency**2, frequency * damping, frequency * damping, frequency**2, 1.0])
    found = idn.identify(data, ISOTROPIC, start=VALUES * scale)
    np.testing.assert_allclose(found.theta, idn.identify(data, ISOTROPIC).theta, rtol=1e-4)


def test_a_bound_is_kept_reported_and_the_others_are_the_best_beside_it(data):
    bounds = ((1e5, 1e6), (-1e6, 1e6), (120.0, 1e3), (-50, 50), (0, 10), (100, 5000))
    found = idn.identify(data, replace(ISOTROPIC, bounds=bounds))
    assert found.parameters["damping"][0] == 120 and np.isnan(found.parameters["damping"][1])
    assert any("damping ended at its lower bound 120" in text for text in found.warnings)
    assert "at its bound 1/s" in found.report()
    held = idn.Structure(
        "held",
        tuple(n for n in NAMES if n != "damping"),
        lambda t: isotropic(np.insert(t, 2, 120.0)),
        tuple(np.delete(START, 2)),
    )
    best = idn.identify(data, held, start=np.delete(VALUES, 2))
    np.testing.assert_allclose(np.delete(found.theta, 2), best.theta, rtol=1e-4)
    sd, wanted = (np.sqrt(np.diag(one.covariance)) for one in (found, best))
    np.testing.assert_allclose(np.delete(sd, 2), wanted, rtol=0.02)


def test_bounds_that_do_not_bind_change_nothing(data):
    wide = replace(ISOTROPIC, bounds=tuple((value / 100, value * 100) for value in VALUES))
    np.testing.assert_allclose(idn.identify(data, wide).theta, idn.identify(data, ISOTROPIC).theta, rtol=1e-4)


def test_a_step_within_bounds_is_the_least_squares_step_among_those_allowed():
    rng = np.random.default_rng(0)
    for _ in range(50):
        J, s = rng.normal(size=(20, 4)), rng.normal(size=4)
        low, high = -rng.uniform(0, 0.1, 4), rng.uniform(0, 0.1, 4)
        N = J.T @ J
        step, _ = damped_step(N, s, 1e-3, (low, high))
        assert np.all((step >= low - 1e-15) & (step <= high + 1e-15))
        damped = N + 1e-3 * np.diag(np.diag(N))
        free = (step > low + 1e-12) & (step < high - 1e-12)
        assert np.abs((s - damped @ step)[free]).max(initial=0) < 1e-12


def test_parameters_that_act_only_together_are_named_group_by_group(data):
    def double(theta):
        k, q, d1, d2, g, m, b, p = theta
        return isotropic((k, q, d1 + d2, g, m * b, p))

    names = ("stiffness", "cross", "d1", "d2", "whirl", "m", "b", "lag")
    structure = idn.Structure("double", names, double, (3e5, 1e3, 100, 100, 1, 1, 1, 600))
    with pytest.raises(UnfitError, match=r"d1 and d2.*m and b") as error:
        idn.identify(data, structure)
    assert "stiffness" not in str(error.value) and "lag" not in str(error.value)


def test_a_parameter_without_effect_is_named(data):
    structure = idn.Structure("idle", (*NAMES, "spare"), lambda t: isotropic(t[:6]), (*START, 1.0))
    with pytest.raises(UnfitError, match="spare"):
        idn.identify(data, structure)


def test_what_a_record_without_motion_in_one_direction_cannot_show_is_named():
    def separate(theta):
        kx, ky, dx, dy, b, p = theta
        A, B, C, D = isotropic((0, 0, 0, 0, b, p))
        A[2:4, :2], A[2:4, 2:4] = -np.diag([kx, ky]), -np.diag([dx, dy])
        B[4:] = p * np.array([[1, 0.5], [0, 0]])
        return A, B, C, D

    structure = idn.Structure("separate", ("kx", "ky", "dx", "dy", "b", "p"), separate, (3e5, 3e5, 200, 200, 1, 600))
    with pytest.raises(UnfitError, match=r"ky.*dy|dy.*ky"):
        idn.identify(measured(), structure)


BAD = {
    "A is not square": (lambda t: (np.zeros((6, 5)), *isotropic(t)[1:]), "A has the shape"),
    "B of one input": (lambda t: (isotropic(t)[0], np.zeros((6, 1)), *isotropic(t)[2:]), "B has the shape"),
    "C of one output": (lambda t: (*isotropic(t)[:2], np.zeros((1, 6)), np.zeros((2, 2))), "C has the shape"),
    "D missing": (lambda t: isotropic(t)[:3], "bad.*matrices"),
    "nothing": (lambda t: None, "bad.*matrices"),
    "complex": (lambda t: (isotropic(t)[0] + 0j, *isotropic(t)[1:]), "bad.*complex"),
    "NaN": (lambda t: (isotropic(t)[0] * np.nan, *isotropic(t)[1:]), "A has NaN"),
    "an error": (lambda t: isotropic(t[:5]), "ValueError.*stiffness = 300000"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_four_matrices_is_refused_in_a_sentence(data, case):
    function, sentence = BAD[case]
    with pytest.raises(ModelError, match=sentence):
        idn.identify(data, idn.Structure("bad", NAMES, function, START))


@pytest.mark.parametrize(
    ("change", "start", "sentence"),
    [
        ({}, START[:5], "5 values"),
        ({}, ("stiff", *START[1:]), "start: .*stiff"),
        ({}, (np.nan, *START[1:]), "stiffness = nan"),
        ({"bounds": ((4e5, 6e5), *[(-1e9, 1e9)] * 5)}, None, "stiffness = 300000 .* 400000 to 600000"),
        ({}, (3e5, 1e3, -200.0, 1, 1, 600), "start.*unstable"),
        ({"start": ()}, None, "start"),
        ({"positive": ("lag",)}, (*START[:5], 0.0), "start: lag"),
        ({"name": "3"}, None, "'3'"),
    ],
)
def test_an_unfit_start_is_refused_in_a_sentence(data, change, start, sentence):
    with pytest.raises(UnfitError, match=sentence):
        idn.identify(data, replace(ISOTROPIC, **change), start=start)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"parameters": ("a", "a", "b", "c", "d", "e")}, "parameters: a, a"),
        ({"parameters": ()}, "a name"),
        ({"start": (1.0,)}, "1 for 6"),
        ({"bounds": ((0, 1),)}, "1 for 6"),
        ({"bounds": ((1, 0), *[(-1, 1)] * 5)}, "bounds"),
        ({"bounds": ((0, np.nan), *[(-1, 1)] * 5)}, "bounds"),
        ({"bounds": (3, *[(-1, 1)] * 5)}, "pair"),
        ({"bounds": (("0", "1"), *[(-1, 1)] * 5)}, "pair"),
        ({"units": ("m",)}, "1 for 6"),
        ({"positive": ("mass",)}, "positive: mass"),
    ],
)
def test_a_description_that_does_not_fit_together_is_refused(change, sentence):
    with pytest.raises(ModelError, match=sentence):
        replace(ISOTROPIC, **change)


def test_a_function_that_fails_on_the_way_is_named_with_its_parameters(data):
    def fragile(theta):
        if theta[0] > 4e5:
            raise ZeroDivisionError("no stiffness like that")
        return isotropic(theta)

    with pytest.raises(ModelError, match="ZeroDivisionError: no stiffness like that, at stiffness = "):
        idn.identify(data, replace(ISOTROPIC, matrices=fragile))


def test_a_function_that_writes_into_its_argument_or_gives_nan_on_the_way_does_no_harm(data):
    def careless(theta):
        found = isotropic(theta.copy())
        if theta[2] < 0:
            found = (found[0] * np.nan, *found[1:])
        theta[:] = 0
        return found

    found = idn.identify(data, replace(ISOTROPIC, matrices=careless))
    np.testing.assert_allclose(found.theta, idn.identify(data, ISOTROPIC).theta, rtol=1e-6)


def test_the_model_of_a_structure_is_saved_and_read_and_its_report_has_units(data, tmp_path):
    found = idn.identify(data, ISOTROPIC)
    found.model.save(tmp_path / "own.json")
    again = idn.load_model(tmp_path / "own.json")
    np.testing.assert_array_equal(again.A, found.model.A)
    assert again.pressure == 3e5
    report = found.report()
    assert "isotropic, order 6" in report and "m/(s^2 V)" in report and "mode 2" in report


def test_surfaces_through_structures_of_ones_own_are_refused(data):
    found = idn.identify(data, ISOTROPIC)
    with pytest.raises(UnfitError, match="isotropic"):
        idn.fit_lpv([found, replace(found, speed=100.0), replace(found, speed=200.0)], order=1)


def test_an_unknown_model_is_refused_with_those_there_are(data):
    with pytest.raises(UnfitError, match="1, 2, 2-rate, 3"):
        idn.identify(data, "isotropic")

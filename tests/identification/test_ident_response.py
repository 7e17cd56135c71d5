"""Fits to frequency responses: derivatives, intervals, agreement with output error, periodic excitation, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import csd, lfilter, welch

import identification as idn
import rotorsim as rs
from identification.local.greybox import STRUCTURES, modes
from identification.local.response_fit import response_problem
from model3 import TRUTH, TS, model, record
from refusals import refused
from rotorsim.base.errors import UnfitError

pytestmark = pytest.mark.numerical

OMEGA = 2 * np.pi * np.linspace(5, 400, 150)


def noisy(seed, Ts=0.0, share=0.02):
    """Response of Model 3 with white errors of known size."""
    G = (model().discrete(Ts) if Ts else model()).transfer(OMEGA)
    sd = np.full(G.shape, share * np.abs(G).max())
    rng = np.random.default_rng(seed)
    error = (rng.normal(size=G.shape) + 1j * rng.normal(size=G.shape)) / np.sqrt(2)
    return idn.measured_response(OMEGA, G + sd * error, sd, Ts)


def estimate(data):
    return idn.frequency_response(data.reference.values, data.disc_measured.values, TS)


def test_samples_that_are_not_finite_are_gaps_of_a_frequency_response():
    data = record(0)
    u, y = data.reference.values, data.disc_measured.values.copy()
    parts, middle = [slice(0, 6000), slice(6003, len(u))], 6000
    wanted = idn.frequency_response(u, y, TS, parts=parts)
    y[middle : middle + 3, 1] = np.nan, np.inf, np.nan
    for known in ((), [slice(0, len(u))]):
        found = idn.frequency_response(u, y, TS, parts=known)
        np.testing.assert_array_equal(found.G, wanted.G)
        assert found.segments == wanted.segments


def test_unfit_samples_of_a_frequency_response_are_refused():
    u, y = np.ones((100, 2)), np.ones((100, 2))
    with pytest.raises(UnfitError, match="frequency_response: 0 samples"):
        idn.frequency_response(u, np.nan * y, TS)
    with pytest.raises(UnfitError, match="10 samples"):
        idn.frequency_response(u[:10], y[:10], TS)
    for one, other in ((u[:, 0], y), (u, y[:5])):
        with pytest.raises(UnfitError, match="frequency_response: u"):
            idn.frequency_response(one, other, TS)
    with pytest.raises(UnfitError, match="periodic_response"):
        idn.periodic_response(u, np.nan * y, TS, 10 * TS)


@pytest.mark.parametrize("Ts", [0.0, TS])
def test_derivatives_of_the_response_agree_with_central_differences(Ts):
    problem = response_problem(STRUCTURES["3"], noisy(0, Ts))
    G, dG = problem.response(TRUTH)
    np.testing.assert_allclose(G, (model().discrete(Ts) if Ts else model()).transfer(OMEGA), rtol=1e-9)
    for i, value in enumerate(TRUTH):
        step = 1e-5 * abs(value) * np.eye(len(TRUTH))[i]
        slope = (problem.response(TRUTH + step)[0] - problem.response(TRUTH - step)[0]) / (2 * step[i])
        np.testing.assert_allclose(dG[..., i], slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize("Ts", [0.0, TS])
def test_a_response_without_noise_gives_back_its_parameters(Ts):
    G = (model().discrete(Ts) if Ts else model()).transfer(OMEGA)
    found = idn.fit_frequency_response(idn.measured_response(OMEGA, G, Ts=Ts), 3)
    np.testing.assert_allclose(found.theta, TRUTH, rtol=1e-6)
    assert np.all(np.isnan(found.misfit)) and found.fit.min() > 0.999999


@pytest.mark.parametrize("Ts", [pytest.param(0.0, marks=pytest.mark.slow), TS])
def test_stated_intervals_of_a_noisy_response_hold_the_parameters(Ts):
    z = []
    for seed in range(12):
        found = idn.fit_frequency_response(noisy(seed, Ts), 3)
        assert found.converged and np.all(np.abs(found.misfit - 1) < 0.15) and not found.warnings
        z.append((found.theta - TRUTH) / np.sqrt(np.diag(found.covariance)))
    assert 0.80 <= np.mean(np.abs(z) < 1.645) <= 0.97  # aimed at 0.9
    assert np.mean(np.abs(z) < 3) > 0.97


@pytest.mark.slow
def test_intervals_of_a_response_estimated_from_a_record_hold_the_parameters():
    z = []
    for seed in range(10):
        found = idn.fit_frequency_response(estimate(record(seed)), 3)
        assert np.all(np.abs(found.misfit - 1) < 0.15)
        z.append((found.theta - TRUTH) / np.sqrt(np.diag(found.covariance)))
        np.testing.assert_allclose(found.wn, modes(TRUTH)[0], rtol=2e-3)
    assert np.mean(np.abs(z) < 3) > 0.95


def test_the_stated_variance_of_h1_is_the_scatter_of_its_error():
    squares, stated = [], []
    for seed in range(10):
        found = estimate(record(seed, seconds=5.0))
        wanted = model().discrete(TS).transfer(found.omega)
        lines = (found.omega > 2 * np.pi * 20) & (found.omega < 2 * np.pi * 90)
        squares.append(np.abs(found.G - wanted)[lines] ** 2)
        stated.append(found.variance[lines])
    assert np.mean(squares) == pytest.approx(np.mean(stated), rel=0.35)  # leakage adds to it


def test_a_structure_of_ones_own_with_bounds_is_fitted_too_and_ambiguities_are_named():
    own = STRUCTURES["3"]
    bounds = tuple((-np.inf, np.inf) if name != "p_x" else (1000.0, 2000.0) for name in own.parameters)
    start = TRUTH.copy()
    start[12] = 1100.0
    bounded = idn.Structure("bounded", own.parameters, own.matrices, tuple(start), bounds)
    found = idn.fit_frequency_response(noisy(0), bounded)
    assert found.parameters["p_x"][0] == 1000 and np.isnan(found.parameters["p_x"][1])
    assert any("lower bound 1000" in text for text in found.warnings) and "at its bound" in found.report()
    double = idn.Structure(
        "double", (*own.parameters, "more"), lambda t: own.matrices(np.r_[t[:13], t[13] * t[14]]), (*TRUTH, 1.0)
    )
    with pytest.raises(UnfitError, match="p_y"):
        idn.fit_frequency_response(noisy(0), double)


def test_whole_periods_of_a_multisine_give_the_response_without_leakage():
    n, count = 5000, 4
    rng, t = np.random.default_rng(0), np.arange(n) * TS
    lines = (np.arange(5, 400, 2), np.arange(6, 400, 2))
    one = np.column_stack([sum(np.cos(2 * np.pi * k * t + rng.uniform(0, 6.3)) for k in own) / 20 for own in lines])
    u = np.tile(one, (count, 1))
    y = model().simulate(u, TS)
    found = idn.periodic_response(u, y, TS, n * TS)
    assert found.segments == 3 and len(found.omega) == sum(map(len, lines))
    known = np.isfinite(found.G)
    assert np.all(known.sum(axis=2) == 1)
    np.testing.assert_allclose(found.G[known], model().discrete(TS).transfer(found.omega)[known], rtol=1e-6)
    fitted = idn.fit_frequency_response(idn.periodic_response(u, y + 0.5e-6 * rng.normal(size=y.shape), TS, 1.0), 3)
    assert np.abs((fitted.theta - TRUTH) / np.sqrt(np.diag(fitted.covariance))).max() < 4


@pytest.mark.slow
def test_response_and_output_error_agree_on_records_of_the_rig_within_one_per_cent():
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
    sines = rs.experiments.multisine(plant, 0.0, 0.5e6, periods=6)
    u, y = sines["reference"].values, sines["disc_measured"].values
    periodic = idn.fit_frequency_response(idn.periodic_response(u, y, TS, 1.0), 3)
    np.testing.assert_allclose(periodic.wn, idn.identify(sines, 3).wn, rtol=0.01)
    bits = rs.experiments.prbs(plant, 0.0, 0.5e6, duration=10.0)
    found = idn.fit_frequency_response(estimate(bits), 3)
    np.testing.assert_allclose(found.wn, idn.identify(bits, 3).wn, rtol=0.01)
    assert any("the structure misses something" in text for text in found.warnings)  # one lag for two poles and a film


def test_what_a_structure_misses_shows_in_the_misfit():
    found = idn.fit_frequency_response(noisy(0, share=0.01), 1)  # knows no lag
    assert found.misfit.min() > 4 and "misses something" in found.warnings[-1]


def test_results_can_be_surfaces_and_their_models_saved(tmp_path):
    results = [
        idn.fit_frequency_response(replace(noisy(k), Ts=0.0), 3, speed=100.0 * k, pressure=5e5) for k in range(3)
    ]
    lpv = idn.fit_lpv(results, order=1)
    assert lpv.at(100.0, 5e5).wn == pytest.approx(modes(TRUTH)[0], rel=0.01)
    results[0].model.save(tmp_path / "response.json")
    assert idn.load_model(tmp_path / "response.json").order == 6


G0 = np.ones((5, 2, 2), complex)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: idn.fit_frequency_response(noisy(0), 2), "model 2"),
        (lambda: idn.identify(noisy(0), 3), "fit_frequency_response"),
        (lambda: idn.fit_frequency_response(noisy(0), 3, band=(420, 500)), "0 lines between 420 and 500 Hz"),
        (lambda: idn.fit_frequency_response(noisy(0), 3, band=(100, 102)), "parameters need 28"),
        (lambda: idn.fit_frequency_response(replace(noisy(0), G=noisy(0).G[:, :1]), 3), r"\(f, 2, 2\)"),
        (lambda: idn.fit_frequency_response(replace(noisy(0), G=noisy(0).G * np.nan), 3), "0 lines"),
        (lambda: idn.fit_frequency_response(noisy(0), 3, start=TRUTH[:3]), "3 values"),
        (lambda: idn.fit_frequency_response(noisy(0), 3, start=-TRUTH), "above zero|unstable"),
        (lambda: idn.fit_frequency_response(noisy(0), replace(STRUCTURES["3"], name="mine")), "start"),
        (lambda: idn.measured_response(OMEGA[::-1], noisy(0).G), "ascending"),
        (lambda: idn.measured_response(OMEGA, noisy(0).G[:5]), "ascending"),
        (lambda: idn.measured_response(OMEGA[:5], G0, np.zeros((5, 2, 2))), "measured_response.sd"),
        (lambda: idn.measured_response(OMEGA[:5], G0, np.ones((5, 2))), "measured_response.sd"),
        (lambda: idn.periodic_response(np.ones((100, 2)), np.ones((100, 2)), TS, 1.0), "period 1 s"),
        (lambda: idn.periodic_response(np.ones((100, 2)), np.ones((100, 2)), TS, 3.3 * TS), "whole number"),
        (
            lambda: idn.periodic_response(*(np.random.default_rng(0).normal(size=(90, 2)),) * 2, TS, 30 * TS),
            "periodic_response",
        ),
    ],
)
def test_unfit_input_is_refused_in_a_sentence(call, sentence):
    with pytest.raises(UnfitError, match=sentence):
        call()


@pytest.mark.parametrize("resolution", [3000.0, 0.26 / TS, 0.0, -1.0, np.nan])
def test_lines_that_leave_a_segment_fewer_than_four_samples_are_refused(resolution):
    u, y = np.random.default_rng(0).normal(size=(2, 200, 2))
    with refused(UnfitError, "resolution", resolution):
        idn.frequency_response(u, y, TS, resolution)
    assert len(idn.frequency_response(u, y, TS, 0.25 / TS).omega) == 2


@pytest.mark.parametrize("length", [400, 401])
def test_h1_of_one_input_is_that_of_welch(length):
    """Every whole segment counts once, and none is filled up with zeros: SciPy's estimate on the same segments."""
    rng, n = np.random.default_rng(0), 5000
    u = rng.normal(size=(n, 1))
    y = lfilter([0.0, 1.0, 0.5], [1.0, -1.6, 0.9], u, axis=0)
    found = idn.frequency_response(u, y, 1.0, resolution=1 / length)
    how = {"fs": 1.0, "window": "hann", "nperseg": length, "noverlap": length - length // 2, "detrend": False}
    power = welch(u[:, 0] - u.mean(), **how)[1]
    cross = csd(u[:, 0] - u.mean(), y[:, 0] - y.mean(), **how)[1]
    np.testing.assert_allclose(found.G[:, 0, 0], (cross / power)[1:], rtol=1e-7)
    assert found.segments == (n - length) // (length // 2) + 1
